"""Drawings in SVG: the XML by the standard library within bounds, paths and transforms by svgelements."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, ParseError, TreeBuilder
from xml.parsers import expat

import numpy as np
import svgelements
from numpy.typing import NDArray

from ..errors import FormatError, MalformedFileError, TooLargeError
from ..files import name_of, read_bounded
from ..limits import MAX_DEPTH, MAX_ENTITIES, MAX_MAP_BYTES, MAX_PATH_BYTES, MAX_UNITS
from ..options import ImportOptions
from ..report import Notes
from .drawing import Drawing

NAMESPACE = "http://www.w3.org/2000/svg"
INKSCAPE_LABEL = "http://www.inkscape.org/namespaces/inkscape}label"
CURVE_CHORDS = 16  # that a curve of a path is drawn with
CURVE_PLACES = np.arange(1, CURVE_CHORDS + 1) / CURVE_CHORDS
NOT_DRAWN = {"defs", "symbol", "clipPath", "mask", "pattern", "marker", "metadata", "title", "desc", "style", "script"}
GROUPS = {"g", "a", "switch"}

# Attributes of the root in which our own drawings say what they are.
METRES, ORIENTED = "data-metres-per-unit", "data-free-space-on-left"

_STROKE_WIDTH = re.compile(r"(?:^|;)\s*stroke-width\s*:([^;]*)")

Floats = NDArray[np.float64]
Matrix = Any
Points = list[tuple[float, float]]


def read_svg(path: Path, options: ImportOptions, notes: Notes) -> Drawing:
    """Read the lines, shapes and paths of an SVG; y is turned to point up.

    Parameters
    ----------
    path : Path
    options : ImportOptions
        Layers are the ids, classes and Inkscape labels of an element and of those that it is in.
    notes : Notes

    Raises
    ------
    FormatError
        When it is no SVG, or too deep or too large.
    """
    name = name_of(path)
    root = parse_xml(read_bounded(path, MAX_MAP_BYTES), name)
    if _kind(root) != "svg":
        raise MalformedFileError("expected an svg element", argument=name)
    drawing = Drawing(name, "svg", options.layers, notes)
    drawing.oriented = root.get(ORIENTED) == "true"
    try:
        drawing.metres = float(root.attrib[METRES]) if METRES in root.attrib else None
        with np.errstate(all="ignore"):  # what is no number is refused where it is added
            _read_elements(root, drawing)
    except FormatError:
        raise
    except (ArithmeticError, ValueError, TypeError, AttributeError, LookupError) as error:
        raise MalformedFileError("has a broken element", argument=name) from error
    return drawing


def _read_elements(root: Element, drawing: Drawing) -> None:
    for element, place in _all_drawn(root, drawing):
        if not drawing.wants(*place.layers):
            drawing.notes.add_dropped("other_layer", "elements on layers that were not asked for", 1)
            continue
        for points, closed in SHAPES[_kind(element)](element):
            drawing.add(_placed(points, place.matrix), closed=closed, width=place.width)
        drawing.notes.add_read(f"element_{_kind(element)}", f"{_kind(element)} elements", 1)


def parse_xml(content: bytes, name: str) -> Element:
    """Parse XML without entities of its own, within bounds of depth and number.

    Raises
    ------
    MalformedFileError
        When it is no XML, or declares entities.
    TooLargeError
        When elements lie too deep or are too many.
    """
    builder, parser = TreeBuilder(), expat.ParserCreate(namespace_separator="}")
    depth = count = path_bytes = 0

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth, count, path_bytes
        depth, count = depth + 1, count + 1
        if (path_bytes := path_bytes + len(attributes.get("d", ""))) > MAX_PATH_BYTES:
            raise TooLargeError(f"expected at most {MAX_PATH_BYTES} characters of paths", argument=name)
        if depth > MAX_DEPTH or count > MAX_ENTITIES:
            raise TooLargeError(f"expected at most {MAX_ENTITIES} elements, {MAX_DEPTH} in one another", argument=name)
        builder.start(tag, attributes)

    def end(tag: str) -> None:
        nonlocal depth
        depth -= 1
        builder.end(tag)

    def refuse(*_declared: Any) -> None:
        raise MalformedFileError("declares XML entities, which are not read", argument=name)

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.EntityDeclHandler = refuse
    try:
        parser.Parse(content, True)
        return builder.close()
    except (expat.ExpatError, ParseError, AssertionError) as error:
        raise MalformedFileError("is no XML", argument=name) from error


def _placed(points: Points, matrix: Matrix) -> Floats:
    """Return points in the root's units, y pointing up."""
    p = np.asarray(points, dtype=np.float64).reshape(-1, 2)
    x = matrix.a * p[:, 0] + matrix.c * p[:, 1] + matrix.e
    y = matrix.b * p[:, 0] + matrix.d * p[:, 1] + matrix.f
    return np.stack([x, -y], axis=1)


