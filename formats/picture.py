"""A picture of a map with its directions.

Pillow draws it, for it reads the grids anyway; matplotlib is none of the dependencies.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from PIL import Image, ImageDraw

from registration import RigidTransform

from .errors import UnsupportedFormatError
from .line_map import LineMap

SIZE = 1600  # pixels of the longer edge
MARGIN = 20  # pixels
TICK = 10.0  # pixels; towards the free side
MARK = 5.0  # pixels; of a pose
WALL, FREE_SIDE, PAPER = (20, 20, 20), (30, 140, 60), (255, 255, 255)
PATH, DOUBTFUL = (200, 40, 40), (150, 150, 150)


@dataclass(frozen=True, slots=True)
class PlaceMark:
    """A square that is painted under the walls: its middle and side, metres in the map frame, and its colour."""

    x: float
    y: float
    side: float
    colour: tuple[int, int, int]


def draw_map(
    map: LineMap,
    path: str | os.PathLike[str],
    poses: Iterable[RigidTransform] = (),
    doubtful: Iterable[RigidTransform] = (),
    marks: Iterable[PlaceMark] = (),
) -> None:
    """Draw a map as PNG: walls in black, a green tick on the free side of each, poses in red, doubtful ones in grey.

    Marks are painted below all that.

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

    Raises
    ------
    UnsupportedFormatError
        When the name ends in anything else.
    """
    if not os.fspath(path).lower().endswith(".png"):
        raise UnsupportedFormatError("expected a name that ends in .png", argument="picture")
    corners = map.segments.endpoints.reshape(-1, 2) if len(map.segments) else np.zeros((1, 2))
    low, high = corners.min(axis=0), corners.max(axis=0)
    scale = (SIZE - 2 * MARGIN) / max(float((high - low).max()), 1.0)
    width, height = (max(1, math.ceil(float(v) * scale)) + 2 * MARGIN for v in high - low)
    picture = Image.new("RGB", (width, height), PAPER)
    draw = ImageDraw.Draw(picture)

    def place(x: float, y: float) -> tuple[float, float]:
        return MARGIN + (x - float(low[0])) * scale, height - MARGIN - (y - float(low[1])) * scale

    for mark in marks:
        left, top = place(mark.x - 0.5 * mark.side, mark.y + 0.5 * mark.side)
        right, bottom = place(mark.x + 0.5 * mark.side, mark.y - 0.5 * mark.side)
        draw.rectangle([left, top, right - 1, bottom - 1], fill=mark.colour)
    for (x1, y1, x2, y2), (mx, my), (nx, ny) in zip(
        map.segments.endpoints, map.segments.midpoints, map.segments.normals, strict=True
    ):
        draw.line([place(x1, y1), place(x2, y2)], fill=WALL, width=2)
        if map.oriented:
            x, y = place(mx, my)
            draw.line([(x, y), (x + TICK * nx, y - TICK * ny)], fill=FREE_SIDE, width=2)
    for pose, colour in [*((pose, DOUBTFUL) for pose in doubtful), *((pose, PATH) for pose in poses)]:
        x, y = place(pose.x, pose.y)
        tip = x + 2 * MARK * math.cos(pose.theta), y - 2 * MARK * math.sin(pose.theta)
        draw.ellipse([x - MARK / 2, y - MARK / 2, x + MARK / 2, y + MARK / 2], fill=colour)
        draw.line([(x, y), tip], fill=colour, width=1)
    picture.save(path, format="PNG")
