"""Worlds to scan: rooms with known answers, the paper's three, and boxes that are in no map.

All are drawn with free space on the left of every segment: a room's outline runs counter-clockwise, an obstacle's
clockwise. The paper (section 4, figure 5) prints no coordinates; its three are drawn here in their character on its
grid of 50 units.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from registration import RigidTransform, Segments

from .scanner import SimulationError

Floats = NDArray[np.float64]
Corner = tuple[float, float]

# Distance of a box from a world's poses, metres.
CLEARANCE = 0.5


@dataclass(frozen=True, slots=True)
class World:
    """A map and places in its free space to scan from.

    Attributes
    ----------
    name : str
    segments : Segments
        Metres in the map frame.
    poses : tuple of RigidTransform
        map_from_scan.
    mapped : int
        Number of the segments, from the first, that a map of this world has; the rest are unmapped obstacles.
    """

    name: str
    segments: Segments
    poses: tuple[RigidTransform, ...]
    mapped: int

    @property
    def map(self) -> Segments:
        """The mapped segments; a hit below `mapped` is its index here."""
        return self.segments.take(np.arange(self.mapped))


def outline(corners: Sequence[Corner]) -> Floats:
    """Return the ``(n, 4)`` edges of a closed polygon, in the corners' order."""
    p = np.asarray(corners, dtype=np.float64)
    return np.hstack([p, np.roll(p, -1, axis=0)])


def drawn(
    name: str, pieces: Sequence[Floats], poses: Sequence[tuple[float, float, float]], scale: float = 1.0
) -> World:
    """Return a world of pieces of ``(n, 4)`` segments and poses ``(x, y, theta)``, lengths multiplied by `scale`."""
    segments = Segments.from_array(np.vstack(pieces) * scale)
    return World(name, segments, tuple(RigidTransform(x * scale, y * scale, t) for x, y, t in poses), len(segments))


def rectangle_room(width: float = 8.0, height: float = 5.0) -> World:
    """Return a room of width by height metres about the origin: two poses fit every scan of it, half a turn apart."""
    _positive("width", width)
    _positive("height", height)
    x, y = 0.5 * width, 0.5 * height
    poses = [(0.0, 0.0, 0.0), (0.5 * x, 0.3 * y, 0.7), (-0.6 * x, -0.5 * y, -2.0)]
    return drawn("rectangle_room", [outline([(-x, -y), (x, -y), (x, y), (-x, y)])], poses)


def square_room(side: float = 6.0) -> World:
    """Return a room of side by side metres about the origin: four poses fit every scan of it."""
    _positive("side", side)
    room = rectangle_room(side, side)
    return World("square_room", room.segments, room.poses, room.mapped)


def l_room(width: float = 8.0, height: float = 6.0, notch: float = 3.0) -> World:
    """Return a room with a square of `notch` metres cut out of its upper right: one pose fits what shows the notch."""
    _positive("width", width)
    _positive("height", height)
    if not 0.0 < notch < min(width, height):
        raise SimulationError(f"expected above 0 and below width and height, found {notch!r}", argument="notch")
    x, y = width - notch, height - notch
    corners = [(0.0, 0.0), (width, 0.0), (width, y), (x, y), (x, height), (0.0, height)]
    poses = [(0.5 * x, 0.5 * y, 0.0), (0.6 * x, y + 0.4 * notch, 2.0), (x + 0.5 * notch, 0.4 * y, -1.0)]
    return drawn("l_room", [outline(corners)], poses)


def corridor(length: float = 60.0, width: float = 2.0) -> World:
    """Return two walls along x, open at both ends: the pose along them is free."""
    _positive("length", length)
    _positive("width", width)
    x, y = 0.5 * length, 0.5 * width
    walls = np.array([[-x, -y, x, -y], [x, y, -x, y]])
    return drawn("corridor", [walls], [(0.0, 0.0, 0.0), (0.1 * x, 0.4 * y, 0.3), (-0.2 * x, -0.5 * y, 3.0)])


def cut_square(unit: float = 0.01) -> World:
    """Return the paper's CutSquare: a square with a corner cut off.

    Parameters
    ----------
    unit : float
        Metres of one of the paper's units.
    """
    _positive("unit", unit)
    corners = [(0.0, 0.0), (400.0, 0.0), (400.0, 250.0), (250.0, 400.0), (0.0, 400.0)]
    poses = _path([(75.0, 75.0), (325.0, 75.0), (325.0, 200.0), (200.0, 325.0), (75.0, 325.0)], 10)
    return drawn("cut_square", [outline(corners)], poses, unit)


