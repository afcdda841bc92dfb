"""From the bytes of an SVG to polylines."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from ...errors import FormatError, MalformedFileError
from ...files import read_bounded
from ...limits import MAX_MAP_BYTES
from ..drawing import Drawing
from .shapes import SHAPES, Measure, Points
from .visible import Visible
from .xml import kind_of, parse_xml

# Attributes of the root that identify our own drawings.
METRES, ORIENTED = "data-metres-per-unit", "data-free-space-on-left"


def read_svg(path: Path, drawing: Drawing) -> None:
    """Read the visible lines, shapes and paths of an SVG; y is turned to point up.

    Parameters
    ----------
    path : Path
    drawing : Drawing
        Takes them. Layers are the ids, classes and Inkscape labels of an element and of those that it is in.

    Raises
    ------
    FormatError
        When it is no SVG, or too deep or too large.
    """
    root = parse_xml(read_bounded(path, MAX_MAP_BYTES))
    if kind_of(root) != "svg":
        raise MalformedFileError("expected an svg element")
    drawing.oriented = root.get(ORIENTED) == "true"
    try:
        drawing.metres = float(root.attrib[METRES]) if METRES in root.attrib else None
        with np.errstate(all="ignore"):  # what is no number is refused where it is added
            _read_shapes(root, drawing)
    except FormatError:
        raise
    except (ArithmeticError, ValueError, TypeError, AttributeError, LookupError, RecursionError) as error:
        raise MalformedFileError(
            "has an element that cannot be read; expected SVG 1.1. Save it as plain SVG"
        ) from error


def _read_shapes(root: Element, drawing: Drawing) -> None:
    for element, place in Visible(root, drawing).shapes():
        if not drawing.takes(place.layers, {**element.attrib, "stroke-dasharray": place.dashes}):
            continue
        kind = kind_of(element)
        for points, closed in SHAPES[kind](Measure(element, place.viewport)):
            lines = _placed(points, place.matrix)
            drawing.add(lines, closed=closed, width=place.width, layers=place.layers, groups=place.groups)
        drawing.notes.add_read(f"element_{kind}", f"{kind} elements", 1)


def _placed(points: Points, matrix: Any) -> NDArray[np.float64]:
    """Return points in the root's units, y pointing up."""
    p = np.asarray(points, dtype=np.float64).reshape(-1, 2)
    x = matrix.a * p[:, 0] + matrix.c * p[:, 1] + matrix.e
    y = matrix.b * p[:, 0] + matrix.d * p[:, 1] + matrix.f
    return np.stack([x, -y], axis=1)
