"""What runs in the bounded process: a form on stdin to a map and a report on stdout.

The files are those of strangers, and the libraries that read them are many and large. So this process has no more
memory and time than it was given and no keys in its environment, and what it says is JSON, which is checked.
"""

from __future__ import annotations

import os
import resource
import sys
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import orjson

from ..schemas.errors import Fault, InvalidRequestError
from .bounds import Bounds

if TYPE_CHECKING:
    from formats import FormatError, ImportedMap

MAPPED_BYTES = 1_000_000_000  # of address space beside the memory: libraries, and room that is never used
MOST_OPEN = 64  # files
OOM_SCORE = "1000"  # the first to go where the machine's memory ends


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
        lines = [{"too_large": "reading it takes more memory than it may have"}]
    for line in lines:
        sys.stdout.buffer.write(orjson.dumps(line, option=orjson.OPT_SERIALIZE_NUMPY | orjson.OPT_APPEND_NEWLINE))
    sys.stdout.flush()


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
        path = _map_among(names, folder)
        for name, data in form.files.items():
            (folder / name).write_bytes(data)
        form.files.clear()
        imported = read_map(path, options)
    except TooLargeError as error:
        return [{"too_large": error.message}]
    except UnsupportedFormatError as error:
        return [{"unknown": error.message}]
    except FormatError as error:
        raise InvalidRequestError([_fault(error, names)]) from None
    except OSError as error:
        if error.filename is None or Path(error.filename).parent != folder:
            raise
        raise InvalidRequestError([Fault("/files", "a file cannot have this name")]) from None
    if len(imported.map.segments) > bounds.segments:
        return [{"too_large": f"at most {bounds.segments} segments are taken"}]
    return _answer(imported)


def _map_among(names: list[str], folder: Path) -> Path:
    """Return the file that is the map; the others are those that it names.

    Raises
    ------
    InvalidRequestError
        When there is none, or more than one.
    """
    from formats import MAP_SUFFIXES, UnsupportedFormatError

    if "metadata.yaml" in names:
        return folder  # that of a bag of ROS 2
    maps = [name for name in names if Path(name).suffix.lower() in MAP_SUFFIXES]
    if len(maps) > 1:
        raise InvalidRequestError([Fault("/files", "expected one map, and beside it what it names, such as a picture")])
    if not names:
        raise InvalidRequestError([Fault("/files", "expected a file: a part of the form with a filename")])
    if not maps:
        known = ", ".join(MAP_SUFFIXES)
        raise UnsupportedFormatError(f"expected a file that ends in one of {known}", argument="files")
    return folder / maps[0]


def _fault(error: FormatError, names: list[str]) -> Fault:
    """Say where in the form something is wrong: a file by its number, for what was sent is not repeated."""
    from formats import IncompleteFileError

    from .fields import KNOWN, pointer_of

    pointer = pointer_of(error.argument)
    if isinstance(error, IncompleteFileError) and error.argument not in names:
        return Fault("/files", "the file that the map names, such as its picture, was not sent")
    if pointer[1:] not in KNOWN:
        pointer = f"/files/{names.index(error.argument)}" if error.argument in names else "/files"
    elif error.index is not None:
        pointer += f"/{error.index}"
    return Fault(pointer, error.message)


def _answer(imported: ImportedMap) -> list[dict[str, Any]]:
    line_map = imported.map
    document = {
        "segments": line_map.segments.endpoints,
        "sigma": line_map.sigma,
        "oriented": line_map.oriented,
        "frame_id": line_map.frame_id,
        "meta": line_map.meta,
    }
    return [{"report": asdict(imported.report)}, document]


if __name__ == "__main__":
    try:
        main(*sys.argv[1:])
    except Exception as error:  # a defect; its kind is told, and nothing of the file
        print(f"{type(error).__name__}", file=sys.stderr)
        os._exit(1)