def oblique(unit: float = 0.01) -> World:
    """Return the paper's Oblique: a hall of walls in many directions and lengths; `unit` is as in `cut_square`."""
    _positive("unit", unit)
    corners = [
        (0.0, 50.0), (150.0, 0.0), (200.0, 60.0), (300.0, 20.0), (430.0, 50.0), (500.0, 150.0), (450.0, 200.0),
        (500.0, 320.0), (400.0, 400.0), (330.0, 340.0), (250.0, 400.0), (120.0, 370.0), (100.0, 300.0), (20.0, 280.0),
        (60.0, 180.0),
    ]  # fmt: skip
    block = [(230.0, 170.0), (210.0, 220.0), (270.0, 240.0), (300.0, 190.0)]
    poses = _path([(110.0, 90.0), (260.0, 110.0), (400.0, 130.0), (400.0, 290.0), (250.0, 310.0), (120.0, 240.0)], 12)
    return drawn("oblique", [outline(corners), outline(block)], poses, unit)


def pillars(unit: float = 0.01) -> World:
    """Return the paper's Pillars: a hall whose narrow pillars hide much of it; `unit` is as in `cut_square`."""
    _positive("unit", unit)
    hall = outline([(0.0, 0.0), (500.0, 0.0), (500.0, 350.0), (400.0, 400.0), (0.0, 400.0)])
    posts = [(100, 100, 15), (200, 100, 25), (300, 100, 15), (400, 100, 20), (150, 200, 20), (250, 200, 10),
             (350, 200, 25), (100, 300, 25), (200, 300, 15), (300, 300, 20), (400, 300, 15)]  # fmt: skip
    blocks = [
        outline([(x - r, y - r), (x - r, y + r), (x + r, y + r), (x + r, y - r)]) for x, y, r in np.array(posts, float)
    ]
    poses = _path([(50.0, 150.0), (300.0, 150.0), (450.0, 150.0), (450.0, 250.0), (200.0, 250.0), (50.0, 250.0)], 12)
    return drawn("pillars", [hall, *blocks], poses, unit)


def with_obstacles(world: World, boxes: int, rng: np.random.Generator, size: tuple[float, float] = (0.3, 1.2)) -> World:
    """Return the world with boxes that its map does not know, anywhere but on its poses.

    Parameters
    ----------
    world : World
    boxes : int
        Number, at least 0.
    rng : numpy.random.Generator
    size : (float, float)
        Least and greatest length of their sides, metres.
    """
    if boxes < 0:
        raise SimulationError(f"expected 0 or more, found {boxes!r}", argument="boxes")
    if not 0.0 < size[0] <= size[1]:
        raise SimulationError(f"expected two lengths above 0, the lesser first, found {size!r}", argument="size")
    points = world.segments.endpoints.reshape(-1, 2)
    places = np.array([[p.x, p.y] for p in world.poses]).reshape(-1, 2)
    pieces = [world.segments.endpoints]
    for _ in range(100 * boxes):
        if len(pieces) > boxes:
            break
        half = 0.5 * rng.uniform(*size, 2)
        middle = rng.uniform(points.min(axis=0), points.max(axis=0))
        turn = rng.uniform(0.0, math.tau)
        if len(places) and np.min(np.hypot(*(places - middle).T)) < np.hypot(*half) + CLEARANCE:
            continue
        clockwise = np.array([[-1.0, -1.0], [-1.0, 1.0], [1.0, 1.0], [1.0, -1.0]]) * half
        corners = RigidTransform(middle[0], middle[1], turn).apply(clockwise)
        pieces.append(outline([(x, y) for x, y in corners]))
    return World(world.name, Segments.from_array(np.vstack(pieces)), world.poses, world.mapped)


def _path(corners: Sequence[Corner], count: int) -> list[tuple[float, float, float]]:
    """Return poses spread evenly over a closed path, looking along it."""
    p = np.asarray([*corners, corners[0]])
    steps = np.hypot(*np.diff(p, axis=0).T)
    travelled = np.concatenate([[0.0], np.cumsum(steps)])
    poses = []
    for s in np.arange(count) * travelled[-1] / count:
        k = int(np.searchsorted(travelled, s, side="right")) - 1
        along = (p[k + 1] - p[k]) / steps[k]
        x, y = p[k] + (s - travelled[k]) * along
        poses.append((float(x), float(y), math.atan2(along[1], along[0])))
    return poses


def _positive(argument: str, value: float) -> None:
    if not 0.0 < value < math.inf:
        raise SimulationError(f"expected above 0, found {value!r}", argument=argument)
