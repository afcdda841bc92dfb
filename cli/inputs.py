"""Maps and scans of the command line, from files, folders and the store, to parts of requests; and back to files."""

from __future__ import annotations

import json
import math
import re
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .errors import RefusedError, WrongUseError, needing
from .printing import Json, noted, print_lines, rows

if TYPE_CHECKING:
    from formats import LineMap

MAP_ID = re.compile(r"[A-Za-z0-9._-]{1,128}")
FILES = (".json", ".yaml", ".yml", ".dxf", ".svg", ".geojson", ".csv", ".bag", ".mcap", ".db3")  # never meant as ids
OF_SCANS = ("laser", "ranges", "views")  # fields that no map has
RECORDINGS = ("rosbag1", "rosbag2", "mcap")
CHOICE = ("grids", "topic", "costmap", "orientation")  # codes of notes of the grid that was read
IN_BAGS = "metadata.yaml"  # a file in the folder of each bag of ROS 2
MOST_NAME = 120  # letters of a name; the contract allows 128
NOT_IN_NAMES = re.compile(r"[^A-Za-z0-9._-]+")
BYTE_ORDER_MARK = b"\xef\xbb\xbf"  # that some editors put in front of UTF-8
LOGS = (".bag", ".mcap", ".db3", ".clf", ".log")
FORMS = ("laser", "points", "segments", "views")
CUT = "..."  # the last element of an array that `ros2 topic echo` has cut
LOST = re.compile(r"A message was lost!!!.*?---\s*\n", re.DOTALL)  # of `ros2 topic echo`
WARNINGS = re.compile(r"\A(\s*\[?(WARN|WARNING|INFO)\b.*\n)+")  # of the tools of ROS, before the message
NEXT = "\n---"  # between the messages of `ros2 topic echo`


@dataclass(frozen=True, slots=True)
class NamedMap:
    """A map of a request.

    Attributes
    ----------
    name : str
        The id of a stored map, else that of its file without suffix; a number follows where several have it.
    source : str
        As the user names it.
    document : dict
        The map itself, or the id of a stored one.
    """

    name: str
    source: str
    document: Json


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
    """Return the map of a file: JSON as it is, what other tools write as read by `formats`; raises as the above."""
    path = existing(Path(name))
    if path.suffix.lower() != ".json":
        return _read_other(path)
    told = read_json(name)
    if isinstance(told, list):
        return {"segments": told}
    if not isinstance(told, dict):
        raise RefusedError(f'{name}: expected {{"segments": [[x1, y1, x2, y2], ...]}}')
    if not told.keys().isdisjoint(OF_SCANS) and "segments" not in told:
        raise RefusedError(f"{name}: is a scan; the map comes first")
    return told


def _read_other(path: Path) -> Json:
    """Return the map of another tool; print on stderr which grid of a recording it is, and what was left out."""
    with needing(f"reading {path.name}"):
        from formats import read_map
        from linefix.documents.results import map_json

        imported = read_map(path)
    report = asdict(imported.report)
    if report["format"] in RECORDINGS:
        notes = [note for kind in ("read", "assumed") for note in report[kind] if note["code"] in CHOICE]
        print_lines(rows((("map", noted(note)) for note in (*notes, *report["dropped"])), 10), sys.stderr)
    return map_json(imported.map)


def existing(path: Path) -> Path:
    """Return a path; raises `WrongUseError` where there is no such file."""
    if not path.exists():
        raise WrongUseError(f"{path}: there is no such file; check the path and the working folder")
    return path


def line_map_of(document: Json) -> LineMap:
    """Return a map as `formats` has it; raises `InputError` where it is none."""
    from formats import LineMap
    from linefix.locating import map_part

    part, points_sigma = map_part(document, "map"), document.get("points_sigma")
    return LineMap(part.segments, part.sigma, part.oriented, points=part.points.positions, points_sigma=points_sigma)


def draw_picture(document: Json, out: Path, *poses: Any, **more: Any) -> None:
    """Draw a map, and on it what `formats.draw_map` takes.

    Raises
    ------
    RefusedError
        When the name does not end in ``.png``, or the extra ``[formats]`` is missing.
    """
    with needing("drawing a picture"):
        from formats import draw_map

        draw_map(line_map_of(document), out, *poses, **more)


def read_maps(names: Sequence[str]) -> list[NamedMap]:
    """Return maps by name.

    Parameters
    ----------
    names : sequence of str
        Each a map file, a folder of map files, or the id of a stored map.

    Raises
    ------
    WrongUseError
        When one of them is none of these, or a folder holds no map.
    RefusedError
        When a file is not taken.
    """
    found: list[NamedMap] = []
    for source in (file for name in names for file in _files_of(name)):
        document, taken = read_map_or_id(source), {one.name for one in found}
        stored = document.get("map_id") if "segments" not in document else None
        found.append(NamedMap(stored or _name_of(source, taken), source, document))
    return found


def target_of(maps: Sequence[NamedMap]) -> Json:
    """Return the part of a request that has its map, or its maps: ``{"map": ...}`` or ``{"maps": [...]}``."""
    if len(maps) == 1:
        return {"map": maps[0].document}
    return {"maps": [{**one.document, "map_id": one.name} for one in maps]}


def places_of(maps: Sequence[NamedMap]) -> dict[str, str]:
    """Return the user's name for each map, by its place in a request."""
    return {"/map" if len(maps) == 1 else f"/maps/{number}": one.source for number, one in enumerate(maps)}


