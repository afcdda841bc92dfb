"""Reading a map: which reader, by the file's name."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from .drawings.drawing import Drawing
from .drawings.dxf import read_dxf
from .drawings.geojson import read_geojson
from .drawings.svg import read_svg
from .drawings.tables import read_csv, read_json
from .drawings.walls import to_map
from .errors import UnsupportedFormatError
from .files import name_of
from .grids.faces import find_faces
from .grids.map_server import read_grid
from .grids.tuning import WALL_SIGMA
from .line_map import ImportedMap, LineMap
from .options import DEFAULT_OPTIONS, ImportOptions
from .report import Notes

DRAWINGS: dict[str, Callable[[Path, ImportOptions, Notes], Drawing]] = {
    ".dxf": read_dxf,
    ".svg": read_svg,
    ".geojson": read_geojson,
    ".json": read_json,
    ".csv": read_csv,
}


def read_map(path: str | os.PathLike[str], options: ImportOptions = DEFAULT_OPTIONS) -> ImportedMap:
    """Read a map of another tool's, or one of our own.

    Parameters
    ----------
    path : str or path
        A ``.yaml`` of map_server, its picture beside it; a drawing in ``.dxf``, ``.svg`` or ``.geojson``; segments in
        ``.csv``; a map file of our own in ``.json``.
    options : ImportOptions
        What the file does not say.

    Returns
    -------
    ImportedMap

    Raises
    ------
    FormatError
        When the file cannot be read, in one line that names it.
    """
    file = Path(path)
    suffix = file.suffix.lower()
    if suffix in (".yaml", ".yml"):
        return _read_map_server(file)
    if suffix in DRAWINGS:
        notes = Notes()
        drawing = DRAWINGS[suffix](file, options, notes)
        line_map = to_map(drawing, options)
        return ImportedMap(line_map, notes.report(drawing.format, (drawing.name,)))
    known = ", ".join((".yaml", *DRAWINGS))
    raise UnsupportedFormatError(f"expected a file that ends in one of {known}", argument=name_of(file))


def _read_map_server(file: Path) -> ImportedMap:
    notes = Notes()
    grid, files = read_grid(file, notes)
    segments = find_faces(grid, notes, files[0])
    notes.add_read("segments", "faces of walls", len(segments))
    sigma = WALL_SIGMA * grid.resolution
    notes.add_assumed("sigma", f"walls are taken to be known to {sigma:.3f} m, half a cell")
    line_map = LineMap(segments, sigma, meta={"source": files[0], "resolution": f"{grid.resolution:g}"})
    return ImportedMap(line_map, notes.report("map_server", files))
