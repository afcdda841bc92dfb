"""A hall with a rack and a pillar, and visits to it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from linefix import LaserScan, scan_of
from map_quality import MapUpdate, VisitScan, finished, updating
from registration import RigidTransform, Segments
from simulation import Scanner, scan

Floats = NDArray[np.float64]

SCANNER = Scanner(beams=360, angle_increment=math.tau / 360, range_max=20.0, sigma=0.01)
PLACES = [(1.5, 1.5), (6.0, 1.2), (10.5, 2.0), (4.5, 6.5), (8.3, 6.8), (2.0, 4.4), (10.8, 5.5), (5.2, 3.0)]


def box(x0: float, y0: float, x1: float, y1: float) -> list[list[float]]:
    """Return a thing that is seen from outside."""
    return [[x0, y0, x0, y1], [x0, y1, x1, y1], [x1, y1, x1, y0], [x1, y0, x0, y0]]


OUTLINE = [
    [0, 0, 12, 0], [12, 0, 12, 5], [12, 5, 13, 5], [13, 5, 13, 6], [13, 6, 12, 6], [12, 6, 12, 8], [12, 8, 7, 8],
    [7, 8, 7, 9], [7, 9, 5.5, 9], [5.5, 9, 5.5, 8], [5.5, 8, 0, 8], [0, 8, 0, 0],
]  # fmt: skip
RACK = box(2.5, 2.2, 3.3, 3.8)
PILLAR = box(8.0, 3.0, 8.6, 3.6)


def segments(*things: Sequence[Sequence[float]]) -> Segments:
    """Return the hall with some things."""
    return Segments.from_array(np.array([*OUTLINE, *(side for thing in things for side in thing)], dtype=float))


def visit(
    walls: Segments | Callable[[int], Segments],
    name: str,
    seed: int,
    scanner: Scanner = SCANNER,
    change: Callable[[Floats], Floats] = lambda ranges: ranges,
) -> list[VisitScan]:
    """Take scans on a visit; `walls` may depend on the scan, and `change` changes its ranges."""
    rng, out = np.random.default_rng(seed), []
    for number, (x, y) in enumerate(PLACES):
        at = RigidTransform(x + rng.uniform(-0.2, 0.2), y + rng.uniform(-0.2, 0.2), rng.uniform(-math.pi, math.pi))
        seen = scan(walls(number) if callable(walls) else walls, at, scanner, rng)
        laser = LaserScan(scanner.angle_min, scanner.angle_increment, change(seen.ranges), 0.0, scanner.range_max)
        out.append(VisitScan(scan_of(laser), name))
    return out


def update(*asked: Any, **options: Any) -> MapUpdate:
    """Take all steps of `updating`."""
    return finished(updating(*asked, **options))


def told(update: MapUpdate) -> list[tuple[str, tuple[int, ...]]]:
    """Return code and segments of each change."""
    return [(str(one.code), one.segments) for one in update.changes]
