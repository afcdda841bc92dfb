"""Which shapes of an SVG are drawn, and where."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np
import svgelements
from numpy.typing import NDArray
from tinycss2.color4 import parse_color

from ...limits import MAX_UNITS
from ..drawing import Drawing
from .shapes import SHAPES, Measure, Points, Viewport
from .styles import Styles
from .transforms import matrix_of
from .xml import Bounds, kind_of

INKSCAPE_LABEL = "http://www.inkscape.org/namespaces/inkscape}label"
LINK = "http://www.w3.org/1999/xlink}href"
NOT_DRAWN = {
    "defs", "symbol", "clipPath", "mask", "pattern", "marker", "metadata", "title", "desc", "style", "script",
    "linearGradient", "radialGradient", "filter", "view", "cursor", "font", "animate", "animateTransform", "set",
}  # fmt: skip
INHERITED = {"visibility", "stroke", "stroke-opacity", "stroke-width", "stroke-dasharray", "fill", "fill-opacity"}
GROUPS = {"g", "a"}
CONDITIONS = {"systemLanguage", "requiredExtensions"}  # of a child of switch that is passed over
FLOORS = ("data-level", "data-floor")
WHOLE = 1e-3  # of the picture; a background covers all but that, and what is inside extends no farther

Matrix = Any


@dataclass(frozen=True, slots=True)
class Place:
    """The properties that an element inherits.

    Attributes
    ----------
    layers : tuple of str
        Their names.
    groups : tuple of str
        The names of groups and classes.
    matrix : Matrix
        From the element's units to the root's.
    viewport : Viewport
    style : mapping of str to str
        Properties that are inherited.
    frames : tuple of (2, 2)
        Least and greatest x and y of the picture and of the nested ones around the element, the root's units.
    copied : tuple of Element
        The targets of the enclosing use elements.
    """

    layers: tuple[str, ...] = ()
    groups: tuple[str, ...] = ()
    matrix: Matrix = field(default_factory=svgelements.Matrix)
    viewport: Viewport = field(default_factory=Viewport)
    style: Mapping[str, str] = field(default_factory=dict)
    frames: tuple[NDArray[np.float64], ...] = ()
    copied: tuple[Element, ...] = ()

    @property
    def stroke_width(self) -> float:
        """The width of drawn lines, own units; NaN if it is not a plain number, such as a fraction of the picture."""
        try:
            width = float(self.style.get("stroke-width", "nan").lower().removesuffix("px"))
        except ValueError:
            return math.nan
        return width if 0.0 <= width <= MAX_UNITS else math.nan

    def paints(self, key: str) -> bool | None:
        """Tell whether "stroke" or "fill" paints anything; None if not specified."""
        if _is_zero(self.style.get(f"{key}-opacity")):
            return False
        if key not in self.style:
            return None
        colour = parse_color(self.style[key])
        return self.style[key].lower() != "none" and getattr(colour, "alpha", 1.0) != 0.0

    @property
    def width(self) -> float:
        """Of a line, the root's units."""
        m = self.matrix
        return 0.0 if math.isnan(self.stroke_width) else self.stroke_width * math.sqrt(abs(m.a * m.d - m.b * m.c))

    def applied(self, points: Points) -> NDArray[np.float64]:
        """Return points in the root's units, (n, 2)."""
        p, m = np.asarray(points, dtype=np.float64).reshape(-1, 2), self.matrix
        x, y = m.a * p[:, 0] + m.c * p[:, 1] + m.e, m.b * p[:, 0] + m.d * p[:, 1] + m.f
        return np.stack([x, y], axis=1)

    def framed(self, box: Viewport) -> Place:
        """Return the place of what is in a picture; one whose size is not known hides nothing."""
        corners = self.applied(box.corners)
        low, high = corners.min(axis=0), corners.max(axis=0)
        slack = WHOLE * float((high - low).max())
        frame = np.stack([low - slack, high + slack])
        return self if np.isnan(frame).any() else replace(self, frames=(*self.frames, frame))

    def shows(self, places: NDArray[np.float64]) -> bool:
        """Tell whether all of some points, (n, 2) the root's units, are within the pictures."""
        return all(bool((low <= places).all() and (places <= high).all()) for low, high in self.frames)


