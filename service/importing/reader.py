"""What runs in the bounded process: a form on stdin to a map and a report on stdout.

The files are those of strangers, and the libraries that read them are many and large. So this process has no more
memory and time than it was given and no keys in its environment, and what it says is JSON, which is checked.
"""

from __future__ import annotations

import errno
import os
import re
import resource
import shutil
import sys
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any

import orjson

from ..schemas.errors import Fault, InvalidRequestError

if TYPE_CHECKING:
    from formats import FormatError, ImportedMap

MAPPED_BYTES = 1_000_000_000  # of address space beside the memory: libraries, and room that is never used
MOST_OPEN = 64  # files
NICE = 5  # searches go before it, at three times as much of a core that both want
FULL = (errno.ENOSPC, errno.EDQUOT)  # disks
METADATA, BAG = "metadata.yaml", "bag"
PLAIN = re.compile(r"[A-Za-z0-9_][A-Za-z0-9 ._()+=@-]*")
PLAIN_NAMES = "expected a file name of letters, digits, spaces and ._()+=@- for a file of a bag; rename the file"
ENDING = re.compile(r"\.[a-z0-9]{1,8}")
CPU_SECONDS = 20  # of a processor
NO_ROOM = 3  # status of the process that reads where its files cannot be written
OOM_SCORE = "1000"  # the first to go where the machine's memory ends


@dataclass(frozen=True, slots=True)
class Bounds:
    """How much reading one map may take.

    Attributes
    ----------
    memory_bytes : int
        Of the process that reads.
    file_bytes : int
        Of one file.
    segments : int
        Of the map.
    cpu_seconds : int
        Of a processor.
    """

    memory_bytes: int
    file_bytes: int
    segments: int
    cpu_seconds: int = CPU_SECONDS


def main(told: str, folder: str) -> None:
    """Read the form on stdin, its files put into a folder; print a report and a map, or why there are none."""
    asked = orjson.loads(told)
    bounds = Bounds(**asked["bounds"])
    _bind(bounds)
    try:
        lines = read_files(sys.stdin.buffer.read(), asked["content_type"], Path(folder), bounds)
    except InvalidRequestError as error:
        lines = [{"invalid": [asdict(fault) for fault in error.faults]}]
    except ModuleNotFoundError:
        lines = [{"missing": True}]
    except (MemoryError, RecursionError):
        lines = [{"too_large": "reading the file takes more memory than is allowed; simplify the file"}]
    sys.stdout.buffer.write(_printed(lines, bounds.file_bytes))
    sys.stdout.flush()


def _printed(lines: list[dict[str, Any]], most: int) -> bytes:
    """Return lines as JSON, or one line with an error where they are too long: such a map could not be put either."""
    option = orjson.OPT_SERIALIZE_NUMPY | orjson.OPT_APPEND_NEWLINE
    printed = b"".join(orjson.dumps(line, option=option) for line in lines)
    if len(printed) <= most:
        return printed
    return orjson.dumps(
        {"too_large": f"expected a map and a report of at most {most} bytes, found more; simplify the file"},
        option=option,
    )


def _bind(bounds: Bounds) -> None:
    """Take away from this process what it does not need."""
    most = bounds.memory_bytes
    for what, limit in (
        (resource.RLIMIT_DATA, most),
        (resource.RLIMIT_AS, most + MAPPED_BYTES),
        (resource.RLIMIT_CPU, bounds.cpu_seconds),
        (resource.RLIMIT_FSIZE, bounds.file_bytes),
        (resource.RLIMIT_NOFILE, MOST_OPEN),
        (resource.RLIMIT_CORE, 0),
    ):
        with suppress(ValueError, OSError):  # less is allowed already, or the system knows no such limit
            resource.setrlimit(what, (limit, limit))
    with suppress(OSError):
        os.nice(NICE)
    with suppress(OSError):
        Path("/proc/self/oom_score_adj").write_text(OOM_SCORE)


def read_files(content: bytes, content_type: str, folder: Path, bounds: Bounds) -> list[dict[str, Any]]:
    """Return a report and a map, or an error for which there is another status than 422.

    Raises
    ------
    InvalidRequestError
        When the form, an option or a file is wrong.
    """
    from formats import FormatError, TooLargeError, UnsupportedFormatError, read_map

    from .fields import options_of
    from .form import read_form

    form = read_form(content, content_type)
    options = options_of(form.fields)
    names = list(form.files)
    try:
        files = own_files(names, _map_among(names), folder)
        for name, data in form.files.items():
            files.paths[name].write_bytes(data)
        form.files.clear()
        imported = read_map(files.map, options, files.paths)
    except TooLargeError as error:
        return [{"too_large": error.message}]
    except UnsupportedFormatError as error:
        return [{"unknown": error.message}]
    except FormatError as error:
        raise InvalidRequestError([_fault(error, files)]) from None
    if len(imported.map.segments) > bounds.segments:
        return [
            {
                "too_large": f"expected at most {bounds.segments} segments, found {len(imported.map.segments)}; "
                "simplify the file"
            }
        ]
    return _answer(imported, files)


