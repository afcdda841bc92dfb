"""Segments as such: a map file of our own in JSON."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import MalformedFileError, TooLargeError
from ..files import kind_of, load_json, read_bounded
from ..limits import MAX_MAP_BYTES, MAX_POINTS
from ..report import first_of, shown
from .drawing import Drawing

OWN_FIELDS = {"segments", "sigma", "oriented", "frame_id", "meta", "points", "points_sigma"}


def read_json(path: Path, drawing: Drawing) -> None:
    """Read a map file of our own: an object with ``segments``, or the array alone.

    Raises
    ------
    MalformedFileError
        When it is something else.
    """
    root = load_json(read_bounded(path, MAX_MAP_BYTES))
    told = {"segments": root} if isinstance(root, list) else root
    if not isinstance(told, dict) or not isinstance(told.get("segments"), list):
        found = kind_of(told)
        if isinstance(told, dict) and {"features", "coordinates", "geometry"} & told.keys():
            raise MalformedFileError("is GeoJSON; its name has to end in .geojson")
        if isinstance(told, dict):
            found = f"{kind_of(told['segments'])}" if "segments" in told else f"an object with {first_of(list(told))}"
        raise MalformedFileError(f'expected {{"segments": [[x1, y1, x2, y2], ...]}}, found {found}')
    drawing.metres = 1.0
    _take_properties(told, drawing)
    for key in sorted(set(map(str, told)) - OWN_FIELDS):
        drawing.notes.add_dropped(f"field_{shown(key)}", f"the field {shown(key)} is not known", 1)
    drawing.add_segments(_rows(told["segments"], "segment", "[x1, y1, x2, y2]", 4))


def _rows(rows: list[Any], kind: str, form: str, width: int) -> list[Any]:
    wrong = next((fault for k, row in enumerate(rows) if (fault := _fault_of_row(row, width, f"{kind} {k}"))), None)
    if wrong is not None:
        raise MalformedFileError(f"expected every {kind} to be {form}, found {wrong}")
    return rows


def _fault_of_row(row: Any, width: int, named: str) -> str | None:
    if not isinstance(row, list) or len(row) != width:
        return f"{kind_of(row)} as {named}"
    return next((f"{kind_of(c)} in {named}" for c in row if type(c) not in (int, float)), None)


def _within(value: Any, low: float, high: float) -> bool:
    return value is None or (type(value) in (int, float) and low <= value <= high)


LEAST_SIGMA = 5e-324  # m; above 0
CHECKS: tuple[tuple[str, Callable[[Any], bool], str], ...] = (
    ("oriented", lambda value: isinstance(value, bool), "true or false"),
    ("sigma", lambda value: _within(value, 0.0, 10.0), "a number from 0 to 10, or null"),
    ("frame_id", lambda value: isinstance(value, str), "text"),
    ("meta", lambda value: isinstance(value or {}, dict), "an object"),
    ("points", lambda value: isinstance(value, list), "[[x, y], ...]"),
    ("points_sigma", lambda value: _within(value, LEAST_SIGMA, 10.0), "a number above 0 and up to 10, or null"),
)
USUAL: dict[str, Any] = {"oriented": True, "sigma": None, "frame_id": "map", "points": [], "points_sigma": None}


def _take_properties(told: dict[str, Any], drawing: Drawing) -> None:
    values = USUAL | told
    for key, is_good, what in CHECKS:
        if not is_good(values.get(key)):
            found = kind_of(values[key])
            raise MalformedFileError(f"expected {key} to be {what}, found {found}")
    points, sigma = _rows(values["points"], "point", "[x, y]", 2), values["sigma"]
    points_sigma = values["points_sigma"]
    if len(points) > MAX_POINTS:
        raise TooLargeError(f"expected at most {MAX_POINTS} points, found {len(points)}")
    drawing.oriented, drawing.sigma = values["oriented"], None if sigma is None else float(sigma)
    drawing.frame_id = shown(values["frame_id"])
    drawing.meta = {shown(str(k)): shown(v) for k, v in (values.get("meta") or {}).items() if isinstance(v, str)}
    drawing.points = np.array(points, dtype=np.float64).reshape(-1, 2)
    drawing.points_sigma = None if points_sigma is None else float(points_sigma)
