"""Shapes and paths of SVG as polylines, lengths with their units."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from xml.etree.ElementTree import Element

import numpy as np
import svgelements

from ...errors import MalformedFileError
from ...report import shown
from .xml import Node, kind_of

CURVE_CHORDS = 16  # that a curve of a path is drawn with
CURVE_PLACES = np.arange(1, CURVE_CHORDS + 1) / CURVE_CHORDS

# User units (px of CSS, 96 an inch).
UNITS = {"": 1.0, "px": 1.0, "pt": 4 / 3, "pc": 16.0, "mm": 96 / 25.4, "cm": 960 / 25.4, "q": 24 / 25.4, "in": 96.0}
_NUMBER = r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?"
_LENGTH = re.compile(rf"\s*({_NUMBER})\s*([a-zA-Z]*|%)\s*")
_LIST = re.compile(rf"[\s,]*({_NUMBER})")
NOT_IN_PATH = re.compile(r"[^MmZzLlHhVvCcSsQqTtAaEe0-9+\-.,\s]")

Points = list[tuple[float, float]]
Polylines = Iterator[tuple[Points, bool]]


@dataclass(frozen=True, slots=True)
class Viewport:
    """The box that percentages are of, user units; nan where the file does not say how large it is."""

    x: float = 0.0
    y: float = 0.0
    width: float = math.nan
    height: float = math.nan

    @property
    def corners(self) -> Points:
        """Its four corners."""
        right, bottom = self.x + self.width, self.y + self.height
        return [(self.x, self.y), (right, self.y), (right, bottom), (self.x, bottom)]

    def of_axis(self, axis: str) -> float:
        """Return what 100 % is along ``x``, along ``y``, or of a length in any direction."""
        if axis == "x":
            return self.width
        return self.height if axis == "y" else math.hypot(self.width, self.height) / math.sqrt(2.0)

    def length(self, text: str, axis: str) -> float:
        """Return a length in user units, nan of an unknown percentage; raises ValueError or LookupError for others."""
        found = _LENGTH.fullmatch(text)
        if found is None:
            raise ValueError(text)
        unit = found[2].lower()
        return float(found[1]) * (self.of_axis(axis) / 100.0 if unit == "%" else UNITS[unit])


@dataclass(frozen=True, slots=True)
class Measure:
    """Reads the lengths of one element.

    Attributes
    ----------
    element : Element
    viewport : Viewport
    """

    element: Element
    viewport: Viewport

    def length(self, key: str, axis: str, default: str = "0") -> float:
        """Return an attribute in user units.

        Raises
        ------
        MalformedFileError
            When it is no length.
        """
        text = self.element.get(key, default).strip()
        if text.lower() in ("", "auto"):
            text = default
        try:
            length = self.viewport.length(text, axis)
        except (ValueError, LookupError) as error:
            raise self.refused(key, text, "a number, alone or with px, pt, pc, mm, cm, in or %") from error
        if math.isnan(length):
            raise self.refused(
                key, text, "no percentage where the svg element has neither viewBox nor width and height"
            )
        return length

    def numbers(self, key: str) -> list[float]:
        """Return an attribute that is a list of numbers.

        Raises
        ------
        MalformedFileError
            When something else is in it.
        """
        text, at, numbers = self.element.get(key, ""), 0, []
        while (found := _LIST.match(text, at)) is not None:
            numbers.append(float(found[1]))
            at = found.end()
        if text[at:].strip(" \t\r\n,"):
            raise self.refused(key, text[at:].strip(" \t\r\n,")[:20], "numbers, two for each point")
        return numbers

    def refused(self, key: str, found: str, expected: str) -> MalformedFileError:
        """Return the error for an attribute, which says where it is."""
        line = self.element.line if isinstance(self.element, Node) else 0
        return MalformedFileError(
            f"line {line}: {key} of a {shown(kind_of(self.element))} element is '{shown(found)}', expected {expected}"
        )


def _line(measure: Measure) -> Polylines:
    x1, y1, x2, y2 = (measure.length(key, key[0]) for key in ("x1", "y1", "x2", "y2"))
    yield [(x1, y1), (x2, y2)], False


def _rect(measure: Measure) -> Polylines:
    x, y = measure.length("x", "x"), measure.length("y", "y")
    w, h = measure.length("width", "x"), measure.length("height", "y")
    if w > 0.0 and h > 0.0:  # else it is not drawn
        yield Viewport(x, y, w, h).corners, True


def _polyline(measure: Measure) -> Polylines:
    numbers = measure.numbers("points")
    if len(numbers) % 2:
        raise measure.refused("points", f"a list of {len(numbers)}", "numbers, two for each point")
    yield list(zip(numbers[::2], numbers[1::2], strict=False)), kind_of(measure.element) == "polygon"


def _path(measure: Measure) -> Polylines:
    points: Points = []
    text = measure.element.get("d", "")
    try:
        if (wrong := NOT_IN_PATH.search(text)) and text.strip() != "none":  # where the library ends without a word
            raise measure.refused("d", text[wrong.start() : wrong.start() + 20], "the commands of a path")
        pieces = svgelements.Path("" if text.strip() == "none" else text)
    except (ValueError, TypeError, LookupError, AttributeError) as error:
        raise measure.refused("d", text[:20], "the commands of a path") from error
    for piece in pieces:
        if isinstance(piece, svgelements.Move):
            yield points, False
            points = [(piece.end.x, piece.end.y)]
        elif isinstance(piece, svgelements.Line | svgelements.Close):
            if piece.end is not None:
                points.append((piece.end.x, piece.end.y))
        else:
            points += [(float(x), float(y)) for x, y in piece.npoint(CURVE_PLACES)]
    yield points, False


SHAPES: dict[str, Callable[[Measure], Polylines]] = {
    "line": _line,
    "rect": _rect,
    "polyline": _polyline,
    "polygon": _polyline,
    "path": _path,
}
