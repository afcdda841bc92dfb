"""Reading a map or a log: which reader, by the file's name."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from .drawings.csv_table import read_csv
from .drawings.drawing import Drawing
from .drawings.geojson import read_geojson
from .drawings.own_json import read_json
from .drawings.svg.reading import read_svg
from .drawings.walls.to_map import to_map
from .errors import InvalidOptionError, UnsupportedFormatError, naming
from .files import ending_of, name_of, require_content
from .grids.cells import Grid, picture_of
from .grids.faces import find_faces
from .grids.map_server import read_grid
from .grids.tuning import SURFACE_SIGMA
from .line_map import ImportedMap, LineMap
from .logs.carmen import read_carmen
from .logs.folders import SUFFIXES as BAG_SUFFIXES
from .logs.folders import is_bag
from .logs.grids import grid_of, read_bag_grid
from .logs.ros import read_bag
from .logs.scan import Log, LogOptions
from .options import DEFAULT_OPTIONS, ImportOptions
from .report import Notes


def _read_dxf(path: Path, drawing: Drawing) -> None:
    from .drawings.dxf import read_dxf  # takes as long to load as all other readers, and only this needs it

    read_dxf(path, drawing)


DRAWINGS: dict[str, Callable[[Path, Drawing], None]] = {
    ".dxf": _read_dxf,
    ".svg": read_svg,
    ".geojson": read_geojson,
    ".json": read_json,
    ".csv": read_csv,
}
MAP_SUFFIXES = (".yaml", ".yml", *DRAWINGS, *BAG_SUFFIXES)
"""Of files that `read_map` reads; a ``.yaml`` has its picture in the same folder."""
TEXTS = (".log", ".clf", ".carmen")
LOG_SUFFIXES = (*BAG_SUFFIXES, *TEXTS)
"""Of files that `read_log` reads."""
PICTURES = (".png", ".pgm", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".gif", ".webp")
INSTEAD = {
    **dict.fromkeys((".osm", ".kml"), "; save it as GeoJSON, in UTM, such as with QGIS"),
    ".pbstream": "; write its grid with cartographer_pbstream_to_ros_map",
    **dict.fromkeys((".posegraph", ".data"), "; save the map of slam_toolbox with map_saver_cli"),
}
DEFAULT_LOG_OPTIONS = LogOptions()


def read_map(
    path: str | os.PathLike[str], options: ImportOptions = DEFAULT_OPTIONS, pictures: Mapping[str, Path] | None = None
) -> ImportedMap:
    """Read a map of another tool's, or one of our own.

    Parameters
    ----------
    path : str or path
        A ``.yaml`` of map_server with its picture in the same folder; a bag of ROS with an OccupancyGrid; a drawing in
        ``.dxf``, ``.svg`` or ``.geojson``; segments in ``.csv``; a map file of our own in ``.json``.
    options : ImportOptions
        Values that the file lacks.
    pictures : mapping of str to Path, optional
        Paths of the pictures of a ``.yaml``, by the names that it may contain; no other picture is read then. Without
        it the picture lies in the folder of the ``.yaml``.

    Returns
    -------
    ImportedMap

    Raises
    ------
    FormatError
        When the file cannot be read, in one line that names it.
    """
    file, notes = Path(path), Notes()
    suffix = file.suffix.lower()
    with naming(name_of(file)):
        _require_use(options, suffix)
        require_content(file, but=suffix)
        if suffix in (".yaml", ".yml"):
            grid, files = read_grid(file, options, notes, pictures)
            return _imported(grid, "map", options.surface, notes, "map_server", files)
        if is_bag(file):
            found = read_bag_grid(file, options.topic, notes)
            return _imported(found.grid, found.frame, options.surface, notes, found.format, (name_of(file),))
        if suffix in DRAWINGS:
            drawing = Drawing(name_of(file), suffix[1:], notes, options)
            DRAWINGS[suffix](file, drawing)
            return ImportedMap(to_map(drawing), notes.report(drawing.format, (drawing.name,)))
        raise _unsupported(file, "a file", MAP_SUFFIXES)


def read_log(path: str | os.PathLike[str], options: LogOptions = DEFAULT_LOG_OPTIONS) -> Log:
    """Open a log; its scans are read while iterating.

    Parameters
    ----------
    path : str or path
        A ``.bag`` of ROS 1; the folder of a bag of ROS 2, or its ``.mcap`` or ``.db3``; a ``.log``, ``.clf`` or
        ``.carmen`` of CARMEN.
    options : LogOptions

    Returns
    -------
    Log

    Raises
    ------
    FormatError
        When the file cannot be read, in one line that names it; while iterating, too.
    """
    file = Path(path)
    with naming(name_of(file)):
        require_content(file, but=file.suffix.lower())
        if is_bag(file):
            return read_bag(file, options)
        if file.suffix.lower() in TEXTS:
            return read_carmen(file, options)
        raise _unsupported(file, "the folder of a bag, or a file", LOG_SUFFIXES)


def _unsupported(file: Path, what: str, suffixes: tuple[str, ...]) -> UnsupportedFormatError:
    if file.suffix.lower() in PICTURES:
        return UnsupportedFormatError("is a picture, which has no scale of its own; give the YAML file of the map")
    known, instead = ", ".join(suffixes), INSTEAD.get(file.suffix.lower(), "")
    return UnsupportedFormatError(f"expected {what} that ends in one of {known}, found {ending_of(file)}{instead}")


def _require_use(options: ImportOptions, suffix: str) -> None:
    """Refuse an option that would say nothing of a file: a floor of a grid, the surface of a drawing."""
    drawing = suffix in DRAWINGS
    idle = {"surface": drawing, "where": not drawing or suffix == ".json", "level": not drawing or suffix == ".json"}
    for name, is_idle in idle.items():
        if is_idle and getattr(options, name) not in (None, ()):
            what = "drawing" if name == "surface" else "grid or a map of segments"
            raise InvalidOptionError(
                f"found a value, but the file is a {what}, which has no {name}; omit it", argument=name
            )


def map_of_grid(message: Any, name: str = "OccupancyGrid", surface: float | None = None) -> ImportedMap:
    """Return the faces of the walls in a ``nav_msgs/OccupancyGrid`` as a map.

    Parameters
    ----------
    message : object
        With the fields of the message, whatever library it comes from.
    name : str
        Its name in errors and in the report.
    surface : float, optional
        As of `ImportOptions`.

    Raises
    ------
    FormatError
        When its fields do not fit each other, or it is too large.
    """
    notes = Notes()
    with naming(name):
        grid, frame = grid_of(message, notes)
        return _imported(grid, frame, surface, notes, "occupancy_grid", (name,))


def _imported(
    grid: Grid, frame: str, surface: float | None, notes: Notes, format: str, files: tuple[str, ...]
) -> ImportedMap:
    """Return the faces of a grid as a map, with the report of its files."""
    faces = find_faces(grid, notes, surface)
    notes.add_read("segments", "faces of walls", len(faces.segments))
    sigma = SURFACE_SIGMA * grid.resolution
    notes.add_assumed("sigma", f"sigma of the walls is assumed to be {sigma:g} m, half a cell")
    meta = {"source": files[0], "resolution": f"{grid.resolution:g}", "surface": f"{faces.depth:.2f}"}
    line_map = LineMap(faces.segments, sigma, True, frame, meta, faces.points, sigma)
    return ImportedMap(line_map, notes.report(format, files), picture_of(grid))
