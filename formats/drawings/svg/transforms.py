"""The place of an element of an SVG: transform, transform-origin, and the properties translate, rotate and scale."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Any

import svgelements

from ...errors import MalformedFileError
from ...report import shown
from ..drawing import Drawing
from .shapes import Viewport

FUNCTION = re.compile(r"([a-zA-Z]\w*)\s*\(([^)]*)\)")
WORDS = {"left": ("x", 0.0), "right": ("x", 100.0), "top": ("y", 0.0), "bottom": ("y", 100.0), "center": ("", 50.0)}

WHERE = ("transform", "transform-origin", "scale", "rotate", "translate")

Matrix = Any
Arguments = list[str]

# Functions of CSS in space, as those of the plane; what turns out of the plane is not among them.
FLAT: dict[str, Callable[[Arguments], str]] = {
    "translatez": lambda a: "",
    "scale3d": lambda a: f"scale({a[0]}, {a[1]})",
    "scalez": lambda a: "",
    "rotatez": lambda a: f"rotate({a[0]})",
    "matrix3d": lambda a: f"matrix({', '.join((a[0], a[1], a[4], a[5], a[12], a[13]))})",
}
OF_SVG = {
    "matrix", "translate", "translatex", "translatey", "scale", "scalex", "scaley", "rotate", "skew", "skewx", "skewy",
}  # fmt: skip


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
    try:
        return _matrix_of(style, viewport, drawing)
    except (ValueError, LookupError) as error:
        told = "; ".join(f"{key}: {style[key]}" for key in WHERE if key in style)
        raise MalformedFileError(
            f"has a transform that cannot be read, '{shown(told)}'; expected numbers. Apply the transforms, or save it "
            "as plain SVG"
        ) from error


def _matrix_of(style: Mapping[str, str], viewport: Viewport, drawing: Drawing) -> Matrix | None:
    parts = [_transform(style.get("transform", "none"), viewport, drawing)]
    for name, function in (("scale", "scale"), ("rotate", "rotate"), ("translate", "translate")):
        words = style.get(name, "none").split()
        if name == "scale":
            words = [f"{float(word[:-1]) / 100.0}" if word.endswith("%") else word for word in words]
        if name == "rotate" and len(words) > 1:  # about an axis: z, or 0 0 1
            words = words[-1:] if words[:-1] in (["z"], ["0", "0", "1"]) else ["none"]
        if words not in ([], ["none"]):
            parts.append(_transform(f"{function}({', '.join(words)})", viewport, drawing))
    matrices = [part for part in parts if part is not None]
    if not matrices:
        return None
    if style.get("transform-box", "view-box").lower() != "view-box":
        drawing.notes.add_assumed("transform_box", "transform-origin refers to the viewBox, not to transform-box", 1)
    x, y = _origin(style, viewport)
    matrix = svgelements.Matrix.translate(-x, -y)
    for one in (*matrices, svgelements.Matrix.translate(x, y)):
        matrix = matrix * one
    return matrix


def _transform(text: str, viewport: Viewport, drawing: Drawing) -> Matrix | None:
    if text.strip().lower() in ("", "none"):
        return None
    flat = []
    text = re.sub(r"translate3d\s*\(([^,)]+),([^,)]+),[^)]*\)", r"translate(\1,\2)", text, flags=re.IGNORECASE)
    for name, inner in FUNCTION.findall(text):
        arguments, lower = [word for word in re.split(r"[\s,]+", inner.strip()) if word], name.lower()
        if lower in FLAT:
            flat.append(FLAT[lower](arguments))
        elif lower not in OF_SVG:
            drawing.notes.add_assumed("transform", f"transforms that are not applied, such as {shown(name)}", 1)
        elif lower.startswith("translate"):
            axes = "y" if lower == "translatey" else "xy"
            told = (str(viewport.length(word, axis)) for word, axis in zip(arguments, axes, strict=False))
            flat.append(f"{name}({', '.join(told)})")
        else:
            flat.append(f"{name}({', '.join(arguments)})")
    return svgelements.Matrix(" ".join(flat))


def _origin(style: Mapping[str, str], viewport: Viewport) -> tuple[float, float]:
    """Return the point that a transform leaves where it is; without transform-origin the origin of the units."""
    words = style.get("transform-origin", "").lower().split()[:2]
    if not words:
        return 0.0, 0.0
    if len(words) == 1:
        words = ["center", words[0]] if words[0] in ("top", "bottom") else [words[0], "center"]
    elif WORDS.get(words[0], ("x",))[0] == "y" or WORDS.get(words[1], ("y",))[0] == "x":
        words.reverse()
    starts = {"x": viewport.x, "y": viewport.y}
    places = []
    for axis, word in zip("xy", words, strict=True):
        if word in WORDS or word.endswith("%"):
            percent = WORDS[word][1] if word in WORDS else float(word[:-1])
            places.append(starts[axis] + percent / 100.0 * viewport.of_axis(axis))
        else:
            places.append(viewport.length(word, axis))
    return places[0], places[1]
