"""The program of the child of an import: it turns a form into a map, or scans of a log, and a report.

The files come from untrusted senders, and the libraries that read them are many and large. So the child has no more
memory and time than it was given and no keys in its environment. Its answer is JSON, which is checked.
"""

from __future__ import annotations

import base64
import errno
import io
import math
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import orjson

from linefix.documents.errors import InvalidRequestError

from ..errors import FileTooLargeError, FormatsMissingError, NoRoomError, ServiceError
from .fields import ScansForm, options_of, read_fields
from .own_files import Lines, OwnFiles, read_own

if TYPE_CHECKING:
    from formats import GridPicture, ImportedMap

FULL = (errno.ENOSPC, errno.EDQUOT)  # disks
MOST_PIXELS = 2048  # of a picture, each way
CPU_SECONDS = 20  # of a processor
DEFAULT_SCANS = 100  # of a log, evenly spread


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


def read_form_apart(content: bytes, content_type: str, folder: str, bounds: Bounds, scans: bool) -> bytes:
    """Return lines of JSON: a report and the content of the files in a form, or an error."""
    try:
        if scans:
            lines = read_scans(content, content_type, Path(folder))
        else:
            lines = read_files(content, content_type, Path(folder), bounds)
    except InvalidRequestError as error:
        lines = [{"invalid": [asdict(fault) for fault in error.faults]}]
    except ServiceError as error:
        lines = _refused(error)
    except ModuleNotFoundError:
        lines = _refused(FormatsMissingError())
    except (MemoryError, RecursionError):
        lines = _refused(FileTooLargeError("reading the file takes more memory than is allowed; simplify the file"))
    except Exception as error:  # a defect, or a full disk; only its kind is returned, nothing of the file
        full = isinstance(error, OSError) and error.errno in FULL
        lines = _refused(NoRoomError()) if full else [{"failed": type(error).__name__}]
    printed = _printed(lines)
    if len(printed) > bounds.file_bytes:  # such a map could not be put either
        most = bounds.file_bytes
        return _printed(
            _refused(FileTooLargeError(f"expected an answer of at most {most} bytes, found more; send less"))
        )
    return printed


def _refused(error: ServiceError) -> Lines:
    return [{"refused": type(error).__name__, "why": str(error)}]


def _printed(lines: Lines) -> bytes:
    option = orjson.OPT_SERIALIZE_NUMPY | orjson.OPT_APPEND_NEWLINE
    return b"".join(orjson.dumps(line, option=option) for line in lines)


def read_files(content: bytes, content_type: str, folder: Path, bounds: Bounds) -> Lines:
    """Return a report and a map.

    Raises
    ------
    InvalidRequestError, ServiceError
        When the form, an option or a file is wrong; when it is not read.
    """
    from formats import MAP_SUFFIXES, read_map

    from .form import read_form

    form = read_form(content, content_type)
    options = options_of(form.fields)

    def read(files: OwnFiles) -> Lines:
        imported = read_map(files.map, options, files.paths)
        for name, found in (("segments", len(imported.map.segments)), ("points", len(imported.map.points))):
            if found > bounds.segments:
                raise FileTooLargeError(f"expected at most {bounds.segments} {name}, found {found}; simplify the file")
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


def read_scans(content: bytes, content_type: str, folder: Path) -> Lines:
    """Return a report and scans.

    Raises
    ------
    InvalidRequestError, ServiceError
        When the form, an option or a file is wrong; when it is not read.
    """
    from formats import LOG_SUFFIXES, LogOptions, read_log, scan_json, thinned

    from .form import read_form

    form = read_form(content, content_type)
    options = read_fields(form.fields, ScansForm.fields)

    def read(files: OwnFiles) -> Lines:
        log = read_log(files.map, LogOptions(topic=options.get("topic")))
        chosen, count = thinned(log, options.get("max_scans", DEFAULT_SCANS))
        report = asdict(log.report)
        report["files"] = tuple(map(files.as_sent, report["files"]))
        return [{"report": report, "count": count}, {"scans": list(map(scan_json, chosen))}]

    return read_own(form, folder, read, LOG_SUFFIXES, "log", "one log, or a bag with its metadata.yaml")
