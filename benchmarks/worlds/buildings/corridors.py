"""Parts of buildings with corridors: rooms in rows behind a wall."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from .plan import Plan
from .shapes import box

Row = list[tuple[Plan, float]]


def rooms_along(plan: Plan, widths: Sequence[float], wall: float, mirrored: Sequence[bool] = ()) -> Row:
    """Lay rooms behind the wall along the x axis.

    Parameters
    ----------
    plan : Plan
        The corridor's face of the wall lies at y = 0, the rooms above.
    widths : sequence of float
        From one room's near wall to the next one's, metres.
    wall : float
        Thickness, metres.
    mirrored : sequence of bool
        Which rooms are drawn from right to left; by default none.

    Returns
    -------
    list of (Plan, float)
        Each room's part of the plan, x along the corridor and y into the room, and its inner width.
    """
    rooms: Row = []
    x = 0.0
    for k, width in enumerate(widths):
        inner = width - wall
        flipped = k < len(mirrored) and mirrored[k]
        rooms.append((plan.at(x + inner, wall, mirrored=True) if flipped else plan.at(x, wall), inner))
        x += width
    return rooms


def corridor(plan: Plan, length: float, width: float) -> tuple[Plan, Plan]:
    """Draw a corridor from the origin along x; return the plans of the rows above and below it."""
    plan.room(box(0.0, 0.0, length, width))
    return plan.at(0.0, width), plan.at(length, 0.0, math.pi)


def door(plan: Plan, start: float, width: float, wall: float, *, leaf: bool = True) -> None:
    """Open a room of a row to the corridor, from `start` metres along its near wall."""
    plan.opening((start, 0.0), (start + width, 0.0), wall, door=leaf)


def modules(rng: np.random.Generator, count: int, module: float, double: float) -> list[float]:
    """Fill a row of `count` modules; return the widths of its rooms, of two modules with probability `double`."""
    widths: list[float] = []
    while count > 0:
        taken = 2 if count > 1 and rng.random() < double else 1
        widths.append(taken * module)
        count -= taken
    return widths
