"""Segments as such: a map file of our own in JSON."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..errors import MalformedFileError, TooLargeError
from ..files import kind_of, load_json, name_of, read_bounded
from ..limits import MAX_MAP_BYTES, MAX_POINTS
from ..options import ImportOptions
from ..report import Notes, shown
from .drawing import Drawing

OWN_FIELDS = {"segments", "sigma", "oriented", "frame_id", "meta", "points", "points_sigma"}


def read_json(path: Path, options: ImportOptions, notes: Notes) -> Drawing:
    """Read a map file of our own: an object with ``segments``, or the array alone.

    Raises
    ------
    MalformedFileError
        When it is something else.
    """
    name = name_of(path)
    root = load_json(read_bounded(path, MAX_MAP_BYTES), name)
    told = {"segments": root} if isinstance(root, list) else root
    if not isinstance(told, dict) or not isinstance(told.get("segments"), list):
        found = f"segments that are {kind_of(told.get('segments'))}" if isinstance(told, dict) else kind_of(told)
        if isinstance(told, dict) and "features" in told:
            found += ", as in GeoJSON: rename the file to .geojson" if "type" in told else "; convert it to GeoJSON"
        raise MalformedFileError(f'expected {{"segments": [[x1, y1, x2, y2], ...]}}, found {found}', argument=name)
    rows = told["segments"]
    wrong = next((fault for k, row in enumerate(rows) if (fault := _fault_of_row(row, 4, f"segment {k}"))), None)
    if wrong is not None:
        raise MalformedFileError(f"expected every segment to be [x1, y1, x2, y2], found {wrong}", argument=name)
    drawing = Drawing(name, "json", notes, options, 1.0)
    _take_properties(told, drawing)
    _take_points(told, drawing)
    for key in sorted(set(map(str, told)) - OWN_FIELDS):
        notes.add_dropped(f"field_{shown(key)}", f"the field {shown(key)} is not known", 1)
    drawing.add_segments(rows)
    return drawing


def _fault_of_row(row: Any, width: int, named: str) -> str | None:
    if not isinstance(row, list) or len(row) != width:
        return f"{kind_of(row)} as {named}"
    return next((f"{kind_of(c)} in {named}" for c in row if type(c) not in (int, float)), None)


def _take_properties(told: dict[str, Any], drawing: Drawing) -> None:
    oriented, sigma = told.get("oriented", True), told.get("sigma")
    frame_id, meta = told.get("frame_id", "map"), told.get("meta") or {}
    if not isinstance(oriented, bool):
        raise MalformedFileError(
            f"expected oriented to be true or false, found {kind_of(oriented)}", argument=drawing.name
        )
    if sigma is not None and not (type(sigma) in (int, float) and 0.0 <= sigma <= 10.0):
        raise MalformedFileError(
            f"expected sigma to be a number from 0 to 10, or null, found {kind_of(sigma)}", argument=drawing.name
        )
    if not isinstance(frame_id, str) or not isinstance(meta, dict):
        raise MalformedFileError(
            f"expected frame_id to be text and meta an object, found {kind_of(frame_id)} and {kind_of(meta)}",
            argument=drawing.name,
        )
    drawing.oriented, drawing.sigma = oriented, None if sigma is None else float(sigma)
    drawing.frame_id = shown(frame_id)
    drawing.meta = {shown(str(k)): shown(v) for k, v in meta.items() if isinstance(v, str)}


def _take_points(told: dict[str, Any], drawing: Drawing) -> None:
    points, sigma = told.get("points", []), told.get("points_sigma")
    if not isinstance(points, list):
        raise MalformedFileError(f"expected points to be [[x, y], ...], found {kind_of(points)}", argument=drawing.name)
    wrong = next((fault for k, row in enumerate(points) if (fault := _fault_of_row(row, 2, f"point {k}"))), None)
    if wrong is not None:
        raise MalformedFileError(f"expected every point to be [x, y], found {wrong}", argument=drawing.name)
    if len(points) > MAX_POINTS:
        raise TooLargeError(f"expected at most {MAX_POINTS} points, found {len(points)}", argument=drawing.name)
    if sigma is not None and not (type(sigma) in (int, float) and 0.0 < sigma <= 10.0):
        raise MalformedFileError(
            f"expected points_sigma to be a number above 0 and up to 10, or null, found {kind_of(sigma)}",
            argument=drawing.name,
        )
    drawing.points = np.array(points, dtype=np.float64).reshape(-1, 2)
    drawing.points_sigma = None if sigma is None else float(sigma)
