"""Has a child process read the files of an import, and takes its answer."""

from __future__ import annotations

import signal
from contextlib import closing
from dataclasses import dataclass
from typing import Any

import orjson

from association import CancelledError, Deadline
from linefix.documents.errors import Fault, InvalidRequestError

from ..errors import (
    FileTooLargeError,
    FormatsMissingError,
    ImportTooLateError,
    NoRoomError,
    ParserEndedError,
    UnknownFormatError,
)
from ..parsing.child import Child, ChildBounds
from .folders import own_folder
from .reader import Bounds, read_form_apart

REFUSALS = {kind.__name__: kind for kind in (FileTooLargeError, FormatsMissingError, NoRoomError, UnknownFormatError)}
HEAD = 1_000  # bytes, more than a short answer takes where the bounds are small


class ReaderFailedError(Exception):
    """A defect: the process that reads ended by an exception; the message is the name of its kind."""


@dataclass(frozen=True, slots=True)
class ReadFiles:
    """The content of the files in a form.

    Attributes
    ----------
    head : dict
        `report`: the data that was read, merged, dropped and assumed. Of a map also the `picture` of the grid that it
        comes from, or None; of a log the `count` of its scans.
    content : bytes
        JSON: a map file of our own, not checked yet; or an object with a list of scans.
    """

    head: dict[str, Any]
    content: bytes


def read_apart(
    content: bytearray, content_type: str, bounds: Bounds, deadline: Deadline, *, scans: bool = False
) -> ReadFiles:
    """Read the map in a form, or the scans of a log; takes a while.

    Parameters
    ----------
    content : bytearray
        multipart/form-data.
    content_type : str
        With its boundary.
    bounds : Bounds
    deadline : Deadline
    scans : bool
        True for a log.

    Raises
    ------
    ServiceError, InvalidRequestError
        When it is not read.
    CancelledError
        When no caller waits for it any longer.
    """
    of_child = ChildBounds(
        bounds.memory_bytes, bounds.cpu_seconds, bounds.file_bytes, answer_bytes=bounds.file_bytes + HEAD
    )
    try:
        with own_folder() as folder, closing(Child(of_child, folder)) as child:
            asked = content, content_type, str(folder), bounds, scans
            said = child.call(read_form_apart, *asked, ends=lambda: deadline.cancelled or deadline.passed)
    except OSError as error:
        raise NoRoomError from error
    except ParserEndedError as ended:
        if deadline.cancelled:
            raise CancelledError from None
        if deadline.passed:
            raise ImportTooLateError from None
        raise _cause(ended.status, bounds) from None
    first, _, rest = said.partition(b"\n")
    head = orjson.loads(first)
    _require_report(head)
    return ReadFiles(head, rest)


def _cause(status: int | None, bounds: Bounds) -> Exception:
    """Return what the status of a child that ended without an answer means."""
    if status is None:
        return NoRoomError()
    if status in (-signal.SIGXCPU, -signal.SIGKILL, 0):
        return FileTooLargeError(
            f"reading the file takes more than {bounds.cpu_seconds} s of processor time, or too much memory; "
            "simplify it"
        )
    return InvalidRequestError(
        [Fault("/files", "the process that reads the file crashed: the file is damaged; export it again")]
    )


def _require_report(told: dict[str, Any]) -> None:
    match told:
        case {"report": dict()}:
            return
        case {"refused": str(kind), "why": str(why)} if kind in REFUSALS:
            raise REFUSALS[kind](why)
        case {"invalid": list(faults)}:
            raise InvalidRequestError([Fault(**fault) for fault in faults])
        case {"failed": str(kind)}:
            raise ReaderFailedError(kind)
    raise ReaderFailedError("the output has neither a report nor a known error")
