"""A generator of office floors: corridors, rooms of many widths behind doors, repeated as far as wanted."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .scanner import SimulationError
from .worlds import World, drawn

Floats = NDArray[np.float64]
Opening = tuple[float, float]


@dataclass(frozen=True, slots=True)
class OfficePlan:
    """Dimensions of a floor; lengths in metres.

    Attributes
    ----------
    rooms : int
        On each side of every corridor, at least 1.
    corridors : int
        Parallel ones, joined by one across their left ends, at least 1.
    room_width : (float, float)
        Least and greatest; equal for a building that repeats itself.
    depth : float
        Of the rooms.
    corridor_width, door_width, wall : float
        The last is the thickness of the walls.
    """

    rooms: int = 6
    corridors: int = 2
    room_width: tuple[float, float] = (2.5, 6.0)
    depth: float = 4.5
    corridor_width: float = 2.0
    door_width: float = 0.9
    wall: float = 0.15

    def __post_init__(self) -> None:
        low, high = self.room_width
        checks = [
            ("rooms", self.rooms >= 1, "at least 1"),
            ("corridors", self.corridors >= 1, "at least 1"),
            ("room_width", self.door_width + 0.4 + self.wall <= low <= high < math.inf, "two widths that hold a door"),
            ("depth", 0.0 < self.depth < math.inf, "above 0"),
            ("corridor_width", 0.0 < self.corridor_width < math.inf, "above 0"),
            ("door_width", self.door_width > 0.0, "above 0"),
            ("wall", 0.0 < self.wall < math.inf, "above 0"),
        ]
        for argument, good, what in checks:
            if not good:
                raise SimulationError(f"expected {what}, found {getattr(self, argument)!r}", argument=argument)


def offices(rng: np.random.Generator, plan: OfficePlan | None = None) -> World:
    """Draw a floor; the poses are one in the middle of each room and one before each door.

    Parameters
    ----------
    rng : numpy.random.Generator
        Of the widths, the doors' places and the poses' headings.
    plan : OfficePlan, optional
    """
    plan = plan or OfficePlan()
    t, broad = plan.wall, plan.corridor_width
    pieces: list[Floats] = []
    poses: list[tuple[float, float, float]] = []
    mouths: list[Opening] = []
    for k in range(plan.corridors):
        low = k * (2.0 * plan.depth + broad + 3.0 * t) + plan.depth + t
        high = low + broad
        below, floor_below = _row(rng, plan, low, -1.0, pieces, poses)
        above, floor_above = _row(rng, plan, high, 1.0, pieces, poses)
        end = max(floor_below, floor_above)
        pieces.append(_rectangle((0.0, low, end, high), below, above, left=[(low, high)]))
        # The corridor's mouth through the wall of the one across.
        pieces.append(np.array([[-t, low, 0.0, low], [0.0, high, -t, high]]))
        mouths.append((low, high))
    top = mouths[-1][1] + plan.depth + t
    pieces.append(_rectangle((-t - broad, 0.0, -t, top), right=mouths))
    return drawn("offices", pieces, poses)


def _row(
    rng: np.random.Generator,
    plan: OfficePlan,
    face: float,
    side: float,
    pieces: list[Floats],
    poses: list[tuple[float, float, float]],
) -> tuple[list[Opening], float]:
    """Draw the rooms on one side of the corridor wall at y = face; return their doors and where they end."""
    doors: list[Opening] = []
    x = 0.0
    near, far = face + side * plan.wall, face + side * (plan.wall + plan.depth)
    for _ in range(plan.rooms):
        width = rng.uniform(*plan.room_width)
        right = x + width - plan.wall
        a = rng.uniform(x + 0.2, right - 0.2 - plan.door_width)
        door = (a, a + plan.door_width)
        if side > 0.0:
            pieces.append(_rectangle((x, near, right, far), bottom=[door]))
            pieces.append(np.array([[door[0], near, door[0], face], [door[1], face, door[1], near]]))
        else:
            pieces.append(_rectangle((x, far, right, near), top=[door]))
            pieces.append(np.array([[door[0], face, door[0], near], [door[1], near, door[1], face]]))
        poses.append((0.5 * (x + right), 0.5 * (near + far), rng.uniform(-math.pi, math.pi)))
        poses.append(
            (a + 0.5 * plan.door_width, face - 0.5 * side * plan.corridor_width, rng.uniform(-math.pi, math.pi))
        )
        doors.append(door)
        x += width
    return doors, x - plan.wall


def _rectangle(
    box: tuple[float, float, float, float],
    bottom: list[Opening] | None = None,
    top: list[Opening] | None = None,
    left: list[Opening] | None = None,
    right: list[Opening] | None = None,
) -> Floats:
    """Return the walls about a room ``(x0, y0, x1, y1)``, counter-clockwise, without the openings in its sides."""
    x0, y0, x1, y1 = box
    walls = [[a, y0, b, y0] for a, b in _solid(x0, x1, bottom)]
    walls += [[x1, a, x1, b] for a, b in _solid(y0, y1, right)]
    walls += [[b, y1, a, y1] for a, b in reversed(_solid(x0, x1, top))]
    walls += [[x0, b, x0, a] for a, b in reversed(_solid(y0, y1, left))]
    return np.array(walls).reshape(-1, 4)


def _solid(low: float, high: float, openings: list[Opening] | None) -> list[Opening]:
    """Return what is left of low..high between the openings."""
    edges = [low, *(e for opening in sorted(openings or []) for e in opening), high]
    return [(a, b) for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a > 1e-6]
