"""From the bytes of an SVG to polylines."""

from __future__ import annotations

from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from ...errors import FormatError, MalformedFileError
from ...files import read_bounded
from ...limits import MAX_MAP_BYTES
from ..drawing import Drawing
from .shapes import SHAPES, Measure
from .visible import Visible
from .xml import kind_of, parse_xml


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
    try:
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
        if not drawing.takes(place.layers, {**element.attrib, **place.style}):
            continue
        kind = kind_of(element)
        for points, closed in SHAPES[kind](Measure(element, place.viewport)):
            places = place.applied(points)
            if not place.shows(places):
                drawing.notes.add_assumed("outside", "lines that extend beyond the picture are used whole", 1)
            lines = places * (1.0, -1.0)
            drawing.add(lines, closed=closed, width=place.width, layers=place.layers, groups=place.groups)
        drawing.notes.add_read(f"element_{kind}", f"{kind} elements", 1)