class Visible:
    """Goes through a document and yields the shapes that are drawn; the notes count the others."""

    def __init__(self, root: Element, drawing: Drawing) -> None:
        self._root, self._drawing = root, drawing
        self._styles = Styles(root)
        self._by_id: dict[str, Element] = {}
        for element in root.iter():
            self._by_id.setdefault(element.get("id", ""), element)
        self._bounds = Bounds()
        self._whole = Viewport()

    def shapes(self) -> Iterator[tuple[Element, Place]]:
        """Yield the shapes that are drawn, with where they stand.

        Raises
        ------
        FormatError
            When copies by use are too many or too deep, or a length cannot be read.
        """
        self._whole = self._viewport_of_root()
        style = self._styles.of(self._root)
        if not self._displayed(self._root, style):
            return
        outer = Place(viewport=self._whole)
        place = replace(self._inherited(self._root, outer, style), layers=(), groups=()).framed(self._whole)
        for child in self._root:
            yield from self._drawn(child, place, 1)

    def _drawn(self, element: Element, outer: Place, depth: int) -> Iterator[tuple[Element, Place]]:
        kind = kind_of(element)
        if kind in NOT_DRAWN or kind.startswith("{"):
            return
        self._bounds.take(element.attrib, depth)
        style = self._styles.of(element)
        if not self._displayed(element, style):
            return
        place = self._inherited(element, outer, style)
        if kind in GROUPS:
            for child in element:
                yield from self._drawn(child, place, depth + 1)
        elif kind == "switch":
            first = next((child for child in element if not CONDITIONS & child.attrib.keys()), None)
            if first is not None:
                yield from self._drawn(first, place, depth + 1)
        elif kind == "svg":
            yield from self._nested(element, element, place, depth)
        elif kind == "use":
            yield from self._copied(element, place, depth)
        elif kind not in SHAPES:
            self._drawing.drop(kind)
        elif self._painted(element, kind, place):
            yield element, place

    def _displayed(self, element: Element, style: Mapping[str, str]) -> bool:
        """Tell whether an element is displayed; count the shapes in it where it is not."""
        if style.get("display", "").lower() != "none" and not _is_zero(style.get("opacity")):
            return True
        inner = sum(1 for one in element.iter() if kind_of(one) in SHAPES)
        self._drawing.notes.add_dropped("hidden", "elements that are not displayed", max(1, inner))
        return False

    def _inherited(self, element: Element, outer: Place, style: Mapping[str, str]) -> Place:
        label = element.get(INKSCAPE_LABEL) or element.get("data-name", "")
        floor = next((f"Level {element.get(key)}" for key in FLOORS if key in element.attrib), "")
        names = [floor, label, element.get("id", ""), element.get("class", "")]
        group = label or (names[2] if kind_of(element) in GROUPS else "") or names[3]
        clipped = any(style.get(key, "none").lower() != "none" for key in ("clip-path", "mask"))
        if clipped:
            self._drawing.notes.add_assumed(
                "clipped",
                "elements with a clip-path or a mask are used whole, although a part of them may be hidden",
                1,
            )
        matrix = matrix_of(style, outer.viewport, self._drawing)
        return replace(
            outer,
            layers=(*outer.layers, *filter(None, names)),
            groups=(*outer.groups, *filter(None, [group])),
            matrix=outer.matrix if matrix is None else matrix * outer.matrix,
            style={**outer.style, **{key: value for key, value in style.items() if key in INHERITED and value}},
        )

    def _painted(self, element: Element, kind: str, place: Place) -> bool:
        """Tell whether a shape can be seen; count those that cannot."""
        notes = self._drawing.notes
        stroked, filled = place.paints("stroke"), place.paints("fill")
        if place.style.get("visibility", "visible").lower() != "visible":
            notes.add_dropped("hidden", "elements that are not displayed", 1)
        elif (stroked is False or place.stroke_width == 0.0) and (kind == "line" or filled is False):
            notes.add_dropped("not_painted", "elements with neither stroke nor fill", 1)
        elif kind == "rect" and not stroked and filled and self._covers_all(element, place):
            notes.add_dropped("background", "filled rectangles without a stroke that cover the whole picture", 1)
        else:
            return True
        return False

    def _covers_all(self, element: Element, place: Place) -> bool:
        if element.get("width", "").strip() == element.get("height", "").strip() == "100%":
            return True
        (points, _), *_ = [*SHAPES["rect"](Measure(element, place.viewport)), ([(0.0, 0.0)], False)]
        corners, picture = place.applied(points), self._whole
        slack = WHOLE * max(picture.width, picture.height)
        begins = corners.min(axis=0) <= np.array([picture.x, picture.y]) + slack
        ends = corners.max(axis=0) >= np.array([picture.x + picture.width, picture.y + picture.height]) - slack
        return bool(begins.all() and ends.all())  # False where the size is not known

    def _viewport_of_root(self) -> Viewport:
        measure = Measure(self._root, Viewport())
        box = _view_box(measure)
        if box is not None:
            return box
        if any("%" in self._root.get(key, "100%") for key in ("width", "height")):
            return Viewport()
        return Viewport(0.0, 0.0, measure.length("width", "x"), measure.length("height", "y"))

    def _nested(self, element: Element, sized: Element, outer: Place, depth: int) -> Iterator[tuple[Element, Place]]:
        """Yield the shapes of an svg or a symbol; its size may be that of the use."""
        own = Measure(element, outer.viewport)
        size = Measure(sized if sized.attrib.keys() & {"width", "height"} else element, outer.viewport)
        box = _view_box(own)
        matrix = outer.matrix
        if kind_of(element) == "svg":
            matrix = svgelements.Matrix.translate(own.length("x", "x"), own.length("y", "y")) * matrix
        viewport = outer.viewport
        if size.element.attrib.keys() & {"width", "height"} or box is not None:
            width = size.length("width", "x", "100%")
            height = size.length("height", "y", "100%")
            if width <= 0.0 or height <= 0.0 or (box is not None and (box.width <= 0.0 or box.height <= 0.0)):
                self._drawing.notes.add_dropped("hidden", "elements that are not displayed", 1)
                return
            viewport = Viewport(0.0, 0.0, width, height)
            outer = replace(outer, matrix=matrix).framed(viewport)
            if box is not None:
                matrix = _fitted(box, viewport, element.get("preserveAspectRatio", "")) * matrix
                viewport = box
        place = replace(outer, matrix=matrix, viewport=viewport)
        for child in element:
            yield from self._drawn(child, place, depth + 1)

    def _copied(self, element: Element, outer: Place, depth: int) -> Iterator[tuple[Element, Place]]:
        """Yield the shapes that a use element refers to."""
        link = element.get("href", element.get(LINK, "")).strip()
        target = self._by_id.get(link[1:]) if link.startswith("#") and len(link) > 1 else None
        if target is None or target in outer.copied or target is self._root:
            told = "use elements that refer to nothing in this file, or to themselves"
            self._drawing.notes.add_dropped("use", told, 1)
            return
        measure = Measure(element, outer.viewport)
        moved = svgelements.Matrix.translate(measure.length("x", "x"), measure.length("y", "y")) * outer.matrix
        place = replace(outer, matrix=moved, copied=(*outer.copied, target))
        if kind_of(target) not in ("symbol", "svg"):
            yield from self._drawn(target, place, depth + 1)
            return
        self._bounds.take(target.attrib, depth)
        style = self._styles.of(target)
        if self._displayed(target, style):
            yield from self._nested(target, element, self._inherited(target, place, style), depth)


def _view_box(measure: Measure) -> Viewport | None:
    if not measure.element.get("viewBox", "").strip():
        return None
    numbers = measure.numbers("viewBox")
    if len(numbers) != 4:
        raise measure.refused("viewBox", measure.element.get("viewBox", ""), "four numbers")
    return Viewport(*numbers)


def _fitted(box: Viewport, into: Viewport, aspect: str) -> Matrix:
    """Return the matrix that fits a viewBox into a viewport, by preserveAspectRatio."""
    align, *others = aspect.replace("defer", "").split() or ["xMidYMid"]
    sx, sy = into.width / box.width, into.height / box.height
    if align != "none":
        sx = sy = max(sx, sy) if "slice" in others else min(sx, sy)
    shares = {"Min": 0.0, "Mid": 0.5, "Max": 1.0}
    x = shares.get(align[1:4], 0.5) * (into.width - sx * box.width) - sx * box.x
    y = shares.get(align[5:8], 0.5) * (into.height - sy * box.height) - sy * box.y
    return svgelements.Matrix(sx, 0.0, 0.0, sy, x, y)


def _is_zero(value: str | None) -> bool:
    try:
        return value is not None and float(value.rstrip("%px")) == 0.0
    except ValueError:
        return False