def _files_of(name: str) -> list[str]:
    """Return the map files of a folder, by name; of anything else itself, also of the folder of a bag."""
    folder = Path(name)
    if not folder.is_dir() or (folder / IN_BAGS).is_file():
        return [name]
    found = sorted(str(file) for file in folder.iterdir() if file.suffix.lower() in FILES and file.is_file())
    if not found:
        raise WrongUseError(f"{name}: found no map file in this folder, expected one with a suffix such as .json")
    return found


def _name_of(name: str, taken: set[str]) -> str:
    """Return the name of a file's map: that of the file without its suffix, with a number where it is taken."""
    stem = NOT_IN_NAMES.sub("-", Path(name).stem)[:MOST_NAME] or "map"
    return next(one for one in (stem, *(f"{stem}-{number}" for number in range(2, 1000))) if one not in taken)


def bytes_of(name: str) -> bytes:
    """Return the content of a text file without a byte-order mark; ``-`` reads stdin; raises `OSError`."""
    data = sys.stdin.buffer.read() if name == "-" else Path(name).read_bytes()
    return data.removeprefix(BYTE_ORDER_MARK)


def read_json(name: str, data: bytes | None = None) -> Any:
    """Return the content of a file of JSON, also with NaN and Infinity; `data` is its content where it is read already.

    Raises
    ------
    OSError
        As `bytes_of`.
    RefusedError
        When it is not JSON.
    """
    try:
        return json.loads(bytes_of(name) if data is None else data)
    except (ValueError, RecursionError) as error:
        raise RefusedError(f"{name}: not JSON: {error}") from None


def read_scan(name: str) -> Json:
    """Read a scan file; ``-`` reads it from stdin.

    The bare fields of a LaserScan message become ``{"laser": ...}``. JSON may contain NaN and Infinity. Of several
    messages in YAML the first one is read.

    Raises
    ------
    OSError
        As `bytes_of`.
    WrongUseError
        When it is a log.
    RefusedError
        When the content is neither JSON nor YAML, or no scan.
    """
    if Path(name).suffix.lower() in LOGS or Path(name).is_dir():
        raise WrongUseError(
            f"{name}: is a log or a folder, expected one scan; linefix replay LOG --map MAP localizes scans of a log"
        )
    data = bytes_of(name)
    message = read_json(name, data) if data.lstrip()[:1] in (b"{", b"[") else _yaml(data, name)
    if not isinstance(message, dict):
        raise RefusedError(f"{name}: found no scan; expected an object with one of {', '.join(FORMS)}, or a LaserScan")
    # The envelope of rosbridge, of Foxglove, or of `mcap cat --json`.
    inner = next((message[key] for key in ("msg", "message", "data") if key in message), None)
    if isinstance(inner, str) and inner.lstrip().startswith("{"):
        inner = read_json(name, inner.encode())
    scan: Json = inner if isinstance(inner, dict) else message
    if "ranges" in scan and "start_angle" in scan:
        raise RefusedError(
            f"{name}: is a LaserScan of Foxglove, which has no range_max; expected angle_min, angle_increment, ranges "
            "and range_max, as of sensor_msgs/LaserScan"
        )
    if "ranges" in scan and not any(form in scan for form in FORMS):
        scan = {"laser": scan}
    views = scan.get("views")
    for part in (scan, *(views if isinstance(views, list) else [])):
        if isinstance(part, dict) and isinstance(part.get("laser"), dict):
            part["laser"] = _finite(part["laser"], name)
    return scan


def _yaml(data: bytes, name: str) -> Any:
    """Return the first message of YAML."""
    with needing(f"reading {name} as YAML"):
        from formats.errors import naming
        from formats.files import load_yaml

        text = WARNINGS.sub("", LOST.sub("", data.decode("utf-8", errors="replace")), count=1).removeprefix("---\n")
        with naming(name):
            return load_yaml(text.partition(NEXT)[0])


def _finite(laser: Json, name: str) -> Json:
    """Return a LaserScan as a request has it: null for an unknown range, twice the maximum for no return.

    An infinite `range_max` is unknown. Infinite ranges are then unknown, too. `intensities` are left out.

    Raises
    ------
    RefusedError
        When an array was cut.
    """
    laser = {field: value for field, value in laser.items() if field != "intensities"}
    ranges = laser.get("ranges")
    ranges = [CUT] if isinstance(ranges, str) else ranges  # such as '<array type: float32>'
    if not isinstance(ranges, list):
        return laser
    if ranges[-1:] == [CUT]:
        raise RefusedError(
            f"{name}: the ranges end after {len(ranges) - 1} values, expected all of them: record the scan with "
            "ros2 topic echo --full-length, and without --noarr"
        )
    laser |= {field: _number(value) for field, value in laser.items() if field.startswith(("angle_", "range_"))}
    most = laser.get("range_max")
    if isinstance(most, float) and not math.isfinite(most):
        most = laser["range_max"] = None
    known = {math.inf: None if most is None else 2.0 * most}
    read = map(_number, ranges)
    laser["ranges"] = [known.get(r) if isinstance(r, float) and not math.isfinite(r) else r for r in read]
    return laser


def _number(value: Any) -> Any:
    """Return the number that a text stands for, as of `rostopic echo` or in quotes; anything else as it is."""
    try:
        return float(value) if isinstance(value, str) else value
    except ValueError:
        return value
