"""Maps of the command line, from files, folders and the store, to parts of requests; and back to files."""

from __future__ import annotations

import re
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .asking import whole_map
from .errors import RefusedError, WrongUseError
from .printing import Json, noted, plain, write_json
from .scans import needing_formats, read_json

if TYPE_CHECKING:
    from formats import ImportReport, LineMap

MAP_ID = re.compile(r"[A-Za-z0-9._-]{1,128}")
FILES = (".json", ".yaml", ".yml", ".dxf", ".svg", ".geojson", ".csv", ".bag", ".mcap", ".db3")  # never meant as ids
OF_SCANS = ("laser", "ranges", "views")  # fields that no map has
RECORDINGS = ("rosbag1", "rosbag2", "mcap")
CHOICE = ("grids", "topic", "costmap", "orientation")  # codes of notes of the grid that was read
IN_BAGS = "metadata.yaml"  # a file in the folder of each bag of ROS 2
MOST_NAME = 120  # letters of a name; the contract allows 128
NOT_IN_NAMES = re.compile(r"[^A-Za-z0-9._-]+")


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
    path = existing(Path(name))
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
    if not told.keys().isdisjoint(OF_SCANS) and "segments" not in told:
        raise RefusedError(f"{name}: is a scan; the map comes first")
    return told


def existing(path: Path) -> Path:
    """Return a path; raises `WrongUseError` where there is no such file."""
    if not path.exists():
        raise WrongUseError(f"{path}: there is no such file; check the path and the working folder")
    return path


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


def write_document(document: Json, out: Path) -> None:
    """Write a map in the format of the file's name.

    Raises
    ------
    RefusedError
        When it has another, or the extra ``[formats]`` is missing.
    """
    if out.suffix.lower() == ".json":
        write_json(document, out)
        return
    with needing_formats(f"writing {out.name}"):
        from formats import write_map

        write_map(line_map_of(document), out)


def draw_picture(document: Json, out: Path, *poses: Any, **more: Any) -> None:
    """Draw a map, and on it what `formats.draw_map` takes; raises `RefusedError` as `write_document`."""
    with needing_formats("drawing a picture"):
        from formats import draw_map

        draw_map(line_map_of(document), out, *poses, **more)


def read_target(names: Sequence[str]) -> Json:
    """Return the part of a request that names its map, or its maps: ``{"map": ...}`` or ``{"maps": [...]}``.

    Parameters
    ----------
    names : sequence of str
        Each a map file, a folder of map files, or the id of a stored map. The map of a file is named after it.

    Raises
    ------
    WrongUseError
        When one of them is none of these, or a folder holds no map.
    RefusedError
        When a file is not taken.
    """
    named = _named(names)
    if len(named) == 1:
        return {"map": named[0][1]}
    return {"maps": [{**one, "map_id": name} if "segments" in one else one for name, one in named]}


def read_maps(names: Sequence[str]) -> dict[str, Json]:
    """Return the maps of this machine themselves, by name.

    Parameters
    ----------
    names : sequence of str
        As of `read_target`.

    Raises
    ------
    WrongUseError
        Likewise, and when a stored map is named twice.
    RefusedError
        When a file is not taken, or a stored map is gone.
    """
    maps: dict[str, Json] = {}
    for name, document in _named(names):
        if name in maps:
            raise WrongUseError(f"found the map {name} twice, expected each map once; omit one of them")
        maps[name] = whole_map(document, None)
    return maps


def _named(names: Sequence[str]) -> list[tuple[str, Json]]:
    """Return the map of each file by the name of the file, and ids of stored maps."""
    named: list[tuple[str, Json]] = []
    for name in (name for one in names for name in _files_of(one)):
        document, taken = read_map_or_id(name), {one for one, _ in named}
        stored = document.get("map_id") if "segments" not in document else None
        named.append((stored or _name_of(name, taken), document))
    return named


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


def documents_of(target: Json, server: str | None) -> dict[str, Json]:
    """Return the maps of a request by name, those that are stored, too; the name of a single one may be empty."""
    maps = {one.get("map_id", ""): whole_map(one, server) for one in target.get("maps") or [target["map"]]}
    return {name: {key: value for key, value in one.items() if key != "map_id"} for name, one in maps.items()}


def document_at(name: str, server: str | None) -> Json:
    """Return a map itself: that of a file, or a stored one."""
    return whole_map(read_map_or_id(name), server)
