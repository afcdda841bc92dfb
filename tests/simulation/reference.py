"""Slow, obviously right references of ``simulation/kernels/``."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from registration.layout import Floats


def cast(
    endpoints: Floats,
    x: float,
    y: float,
    start: float,
    increment: float,
    cosines: Floats,
    sines: Floats,
    one_sided: bool,
) -> tuple[Floats, NDArray[np.int64]]:
    """Intersect every beam with every segment: solve ``[x, y] + r d = begin + u (end - begin)``."""
    ranges = np.full(len(cosines), np.inf)
    hits = np.full(len(cosines), -1)
    for i, (dx, dy) in enumerate(zip(cosines, sines, strict=True)):
        best = np.inf
        for k, (bx, by, ex, ey) in enumerate(endpoints):
            left = (ex - bx) * (y - by) - (ey - by) * (x - bx)
            if left == 0 or (one_sided and left < 0):
                continue
            matrix = np.array([[dx, bx - ex], [dy, by - ey]])
            if np.linalg.det(matrix) == 0:
                continue
            r, u = np.linalg.solve(matrix, [bx - x, by - y])
            key = r if left > 0 else r * (1 + 1e-9)
            if r > 0 and -1e-10 <= u <= 1 + 1e-10 and key < best:
                best, ranges[i], hits[i] = key, r, k
    return ranges, hits
