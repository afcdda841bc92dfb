"""Segments as such: our own JSON, and CSV."""

from __future__ import annotations

import csv
import io
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import MalformedFileError, TooLargeError
from ..files import load_json, name_of, read_bounded, text_of
from ..limits import MAX_CSV_LINE, MAX_LINES, MAX_MAP_BYTES
from ..options import ImportOptions
from ..report import Notes, shown
from .drawing import Drawing

COLUMNS = ("x1", "y1", "x2", "y2")
OWN_FIELDS = {"segments", "sigma", "oriented", "frame_id", "meta"}


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
        raise MalformedFileError('expected {"segments": [[x1, y1, x2, y2], ...]}', argument=name)
    rows = told["segments"]
    if not all(isinstance(r, list) and len(r) == 4 and all(type(c) in (int, float) for c in r) for r in rows):
        raise MalformedFileError("expected every segment to be [x1, y1, x2, y2]", argument=name)
    drawing = Drawing(name, "json", options.layers, notes, 1.0)
    _take_properties(told, drawing)
    for key in sorted(set(map(str, told)) - OWN_FIELDS):
        notes.add_dropped(f"field_{shown(key)}", f"the field {shown(key)} is not known", 1)
    drawing.add_segments(rows)
    return drawing


def _take_properties(told: dict[str, Any], drawing: Drawing) -> None:
    oriented, sigma = told.get("oriented", True), told.get("sigma")
    frame_id, meta = told.get("frame_id", "map"), told.get("meta") or {}
    if not isinstance(oriented, bool):
        raise MalformedFileError("expected oriented to be true or false", argument=drawing.name)
    if sigma is not None and not (type(sigma) in (int, float) and 0.0 <= sigma <= 10.0):
        raise MalformedFileError("expected sigma to be a number from 0 to 10, or null", argument=drawing.name)
    if not isinstance(frame_id, str) or not isinstance(meta, dict):
        raise MalformedFileError("expected frame_id to be text and meta an object", argument=drawing.name)
    drawing.oriented, drawing.sigma = oriented, None if sigma is None else float(sigma)
    drawing.frame_id = shown(frame_id)
    drawing.meta = {shown(str(k)): shown(v) for k, v in meta.items() if isinstance(v, str)}


def read_csv(path: Path, options: ImportOptions, notes: Notes) -> Drawing:
    """Read rows of x1, y1, x2, y2, metres unless an option says otherwise.

    A first row may name the columns, then in any order and among others; lines that begin with ``#`` are comments, of
    which ours say ``# oriented=true``.

    Raises
    ------
    MalformedFileError
        When a row has no four numbers.
    """
    name = name_of(path)
    text = text_of(read_bounded(path, MAX_MAP_BYTES), name)
    if sum(text.count(end) for end in ("\n", "\r")) > 2 * MAX_LINES:
        raise TooLargeError(f"expected at most {MAX_LINES} lines", argument=name)
    lines = list(io.StringIO(text, newline=None))
    if len(lines) > MAX_LINES or any(len(line) > MAX_CSV_LINE for line in lines):
        raise TooLargeError(f"expected at most {MAX_LINES} lines of {MAX_CSV_LINE} characters", argument=name)
    comments = {line[1:].strip() for line in lines if line.startswith("#")}
    body = "".join(line for line in lines if line.strip() and not line.startswith("#"))
    first = body.partition("\n")[0]
    delimiter = max(",;\t ", key=first.count) if first else ","
    drawing = Drawing(name, "csv", options.layers, notes, 1.0, "oriented=true" in comments)
    try:
        rows = [[cell.strip() for cell in row] for row in csv.reader(io.StringIO(body), delimiter=delimiter)]
        wanted, start = _columns(rows[0] if rows else [])
        table = np.array([[row[k] for k in wanted] for row in rows[start:]], dtype=np.float64).reshape(-1, 4)
    except (csv.Error, ValueError, LookupError) as error:
        raise MalformedFileError("expected rows of x1, y1, x2, y2", argument=name) from error
    drawing.add_segments(table)
    return drawing


def _columns(first: list[str]) -> tuple[list[int], int]:
    """Return which columns hold the coordinates, and which row is the first of them."""
    names = [cell.casefold() for cell in first]
    if set(COLUMNS) <= set(names):
        return [names.index(column) for column in COLUMNS], 1
    return [0, 1, 2, 3], 0
