"""Compiled likelihood field: the distance to the nearest wall in the cells near walls."""

import math

import numpy as np

from compiled import kernel
from registration.layout import Record, Records

from ...layout import Integers
from ..tuning import FIELD_REACH


@kernel
def stamp_walls(ends: Records, deviation: float, shape: Records, field: Integers) -> None:
    """Raise the cells of a field to the likelihood that a wall gives them, 0 to 255.

    `ends` (m,) of `ENDS`, `deviation` in metres, `shape` (1,) of `GRID_SHAPE`, `field` (rows, columns) uint8.
    """
    cell = shape[0].cell
    for k in range(len(ends)):
        one = ends[k]
        steps = 1 + int(2.0 * math.hypot(one.x2 - one.x1, one.y2 - one.y1) / cell)
        for i in range(steps + 1):
            x = one.x1 + (one.x2 - one.x1) * i / steps
            y = one.y1 + (one.y2 - one.y1) * i / steps
            stamp_near(x, y, one, deviation, shape[0], field)


@kernel
def stamp_near(x: float, y: float, wall: Record, deviation: float, shape: Record, field: Integers) -> None:
    """Raise the cells within `FIELD_REACH` of a point on a wall by their distance to the wall."""
    rows, columns = field.shape
    row = int((y - shape.y0) / shape.cell)
    column = int((x - shape.x0) / shape.cell)
    reach = math.ceil(FIELD_REACH / shape.cell)
    for r in range(max(0, row - reach), min(rows, row + reach + 1)):
        for c in range(max(0, column - reach), min(columns, column + reach + 1)):
            away = distance_to(shape.x0 + (c + 0.5) * shape.cell, shape.y0 + (r + 0.5) * shape.cell, wall)
            value = int(255.0 * math.exp(-0.5 * away * away / (deviation * deviation)) + 0.5)
            if value > field[r, c]:
                field[r, c] = np.uint8(value)


@kernel
def distance_to(x: float, y: float, wall: Record) -> float:
    """Return the distance of a point from a wall, which is a record of `ENDS`, metres."""
    across = wall.x2 - wall.x1
    up = wall.y2 - wall.y1
    square = across * across + up * up
    along = ((x - wall.x1) * across + (y - wall.y1) * up) / square if square > 0.0 else 0.0
    along = min(1.0, max(0.0, along))
    return math.hypot(x - wall.x1 - along * across, y - wall.y1 - along * up)
