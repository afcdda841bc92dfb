"""Files of the command line to parts of requests."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .errors import RefusedError, WrongUseError
from .printing import Json, noted, plain

if TYPE_CHECKING:
    from formats import ImportReport, LineMap

STDIN = "-"
BYTE_ORDER_MARK = b"\xef\xbb\xbf"  # that some editors put in front of UTF-8
WIDE = (b"\xff\xfe", b"\xfe\xff")  # what UTF-16 begins with, as a redirection in PowerShell writes it
MAX_VALUES = 1_000_000_000  # of a file; what a request may hold is the service's business
MAP_ID = re.compile(r"[A-Za-z0-9._-]{1,128}")
FILES = (".json", ".yaml", ".yml", ".dxf", ".svg", ".geojson", ".csv", ".bag", ".mcap", ".db3")  # never meant as ids
RECORDINGS = ("rosbag1", "rosbag2", "mcap")
CHOICE = ("grids", "topic", "costmap", "orientation")  # codes of notes of the grid that was read


def bytes_of(name: str) -> bytes:
    """Return the content of a text file; ``-`` reads stdin. A byte-order mark is left out.

    Raises
    ------
    WrongUseError
        When there is no such file, or it cannot be read.
    RefusedError
        When it is text in UTF-16.
    """
    try:
        data = sys.stdin.buffer.read() if name == STDIN else Path(name).read_bytes()
    except OSError as error:
        raise WrongUseError(f"{name}: {error.strerror}") from None
    if data.startswith(WIDE):
        raise RefusedError(f"{name}: found text in UTF-16, expected UTF-8; save the file as UTF-8")
    return data.removeprefix(BYTE_ORDER_MARK)


def json_of(data: bytes) -> Any:
    """Parse JSON; raises `NotJsonError`, and `TooManyError` when there are more values than any request may have."""
    from linefix.documents.limits import Limits
    from linefix.documents.reading import parse

    return parse(data, Limits(values=MAX_VALUES))


def read_json(name: str) -> Any:
    """Return the content of a file of JSON; ``-`` reads it from stdin.

    Raises
    ------
    WrongUseError
        When there is no such file, or it cannot be read.
    RefusedError
        When it is not JSON.
    """
    from linefix.documents.errors import NotJsonError, TooManyError

    data = bytes_of(name)
    try:
        return json_of(data)
    except (NotJsonError, TooManyError) as error:
        raise RefusedError(f"{name}: not JSON: {error}") from None


def read_map_or_id(name: str) -> Json:
    """Return the map of a request: that of a file, or the id of a stored one where there is no such file.

    Raises
    ------
    WrongUseError
        When it is neither.
    RefusedError
        When the file is not taken.
    """
    if not Path(name).exists() and MAP_ID.fullmatch(name) and Path(name).suffix.lower() not in FILES:
        return {"map_id": name}
    return read_map_file(name)


def read_map_file(name: str) -> Json:
    """Return the map of a file: JSON as it is, what other tools write as read by `formats`.

    Raises
    ------
    WrongUseError
        When there is no such file.
    RefusedError
        When it is not taken.
    """
    path = Path(name)
    if not path.exists():
        raise WrongUseError(f"{name}: there is no such file; check the path and the working folder")
    if path.suffix.lower() != ".json":
        with needing_formats(f"reading {path.name}"):
            from formats import read_map
            from linefix.documents.results import map_json

            imported = read_map(path)
        _print_choice(imported.report)
        return map_json(imported.map)
    told = read_json(name)
    if isinstance(told, list):
        return {"segments": told}
    if not isinstance(told, dict):
        raise RefusedError(f'{name}: expected {{"segments": [[x1, y1, x2, y2], ...]}}')
    return told


def _print_choice(report: ImportReport) -> None:
    """Print on stderr which grid of a recording is the map, and what of the recording was left out."""
    if report.format not in RECORDINGS:
        return
    for kind in ("read", "assumed", "dropped"):
        for note in getattr(report, kind):
            if kind == "dropped" or note.code in CHOICE:
                print(f"{'map':10}{plain(noted(asdict(note)))}", file=sys.stderr)


def line_map_of(document: Json) -> LineMap:
    """Return a map as `formats` has it.

    Raises
    ------
    InputError
        When its segments are none.
    """
    from association import MapPoints
    from formats import LineMap
    from registration import Segments

    segments = Segments.from_array(document.get("segments", []), argument="segments")
    points = MapPoints.of(document.get("points", []), document.get("points_sigma"), path="")
    directed = document.get("oriented") is not False
    return LineMap(
        segments, document.get("sigma"), directed, points=points.positions, points_sigma=document.get("points_sigma")
    )


@contextmanager
def needing_formats(what: str) -> Iterator[None]:
    """Raise `RefusedError` if the extra ``[formats]`` is missing, or refuses a file.

    Raises
    ------
    RefusedError
    """
    from registration import InputError

    try:
        yield
    except ModuleNotFoundError:
        raise RefusedError(f'{what} needs the extra formats: in a checkout, pip install ".[formats]"') from None
    except InputError as error:
        told = f"--point: {error.message}" if error.argument == "inside" else str(error)
        raise RefusedError(told) from None
