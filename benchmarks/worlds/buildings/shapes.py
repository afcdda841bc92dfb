"""Outlines to draw with, corners in counter-clockwise order, ``(k, 2)`` metres; and whether outlines cross."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def box(x0: float, y0: float, x1: float, y1: float) -> Floats:
    """Return the corners of an upright rectangle, from its lower left one."""
    return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])


def oblong(x: float, y: float, length: float, width: float, turn: float = 0.0) -> Floats:
    """Return a rectangle about ``(x, y)``, its length turned by `turn` radians from the x axis."""
    return turned(box(-0.5 * length, -0.5 * width, 0.5 * length, 0.5 * width), x, y, turn)


def chamfered(x: float, y: float, length: float, width: float, turn: float, cut: float) -> Floats:
    """Return an oblong whose corners are cut off by `cut` metres along each side: a car, a round table."""
    a, b = 0.5 * length, 0.5 * width
    corners = [
        (-a + cut, -b), (a - cut, -b), (a, -b + cut), (a, b - cut),
        (a - cut, b), (-a + cut, b), (-a, b - cut), (-a, -b + cut),
    ]  # fmt: skip
    return turned(np.array(corners), x, y, turn)


def ring(x: float, y: float, radius: float, sides: int, turn: float = 0.0) -> Floats:
    """Return a regular polygon about ``(x, y)``, its first corner at `turn` radians."""
    return arc(x, y, radius, turn, turn + math.tau, sides)[:-1]


def arc(x: float, y: float, radius: float, start: float, end: float, sides: int) -> Floats:
    """Return ``sides + 1`` points on a circle from angle `start` to angle `end`, radians."""
    angles = np.linspace(start, end, sides + 1)
    return np.stack([x + radius * np.cos(angles), y + radius * np.sin(angles)], axis=1)


def turned(corners: Floats, x: float, y: float, turn: float) -> Floats:
    """Return the corners turned about the origin, then moved by ``(x, y)``."""
    c, s = math.cos(turn), math.sin(turn)
    return np.asarray(corners @ np.array([[c, s], [-s, c]]) + [x, y])


def edges(corners: Floats) -> Floats:
    """Return the ``(k, 4)`` sides of a closed polygon, in the order of its corners."""
    return np.hstack([corners, np.concatenate([corners[1:], corners[:1]])])


def crosses(outline: Floats, walls: Floats) -> bool:
    """Tell whether any side of an outline crosses a wall; touching is not crossing.

    Parameters
    ----------
    outline : (k, 4)
    walls : (n, 4)
        Metres.
    """
    low = np.minimum(outline[:, :2], outline[:, 2:]).min(axis=0)
    high = np.maximum(outline[:, :2], outline[:, 2:]).max(axis=0)
    x0, x1 = np.minimum(walls[:, 0], walls[:, 2]), np.maximum(walls[:, 0], walls[:, 2])
    y0, y1 = np.minimum(walls[:, 1], walls[:, 3]), np.maximum(walls[:, 1], walls[:, 3])
    near = walls[(x0 < high[0]) & (x1 > low[0]) & (y0 < high[1]) & (y1 > low[1])]
    if len(near) == 0:
        return False
    p, q = outline[:, None, :2], outline[:, None, 2:]
    r, s = near[None, :, :2], near[None, :, 2:]
    parted = _side(p, q, r) * _side(p, q, s) < 0.0
    return bool((parted & (_side(r, s, p) * _side(r, s, q) < 0.0)).any())


def _side(begin: Floats, end: Floats, point: Floats) -> Floats:
    """Return where a point lies: above 0 on the left of the line from begin to end."""
    along, to = end - begin, point - begin
    return np.asarray(along[..., 0] * to[..., 1] - along[..., 1] * to[..., 0])
