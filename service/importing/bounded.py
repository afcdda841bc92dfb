"""Has a child process read the files of an import, and takes its answer."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
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

HEAD = 1_000  # bytes, more than a short answer takes where the bounds are small


class ReaderFailedError(Exception):
    """A defect: the process that reads ended by an exception; the message is the name of its kind."""


@dataclass(frozen=True, slots=True)
class ReadMap:
    """The map that was read from the files.

    Attributes
    ----------
    map : bytes
        A map file of our own, JSON; not checked yet.
    report : dict
        The data that was read, merged, dropped and assumed.
    picture : dict or None
        Of the grid that the map comes from.
    """

    map: bytes
    report: dict[str, Any]
    picture: dict[str, Any] | None = None


@dataclass(frozen=True, slots=True)
class ReadScans:
    """Scans of a log: JSON, an object with a list; the number of scans in the log; the report of reading it."""

    scans: bytes
    count: int
    report: dict[str, Any]


def read_apart(content: bytearray, content_type: str, bounds: Bounds, deadline: Deadline) -> ReadMap:
    """Read the map in a form; takes a while.

    Parameters
    ----------
    content : bytearray
        multipart/form-data.
    content_type : str
        With its boundary.
    bounds : Bounds
    deadline : Deadline

    Raises
    ------
    ServiceError, InvalidRequestError
        When it is not read.
    CancelledError
        When no caller waits for it any longer.
    """
    head, line_map = _read(content, content_type, bounds, deadline, scans=False)
    return ReadMap(line_map, head["report"], head["picture"])


def read_scans_apart(content: bytearray, content_type: str, bounds: Bounds, deadline: Deadline) -> ReadScans:
    """Read the scans of the log in a form; otherwise as `read_apart`."""
    head, scans = _read(content, content_type, bounds, deadline, scans=True)
    return ReadScans(scans, int(head["count"]), head["report"])


def _read(
    content: bytearray, content_type: str, bounds: Bounds, deadline: Deadline, *, scans: bool
) -> tuple[dict[str, Any], bytes]:
    """Return the first line of the answer, and the rest, which is not parsed."""
    of_child = ChildBounds(
        bounds.memory_bytes, bounds.cpu_seconds, bounds.file_bytes, answer_bytes=bounds.file_bytes + HEAD
    )
    with _folder() as folder, closing(Child(of_child, folder)) as child:
        asked = content, content_type, str(folder), bounds, scans
        try:
            said = child.call(read_form_apart, *asked, ends=lambda: deadline.cancelled or deadline.passed)
        except ParserEndedError as ended:
            if deadline.cancelled:
                raise CancelledError from None
            if deadline.passed:
                raise ImportTooLateError from None
            raise _cause(ended.status, bounds) from None
    first, _, rest = said.partition(b"\n")
    head = orjson.loads(first)
    _require_report(head)
    return head, rest


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
        case {"missing": _}:
            raise FormatsMissingError
        case {"no_room": _}:
            raise NoRoomError
        case {"unknown": str(why)}:
            raise UnknownFormatError(why)
        case {"too_large": str(why)}:
            raise FileTooLargeError(why)
        case {"invalid": list(faults)}:
            raise InvalidRequestError([Fault(**fault) for fault in faults])
        case {"failed": str(kind)}:
            raise ReaderFailedError(kind)
    raise ReaderFailedError("the output has neither a report nor a known error")


@contextmanager
def _folder() -> Iterator[Path]:
    """Give a folder for the files, which goes with all that is in it."""
    try:
        with own_folder() as folder:
            yield folder
    except OSError as error:
        raise NoRoomError from error