@dataclass(frozen=True, slots=True)
class OwnFiles:
    """Uploaded files under names of our own: no path is made of an uploaded name.

    Attributes
    ----------
    map : Path
        Of the file that is the map, or the folder of a bag of ROS 2.
    paths : dict of str to Path
        By the names that were sent.
    """

    map: Path
    paths: dict[str, Path]

    def number_of(self, own: str) -> int | None:
        """Return which of the files has a name of our own; None where none has."""
        return next((k for k, path in enumerate(self.paths.values()) if path.name == own), None)

    def as_sent(self, own: str) -> str:
        """Return the name that was sent of what has a name of our own, fit to be printed; anything else as it is."""
        number = self.number_of(own)
        return own if number is None else "".join(c if c.isprintable() else "?" for c in list(self.paths)[number])


def own_files(names: list[str], map_name: str, folder: Path) -> OwnFiles:
    """Return where files are put that were sent; of their names an ending stays.

    A bag of several files names them in its metadata: these keep names that are letters, digits and a few signs.

    Raises
    ------
    InvalidRequestError
        When a file of such a bag has another name.
    """
    if map_name == METADATA:
        bag = folder / BAG
        bag.mkdir()
        for number, name in enumerate(names):
            if not PLAIN.fullmatch(name):
                raise InvalidRequestError([Fault(f"/files/{number}", PLAIN_NAMES)])
        return OwnFiles(bag, {name: bag / name for name in names})
    paths = {}
    for number, name in enumerate(names):
        ending = PurePosixPath(name).suffix.lower()
        paths[name] = folder / f"file-{number}{ending if ENDING.fullmatch(ending) else ''}"
    return OwnFiles(paths[map_name], paths)


def _map_among(names: list[str]) -> str:
    """Return which file is the map; the others are those that it names. Of a bag of ROS 2 it is the metadata.

    Raises
    ------
    InvalidRequestError
        When there is none, or more than one.
    """
    from formats import MAP_SUFFIXES, UnsupportedFormatError

    if METADATA in names:
        return METADATA
    maps = [name for name in names if PurePosixPath(name).suffix.lower() in MAP_SUFFIXES]
    if len(maps) > 1:
        raise InvalidRequestError(
            [
                Fault(
                    "/files", f"expected one map and the files that it names, such as a picture; found {len(maps)} maps"
                )
            ]
        )
    if not names:
        raise InvalidRequestError(
            [Fault("/files", "expected a file, found none; send a part of the form that has a filename")]
        )
    if not maps:
        known = ", ".join(MAP_SUFFIXES)
        raise UnsupportedFormatError(f"found no map; expected a file that ends in one of {known}", argument="files")
    return maps[0]


def _fault(error: FormatError, files: OwnFiles) -> Fault:
    """Say where in the form something is wrong: a file by its number, for what was sent is not repeated."""
    from formats import IncompleteFileError

    from .fields import KNOWN, pointer_of

    pointer, number = pointer_of(error.argument), files.number_of(error.argument)
    if isinstance(error, IncompleteFileError) and number is None and pointer[1:] not in KNOWN:
        return Fault("/files", "the map names a file that was not sent, such as its picture; send it, too")
    if pointer[1:] not in KNOWN:
        pointer = "/files" if number is None else f"/files/{number}"
    elif error.index is not None:
        pointer += f"/{error.index}"
    return Fault(pointer, error.message)


def _answer(imported: ImportedMap, files: OwnFiles) -> list[dict[str, Any]]:
    line_map, report = imported.map, asdict(imported.report)
    document = {
        "segments": line_map.segments.endpoints,
        "sigma": line_map.sigma,
        "oriented": line_map.oriented,
        "frame_id": line_map.frame_id,
        "meta": {key: files.as_sent(value) for key, value in line_map.meta.items()},
    }
    report["files"] = tuple(map(files.as_sent, report["files"]))
    return [{"report": report}, document]


if __name__ == "__main__":
    told, folder, service = sys.argv[1:]
    try:
        main(told, folder)
    except Exception as error:  # a defect; its kind is told, and nothing of the file
        print(f"{type(error).__name__}", file=sys.stderr, flush=True)
        os._exit(NO_ROOM if isinstance(error, OSError) and error.errno in FULL else 1)
    finally:
        if os.getppid() != int(service):  # it was killed, and removes nothing any more
            shutil.rmtree(folder, ignore_errors=True)
