"""Positions of the lines of a drawing relative to each other."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

AT_ONCE = 200  # lines that are compared with all others at a time; memory
PARALLEL = math.sin(math.radians(3.0))
MEETS = 0.05  # m; an end as near to another line meets it


def in_frame(points: Floats, origins: Floats, d: Floats) -> tuple[Floats, Floats]:
    """Return where n points lie along and to the left of k lines, ``(k, n)`` each, metres."""
    x = points[None, :, 0] - origins[:, None, 0]
    y = points[None, :, 1] - origins[:, None, 1]
    return d[:, :1] * x + d[:, 1:] * y, d[:, :1] * y - d[:, 1:] * x


def parallel_to(some: Floats, others: Floats) -> Flags:
    """Tell which of n directions are those of k lines, either way round, ``(k, n)``."""
    found: Flags = np.abs(some[:, :1] * others[None, :, 1] - some[:, 1:] * others[None, :, 0]) < PARALLEL
    return found
