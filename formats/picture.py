"""A picture of a map with its directions.

Pillow draws it, for it reads the grids anyway; matplotlib is none of the dependencies.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from registration import RigidTransform

from .colours import INK, MATCHED, POINT, USABLE, VERDICTS, WALL, rgb
from .errors import UnsupportedFormatError
from .files import ending_of
from .line_map import LineMap

SIZE = 1600  # pixels of the longer edge
MARGIN = 20  # pixels
TICK = 10.0  # pixels; towards the free side
DASH = 8.0  # pixels
MARK = 5.0  # pixels; of a pose
DOT = 0.05  # m; half the width of a point without a sigma, as the search has it
STRIP = 60  # pixels; below the map, for the scale and the legend
LETTERS = 22  # pixels; height of the text
LEAST_BAR = 120  # pixels; of the scale
PAPER = (255, 255, 255)
Box = tuple[float, float, float, float]  # left, top, right, bottom, pixels


@dataclass(frozen=True, slots=True)
class PlaceMark:
    """A square that is painted under the walls: its middle and side, metres in the map frame, and its colour."""

    x: float
    y: float
    side: float
    colour: tuple[int, int, int]


@dataclass(frozen=True, slots=True, eq=False)
class DrawnLines:
    """Lines over the walls, (n, 4) metres in the map frame; their colour, and their name in the legend."""

    ends: NDArray[np.float64]
    colour: tuple[int, int, int]
    name: str
    dashed: bool = False


@dataclass(frozen=True, slots=True)
class DrawnText:
    """A text above the lines: its middle, metres in the map frame, and its colour."""

    x: float
    y: float
    text: str
    colour: tuple[int, int, int]


def draw_map(
    map: LineMap,
    path: str | os.PathLike[str],
    poses: Iterable[RigidTransform] = (),
    doubtful: Iterable[RigidTransform] = (),
    marks: Iterable[PlaceMark] = (),
    lines: Iterable[DrawnLines] = (),
    texts: Iterable[DrawnText] = (),
) -> None:
    """Draw a map as PNG: walls and points in grey, a blue tick on the free side of each wall.

    Poses are green, doubtful ones grey. Marks are painted below all that, lines above the walls. The strip below has
    the scale and a legend.

    Parameters
    ----------
    map : LineMap
        Without ticks where its directions mean nothing.
    path : str or path
        Ends in ``.png``.
    poses, doubtful : iterable of RigidTransform
        map_from_scan; drawn as dots that point where they look.
    marks : iterable of PlaceMark
        A later one covers those before.
    lines : iterable of DrawnLines
    texts : iterable of DrawnText

    Raises
    ------
    UnsupportedFormatError
        When the name ends in anything else.
    """
    if not os.fspath(path).lower().endswith(".png"):
        raise UnsupportedFormatError(
            f"expected a name that ends in .png, found {ending_of(Path(path))}", argument="picture"
        )
    marks, poses, doubtful, lines = list(marks), list(poses), list(doubtful), list(lines)
    sheet = _Sheet.of(map)
    for mark in marks:
        left, top, right, bottom = sheet.square(mark.x, mark.y, 0.5 * mark.side)
        sheet.draw.rectangle([left, top, right - 1, bottom - 1], fill=mark.colour)
    _draw_walls(sheet, map)
    for one in lines:
        for x1, y1, x2, y2 in one.ends:
            _draw_line(sheet.draw, sheet.place(x1, y1), sheet.place(x2, y2), one)
    for pose, colour in [*((pose, rgb(POINT)) for pose in doubtful), *((pose, rgb(USABLE)) for pose in poses)]:
        x, y = sheet.place(pose.x, pose.y)
        tip = x + 2 * MARK * math.cos(pose.theta), y - 2 * MARK * math.sin(pose.theta)
        sheet.draw.ellipse([x - MARK / 2, y - MARK / 2, x + MARK / 2, y + MARK / 2], fill=colour)
        sheet.draw.line([(x, y), tip], fill=colour, width=1)
    written: list[Box] = []
    for text in texts:
        written.append(_write(sheet, text, written))
    entries = [("wall", rgb(WALL), False)] + [("free side", rgb(MATCHED), False)] * map.oriented
    entries += [("usable pose", rgb(USABLE), False)] * bool(poses)
    entries += [("pose that is not usable", rgb(POINT), False)] * bool(doubtful)
    painted = {mark.colour for mark in marks}
    entries += [(name.replace("_", " "), rgb(one), False) for name, one in VERDICTS.items() if rgb(one) in painted]
    entries += [(one.name, one.colour, one.dashed) for one in lines if len(one.ends)]
    _annotate(sheet.draw, sheet.height, sheet.scale, entries)
    sheet.picture.save(path, format="PNG")


@dataclass(frozen=True, slots=True)
class _Sheet:
    """A picture of a map whose lower left corner is at `left` and `bottom`, metres; `scale` in pixels per metre."""

    picture: Image.Image
    draw: ImageDraw.ImageDraw
    left: float
    bottom: float
    scale: float
    height: int

    @classmethod
    def of(cls, map: LineMap) -> _Sheet:
        corners = np.vstack([map.segments.endpoints.reshape(-1, 2), map.points])
        corners = corners if len(corners) else np.zeros((1, 2))
        low, high = corners.min(axis=0), corners.max(axis=0)
        scale = (SIZE - 2 * MARGIN) / max(float((high - low).max()), 1.0)
        width, height = (max(1, math.ceil(float(v) * scale)) + 2 * MARGIN for v in high - low)
        picture = Image.new("RGB", (max(width, SIZE), height + STRIP), PAPER)
        return cls(picture, ImageDraw.Draw(picture), float(low[0]), float(low[1]), scale, height)

    def place(self, x: float, y: float) -> tuple[float, float]:
        return MARGIN + (x - self.left) * self.scale, self.height - MARGIN - (y - self.bottom) * self.scale

    def square(self, x: float, y: float, half: float) -> tuple[float, float, float, float]:
        return *self.place(x - half, y + half), *self.place(x + half, y - half)


def _draw_walls(sheet: _Sheet, map: LineMap) -> None:
    walls = map.segments
    for (x1, y1, x2, y2), (mx, my), (nx, ny) in zip(walls.endpoints, walls.midpoints, walls.normals, strict=True):
        sheet.draw.line([sheet.place(x1, y1), sheet.place(x2, y2)], fill=rgb(WALL), width=2)
        if map.oriented:
            x, y = sheet.place(mx, my)
            sheet.draw.line([(x, y), (x + TICK * nx, y - TICK * ny)], fill=rgb(MATCHED), width=2)
    for x, y in map.points.tolist():
        left, top, right, bottom = sheet.square(x, y, DOT if map.points_sigma is None else map.points_sigma)
        sheet.draw.rectangle([left, top, max(right, left + 1), max(bottom, top + 1)], fill=rgb(WALL))


def _draw_line(
    draw: ImageDraw.ImageDraw, begin: tuple[float, float], end: tuple[float, float], how: DrawnLines
) -> None:
    length = math.dist(begin, end)
    count = max(1, round(length / DASH)) if how.dashed else 1
    for k in range(0, count, 2):
        a, b = k / count, min(1.0, (k + 1) / count)
        ends = [(begin[0] + t * (end[0] - begin[0]), begin[1] + t * (end[1] - begin[1])) for t in (a, b)]
        draw.line(ends, fill=how.colour, width=5)


def _write(sheet: _Sheet, told: DrawnText, written: Iterable[Box]) -> Box:
    """Write a text on paper of its own, below those that are written there; return the paper."""
    font, (x, y) = ImageFont.load_default(LETTERS), sheet.place(told.x, told.y)
    left, top, right, bottom = sheet.draw.textbbox((x, y), told.text, font=font, anchor="mm")
    paper = (left - 3, top - 3, right + 3, bottom + 3)
    for other in sorted(written, key=lambda one: one[1]):
        if paper[0] <= other[2] and other[0] <= paper[2] and paper[1] <= other[3] and other[1] <= paper[3]:
            down = other[3] + 1 - paper[1]
            y, paper = y + down, (paper[0], paper[1] + down, paper[2], paper[3] + down)
    sheet.draw.rectangle(paper, fill=PAPER, outline=told.colour)
    sheet.draw.text((x, y), told.text, fill=told.colour, font=font, anchor="mm")
    return paper


def _annotate(
    draw: ImageDraw.ImageDraw, top: float, scale: float, entries: Iterable[tuple[str, tuple[int, int, int], bool]]
) -> None:
    """Draw the scale, and a legend of names, colours, and whether lines are dashed.

    `top` of the strip in pixels, `scale` in pixels per metre.
    """
    font = ImageFont.load_default(LETTERS)
    metres = 10.0 ** math.floor(math.log10(LEAST_BAR / scale))
    metres *= next(one for one in (1, 2, 5, 10) if one * metres * scale >= LEAST_BAR)
    x, y = float(MARGIN), top + 0.5 * STRIP
    draw.line([(x, y - 6), (x, y), (x + metres * scale, y), (x + metres * scale, y - 6)], fill=rgb(INK), width=3)
    x += metres * scale + 12
    for text, colour, dashed in [(f"{metres:g} m", None, False), *entries]:
        if colour is not None:
            draw.rectangle([x, y - 6, x + 26, y + 6], fill=colour)
            if dashed:
                draw.rectangle([x + 10, y - 6, x + 16, y + 6], fill=PAPER)
            x += 34
        draw.text((x, y), text, fill=rgb(INK), font=font, anchor="lm")
        x += draw.textlength(text, font=font) + 28
