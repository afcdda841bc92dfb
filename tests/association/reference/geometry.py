"""Lines, turns and lists of a grid, straight from what they mean."""

from __future__ import annotations

import math
from typing import Any, TypeAlias

import numpy as np

from association.tables import Grid
from registration import RigidTransform
from registration.layout import Floats, Record, Records

Vector: TypeAlias = Any  # two numbers

TURN = np.array([[0.0, -1.0], [1.0, 0.0]])  # by 90 degrees


def wrap(angle: float) -> float:
    return math.remainder(angle, math.tau)


def rotation(theta: float) -> Floats:
    return np.array([[math.cos(theta), -math.sin(theta)], [math.sin(theta), math.cos(theta)]])


def point(record: Record, x: str = "x", y: str = "y") -> Floats:
    """Return two fields of a record as a vector; of an array (n,) as (n, 2)."""
    return np.array((record[x], record[y])).T


def direction(record: Record) -> Floats:
    return point(record, "dx", "dy")


def normal(record: Record) -> Floats:
    """Return the left normal, (2,) or (n, 2)."""
    return np.asarray(direction(record) @ TURN.T)


def translation(pose: RigidTransform) -> Floats:
    return np.array([pose.x, pose.y])


def moved(pose: RigidTransform, by: Any) -> RigidTransform:
    """Add (theta, x, y) to a pose."""
    theta, x, y = np.asarray(by, dtype=float).tolist()
    return RigidTransform(pose.x + x, pose.y + y, pose.theta + theta)


def cell_of(shape: Records, at: Floats) -> int | None:
    """Return the number of the cell that a point lies in, None outside the grid."""
    grid = shape[0]
    column, row = (math.floor(v) for v in (at - point(grid, "x0", "y0")) / grid["cell"])
    inside = 0 <= column < grid["columns"] and 0 <= row < grid["rows"]
    return int(row * grid["columns"] + column) if inside else None


def listed(grid: Grid, at: Floats) -> list[int]:
    """Return what a grid lists at a point."""
    cell = cell_of(grid.shape, at)
    return [] if cell is None else [int(k) for k in grid.items[grid.starts[cell] : grid.starts[cell + 1]]]
