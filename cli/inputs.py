"""Maps of the command line, from files, folders and the store, to parts of requests; and back to files."""

from __future__ import annotations

import re
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .errors import RefusedError, WrongUseError, needing
from .printing import Json, noted, print_lines, rows, write_json
from .scans import read_json

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


def write_document(document: Json, out: Path) -> None:
    """Write a map in the format of the file's name, or draw it as PNG.

    Raises
    ------
    RefusedError
        When it has another, or the extra ``[formats]`` is missing.
    """
    if out.suffix.lower() == ".json":
        write_json(document, out)
        return
    with needing(f"writing {out.name}"):
        from formats import write_map

        write_map(line_map_of(document), out)


def draw_picture(document: Json, out: Path, *poses: Any, **more: Any) -> None:
    """Draw a map, and on it what `formats.draw_map` takes; raises `RefusedError` as `write_document`."""
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
