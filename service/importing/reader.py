"""The program of the bounded process: a form on stdin to a map, or scans, and a report on stdout.

The files come from untrusted senders, and the libraries that read them are many and large. So this process has no more
memory and time than it was given and no keys in its environment. Its output is JSON, which is checked.
"""

from __future__ import annotations

import base64
import errno
import io
import math
import os
import resource
import shutil
import sys
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import orjson

from linefix.documents.errors import InvalidRequestError

from .own_files import Lines, OwnFiles, read_own
from .scans import read_scans

if TYPE_CHECKING:
    from formats import GridPicture, ImportedMap

MAPPED_BYTES = 1_000_000_000  # of address space in addition to the memory: libraries, and room that is never used
MOST_OPEN = 64  # files
NICE = 5  # searches go before it, at three times as much of a core that both want
FULL = (errno.ENOSPC, errno.EDQUOT)  # disks
MOST_PIXELS = 2048  # of a picture, each way
CPU_SECONDS = 20  # of a processor
NO_ROOM = 3  # status of the process that reads where its files cannot be written
OOM_SCORE = "1000"  # the first to go where the machine's memory ends


@dataclass(frozen=True, slots=True)
class Bounds:
    """Limits of reading one map.

    Attributes
    ----------
    memory_bytes : int
        Of the process that reads.
    file_bytes : int
        Of one file.
    segments : int
        Of the map; as many points.
    cpu_seconds : int
        Of a processor.
    """

    memory_bytes: int
    file_bytes: int
    segments: int
    cpu_seconds: int = CPU_SECONDS


def main(told: str, folder: str) -> None:
    """Read the form on stdin, its files put into a folder; print a report and the content, or the error."""
    asked = orjson.loads(told)
    bounds = Bounds(**asked["bounds"])
    _bind(bounds)
    try:
        content, content_type = sys.stdin.buffer.read(), asked["content_type"]
        if asked["scans"]:
            lines = read_scans(content, content_type, Path(folder))
        else:
            lines = read_files(content, content_type, Path(folder), bounds)
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
        {"too_large": f"expected an answer of at most {most} bytes, found more; send less"},
        option=option,
    )


def _bind(bounds: Bounds) -> None:
    """Take away from this process all that it does not need."""
    most = bounds.memory_bytes
    for what, limit in (
        (resource.RLIMIT_DATA, most),
        (resource.RLIMIT_AS, most + MAPPED_BYTES),
        (resource.RLIMIT_CPU, bounds.cpu_seconds),
        (resource.RLIMIT_FSIZE, bounds.file_bytes),
        (resource.RLIMIT_NOFILE, MOST_OPEN),
        (resource.RLIMIT_CORE, 0),
    ):
        with suppress(ValueError, OSError):  # less is allowed already, or the system has no such limit
            resource.setrlimit(what, (limit, limit))
    with suppress(OSError):
        os.nice(NICE)
    with suppress(OSError):
        Path("/proc/self/oom_score_adj").write_text(OOM_SCORE)


def read_files(content: bytes, content_type: str, folder: Path, bounds: Bounds) -> Lines:
    """Return a report and a map, or an error for which there is another status than 422.

    Raises
    ------
    InvalidRequestError
        When the form, an option or a file is wrong.
    """
    from formats import MAP_SUFFIXES, read_map

    from .fields import options_of
    from .form import read_form

    form = read_form(content, content_type)
    options = options_of(form.fields)

    def read(files: OwnFiles) -> Lines:
        imported = read_map(files.map, options, files.paths)
        for name, found in (("segments", len(imported.map.segments)), ("points", len(imported.map.points))):
            if found > bounds.segments:
                return [{"too_large": f"expected at most {bounds.segments} {name}, found {found}; simplify the file"}]
        return _answer(imported, files)

    return read_own(form, folder, read, MAP_SUFFIXES, "map", "one map and the files that it names, such as a picture")


def _answer(imported: ImportedMap, files: OwnFiles) -> Lines:
    line_map, report = imported.map, asdict(imported.report)
    document = {**line_map.document, "meta": {key: files.as_sent(value) for key, value in line_map.meta.items()}}
    report["files"] = tuple(map(files.as_sent, report["files"]))
    return [
        {"report": report, "picture": None if imported.picture is None else picture_json(imported.picture)},
        document,
    ]


def picture_json(picture: GridPicture) -> dict[str, Any]:
    """Return the picture of a grid as PNG, of at most `MOST_PIXELS` pixels each way."""
    from PIL import Image

    image = Image.fromarray(picture.pixels)
    factor = -(-max(image.size) // MOST_PIXELS)
    rows = image.height
    if factor > 1:
        image = image.reduce(factor)
    content = io.BytesIO()
    image.save(content, "PNG")
    # The excess of the last row of a reduced picture lies below the grid.
    below = (image.height * factor - rows) * picture.resolution
    pose = picture.pose
    return {
        "png": base64.b64encode(content.getvalue()).decode(),
        "pose": {
            "x": pose.x + below * math.sin(pose.theta),
            "y": pose.y - below * math.cos(pose.theta),
            "theta": pose.theta,
        },
        "resolution": factor * picture.resolution,
    }


if __name__ == "__main__":
    told, folder, service = sys.argv[1:]
    try:
        main(told, folder)
    except Exception as error:  # a defect; only its kind is printed, nothing of the file
        print(f"{type(error).__name__}", file=sys.stderr, flush=True)
        os._exit(NO_ROOM if isinstance(error, OSError) and error.errno in FULL else 1)
    finally:
        if os.getppid() != int(service):  # it was killed, and removes nothing any more
            shutil.rmtree(folder, ignore_errors=True)
