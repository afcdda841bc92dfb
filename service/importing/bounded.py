"""Starts the process that reads a map of another tool, waits for it, and ends it when the time is over."""

from __future__ import annotations

import os
import signal
import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import IO, Any

import orjson

from association import CancelledError, Deadline
from linefix.documents.errors import Fault, InvalidRequestError

from ..parsing.parser_process import command_of
from .errors import FileTooLargeError, FormatsMissingError, NoRoomError, TooLateError, UnknownFormatError
from .folders import own_folder
from .reader import NO_ROOM, Bounds

READER = "service.importing.reader"
LOOK_SECONDS = 0.05  # between two checks that the caller still waits
# Variables of the environment for the service alone: keys, their paths, passwords of databases and of collectors.
PRIVATE = ("LINEFIX_", "PG", "OTEL_")
SHARED = ("LINEFIX_KERNELS",)
ANSWER, FAILURE = "answer", "failure"  # files in the folder of one import


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
    """Scans of a log.

    Attributes
    ----------
    scans : bytes
        JSON, an object with a list.
    count : int
        Number of scans in the log.
    report : dict
        The data that was read, merged, dropped and assumed.
    """

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
    ImportingError, InvalidRequestError
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
    """Return the first line that the process prints, and the rest, which is not parsed."""
    asked = {"bounds": asdict(bounds), "content_type": content_type, "scans": scans}
    told = orjson.dumps(asked).decode()
    with _folder() as folder:
        status = _ended(command_of(READER, told, str(folder), str(os.getpid())), folder, content, deadline)
        with (folder / ANSWER).open("rb") as answer, (folder / FAILURE).open("rb") as failures:
            said, failure = answer.read(bounds.file_bytes), failures.read(100)
    if status == NO_ROOM:
        raise NoRoomError
    if status == 1:
        raise ReaderFailedError(failure.decode("ascii", "replace"))
    if status in (-signal.SIGXCPU, -signal.SIGKILL):
        raise FileTooLargeError(
            f"reading the file takes more than {bounds.cpu_seconds} s of processor time, or too "
            "much memory; simplify it"
        )
    if status != 0:
        raise InvalidRequestError(
            [Fault("/files", "the process that reads the file crashed: the file is damaged; export it again")]
        )
    first, _, rest = said.partition(b"\n")
    head = orjson.loads(first)
    _require_report(head)
    return head, rest


def _require_report(told: dict[str, Any]) -> None:
    match told:
        case {"report": dict()}:
            return
        case {"missing": _}:
            raise FormatsMissingError
        case {"unknown": str(why)}:
            raise UnknownFormatError(why)
        case {"too_large": str(why)}:
            raise FileTooLargeError(why)
        case {"invalid": list(faults)}:
            raise InvalidRequestError([Fault(**fault) for fault in faults])
    raise ReaderFailedError("the output has neither a report nor a known error")


def _ended(command: list[str], folder: Path, content: bytearray, deadline: Deadline) -> int:
    """Run a process to its end and return its status; its output is put into `ANSWER` and `FAILURE`.

    They are files, which may not grow beyond what one file may: the process is not relied on to write little.
    """
    told = {name for name in os.environ if name in SHARED or not name.upper().startswith(PRIVATE)}
    # Libraries that it uses put their own temporary files where those go that were sent.
    clean = {**{name: os.environ[name] for name in told}, "TMPDIR": str(folder)}
    with (
        (folder / ANSWER).open("wb") as answer,
        (folder / FAILURE).open("wb") as failure,
        # In a group of its own, so that Ctrl-C is for the service, which then ends this.
        subprocess.Popen(
            command, env=clean, process_group=0, stdin=subprocess.PIPE, stdout=answer, stderr=failure
        ) as process,
    ):
        # A thread of its own writes the form: this one checks the deadline.
        pipe, process.stdin = process.stdin, None
        assert pipe is not None
        feeding = threading.Thread(target=_feed, args=(pipe, content))
        feeding.start()
        try:
            while True:
                with suppress(subprocess.TimeoutExpired):
                    return process.wait(LOOK_SECONDS)
                if deadline.cancelled:
                    raise CancelledError
                if deadline.passed:
                    raise TooLateError
        finally:
            process.kill()
            feeding.join()


def _feed(pipe: IO[bytes], content: bytearray) -> None:
    with suppress(OSError), pipe:  # the reading process may have ended
        pipe.write(content)


@contextmanager
def _folder() -> Iterator[Path]:
    """Give a folder for the files, which goes with all that is in it."""
    try:
        with own_folder() as folder:
            yield folder
    except OSError as error:
        raise NoRoomError from error
