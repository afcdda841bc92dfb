"""The place of an element of an SVG: transform, transform-origin, and the properties translate, rotate and scale."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import tinycss2
from svgelements import Matrix as Plane

from ...errors import MalformedFileError
from ...report import shown
from ..drawing import Drawing
from .shapes import UNITS, Viewport

WORDS = {
    "left": ("x", "0%"),
    "right": ("x", "100%"),
    "top": ("y", "0%"),
    "bottom": ("y", "100%"),
    "center": ("", "50%"),
}
WHERE = ("transform", "transform-origin", "scale", "rotate", "translate")
SCALES = UNITS | {"deg": 1.0, "grad": 0.9, "rad": math.degrees(1.0), "turn": 360.0}

Matrix = Any


def _turned(angle: float, x: float = 0.0, y: float = 0.0) -> Matrix:
    return Plane.translate(-x, -y) * Plane.rotate(math.radians(angle)) * Plane.translate(x, y)


def _skewed(x: float, y: float = 0.0) -> Matrix:
    return Plane(1.0, math.tan(math.radians(y)), math.tan(math.radians(x)), 1.0, 0.0, 0.0)


# Functions of CSS, those in space as what they do in the plane; what turns out of the plane is not among them.
FUNCTIONS: dict[str, Callable[..., Matrix]] = {
    "matrix": lambda a, b, c, d, e, f: Plane(a, b, c, d, e, f),
    "matrix3d": lambda *m: Plane(m[0], m[1], m[4], m[5], m[12], m[13]),
    "translate": lambda x, y=0.0, _z=0.0: Plane.translate(x, y),
    "translatex": lambda x: Plane.translate(x, 0.0),
    "translatey": lambda y: Plane.translate(0.0, y),
    "scale": lambda x, y=None, _z=1.0: Plane.scale(x, x if y is None else y),
    "scalex": lambda x: Plane.scale(x, 1.0),
    "scaley": lambda y: Plane.scale(1.0, y),
    "rotate": _turned,
    "rotatez": _turned,
    "skew": _skewed,
    "skewx": _skewed,
    "skewy": lambda y: _skewed(0.0, y),
    "translatez": lambda _z: Plane(),
    "scalez": lambda _z: Plane(),
}
FUNCTIONS |= {"translate3d": FUNCTIONS["translate"], "scale3d": FUNCTIONS["scale"]}


def matrix_of(style: Mapping[str, str], viewport: Viewport, drawing: Drawing) -> Matrix | None:
    """Return the matrix from an element's units to those around it; None where it has none.

    Parameters
    ----------
    style : mapping of str to str
    viewport : Viewport
        The reference of percentages and of the words of transform-origin, as in the default of transform-box.
    drawing : Drawing
        Its notes take what is not applied.
    """
    texts = [style.get("transform", "")]
    for name in ("scale", "rotate", "translate"):
        words = style.get(name, "none").split()
        if name == "rotate" and len(words) > 1:  # about an axis: z, or 0 0 1
            name = "rotatez" if words[:-1] in (["z"], ["0", "0", "1"]) else "rotate3d"
            words = words[-1:]
        texts.append("" if words in ([], ["none"]) else f"{name}({' '.join(words)})")
    if all(text.lower() in ("", "none") for text in texts):
        return None
    if style.get("transform-box", "view-box").lower() != "view-box":
        drawing.notes.add_assumed("transform_box", "transform-origin refers to the viewBox, not to transform-box", 1)
    try:
        x, y = _origin(style, viewport)
        matrix = Plane.translate(-x, -y)
        for text in texts:
            matrix = matrix * _transform(text, viewport, drawing)
        return matrix * Plane.translate(x, y)
    except (ValueError, LookupError, TypeError, AttributeError) as error:  # the last: calc() has no value
        told = "; ".join(f"{key}: {style[key]}" for key in WHERE if key in style)
        raise MalformedFileError(
            f"has a transform that cannot be read, '{shown(told)}'; expected functions of numbers. Apply the "
            "transforms, or save it as plain SVG"
        ) from error


def _transform(text: str, viewport: Viewport, drawing: Drawing) -> Matrix:
    """Return the matrix of a list of functions."""
    matrix = Plane()
    if text.lower() == "none":
        return matrix
    if text.count("(") != text.count(")"):
        raise ValueError(text)
    for node in tinycss2.parse_component_value_list(text, skip_comments=True):
        if node.type == "whitespace" or node == ",":
            continue
        if node.type != "function":
            raise ValueError(text)
        name = node.lower_name
        if name not in FUNCTIONS:
            drawing.notes.add_assumed("transform", f"transforms that are not applied, such as {shown(name)}", 1)
            continue
        axes = "y" if name == "translatey" else "xyz" if name.startswith("translate") else ""
        values = [one for one in node.arguments if one.type != "whitespace" and one != ","]
        matrix = FUNCTIONS[name](*(_number(one, axes[k : k + 1], viewport) for k, one in enumerate(values))) * matrix
    return matrix


def _number(node: Any, axis: str, viewport: Viewport) -> float:
    """Return an argument: lengths in user units, angles in degrees, percentages of an axis or as fractions."""
    if node.type == "percentage":
        return float(node.value) / 100.0 * (viewport.of_axis(axis) if axis else 1.0)
    return float(node.value) * (SCALES[node.lower_unit] if node.type == "dimension" else 1.0)


def _origin(style: Mapping[str, str], viewport: Viewport) -> tuple[float, float]:
    """Return the point that a transform leaves where it is; without transform-origin the origin of the units."""
    words = style.get("transform-origin", "").lower().split()[:2]
    if not words:
        return 0.0, 0.0
    if len(words) == 1:
        words = ["center", words[0]] if words[0] in ("top", "bottom") else [words[0], "center"]
    elif WORDS.get(words[0], ("x",))[0] == "y" or WORDS.get(words[1], ("y",))[0] == "x":
        words.reverse()
    told = [WORDS[word][1] if word in WORDS else word for word in words]
    x, y = (viewport.length(word, axis) for word, axis in zip(told, "xy", strict=True))
    return x + viewport.x * told[0].endswith("%"), y + viewport.y * told[1].endswith("%")