def _kind(element: Element) -> str:
    tag = str(element.tag)
    return tag.removeprefix(NAMESPACE + "}")


@dataclass(frozen=True, slots=True)
class _Place:
    """What an element has of those that it is in: their names, the matrix to the root's units, and the pen."""

    layers: tuple[str, ...] = ()
    matrix: Matrix = field(default_factory=svgelements.Matrix)
    stroke: float = 0.0  # the element's own units

    @property
    def width(self) -> float:
        """Of a line, the root's units."""
        m = self.matrix
        return self.stroke * math.sqrt(abs(m.a * m.d - m.b * m.c))


def _all_drawn(root: Element, drawing: Drawing) -> Iterator[tuple[Element, _Place]]:
    for child in root:
        yield from _drawn(child, _Place(stroke=_stroke(root, 0.0)), drawing)


def _stroke(element: Element, inherited: float) -> float:
    """Return how wide lines are drawn; what is no plain number, such as a share of the picture, is taken for none."""
    styled = _STROKE_WIDTH.search(element.get("style", ""))
    told = styled[1] if styled else element.get("stroke-width")
    if told is None:
        return inherited
    with suppress(ValueError):
        width = float(told.strip().removesuffix("px"))
        return width if 0.0 <= width <= MAX_UNITS else 0.0
    return 0.0


def _drawn(element: Element, outer: _Place, drawing: Drawing) -> Iterator[tuple[Element, _Place]]:
    """Yield what is drawn, with where it stands."""
    kind = _kind(element)
    if kind in NOT_DRAWN:
        return
    if "display:none" in element.get("style", "").replace(" ", "") or element.get("display") == "none":
        drawing.notes.add_dropped("hidden", "elements that are not displayed", 1)
        return
    names = [element.get(key, "") for key in ("id", "class", INKSCAPE_LABEL)]
    matrix = svgelements.Matrix(element.get("transform", "")) * outer.matrix
    place = _Place((*outer.layers, *filter(None, names)), matrix, _stroke(element, outer.stroke))
    if kind in GROUPS:
        for child in element:
            yield from _drawn(child, place, drawing)
    elif kind in SHAPES:
        yield element, place
    else:
        drawing.drop(kind)


def _number(element: Element, key: str) -> float:
    return float(element.get(key, "0").removesuffix("px"))


def _line(element: Element) -> Iterator[tuple[Points, bool]]:
    x1, y1, x2, y2 = (_number(element, key) for key in ("x1", "y1", "x2", "y2"))
    yield [(x1, y1), (x2, y2)], False


def _rect(element: Element) -> Iterator[tuple[Points, bool]]:
    x, y, w, h = (_number(element, key) for key in ("x", "y", "width", "height"))
    yield [(x, y), (x + w, y), (x + w, y + h), (x, y + h)], True


def _polyline(element: Element) -> Iterator[tuple[Points, bool]]:
    numbers = [float(n) for n in element.get("points", "").replace(",", " ").split()]
    pairs = list(zip(numbers[::2], numbers[1::2], strict=False))
    yield pairs, _kind(element) == "polygon"


def _path(element: Element) -> Iterator[tuple[Points, bool]]:
    points: Points = []
    for piece in svgelements.Path(element.get("d", "")):
        if isinstance(piece, svgelements.Move):
            yield points, False
            points = [(piece.end.x, piece.end.y)]
        elif isinstance(piece, svgelements.Line | svgelements.Close):
            if piece.end is not None:
                points.append((piece.end.x, piece.end.y))
        else:
            points += [(float(x), float(y)) for x, y in piece.npoint(CURVE_PLACES)]
    yield points, False


SHAPES: dict[str, Callable[[Element], Iterator[tuple[Points, bool]]]] = {
    "line": _line,
    "rect": _rect,
    "polyline": _polyline,
    "polygon": _polyline,
    "path": _path,
}
