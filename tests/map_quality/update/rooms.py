"""A hall and two rooms that look alike, with a cupboard in each; odometry connects the scans of a visit."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from linefix import LaserScan, scan_of
from map_quality import VisitScan
from registration import RigidTransform, Segments
from simulation import scan

from .hall import OUTLINE, PILLAR, SCANNER, box

ROOM: list[list[float]] = [[0, 0, 4, 0], [4, 0, 4, 2.5], [4, 2.5, 3, 2.5], [3, 2.5, 3, 5], [3, 5, 0, 5], [0, 5, 0, 0]]
CUPBOARD = box(1.6, 1.6, 2.2, 2.4)
FIRST, SECOND = (14.0, 0.0), (14.0, 7.0)  # where the rooms are
IN_HALL = [(4.5, 6.5), (1.5, 1.5), (6.0, 1.2), (9.5, 2.0), (10.5, 5.0)]
IN_ROOM = [(0.8, 0.8), (0.9, 2.6), (1.5, 4.2), (2.6, 1.0), (2.5, 3.2)]


def moved(things: Sequence[Sequence[float]], by: tuple[float, float]) -> list[list[float]]:
    """Return walls in another place."""
    return [[a + by[0], b + by[1], c + by[0], d + by[1]] for a, b, c, d in things]


def rooms(*, cupboards: Sequence[tuple[float, float]] = (FIRST, SECOND), pillar: bool = True) -> Segments:
    """Return the hall and the rooms, with cupboards in some."""
    walls = [*OUTLINE, *(PILLAR if pillar else []), *moved(ROOM, FIRST), *moved(ROOM, SECOND)]
    return Segments.from_array(np.array([*walls, *(side for at in cupboards for side in moved(CUPBOARD, at))]))


def places_in(room: tuple[float, float]) -> list[tuple[float, float]]:
    """Return places in a room."""
    return [(x + room[0], y + room[1]) for x, y in IN_ROOM]


def drive(walls: Segments, places: Sequence[tuple[float, float]], seed: int) -> list[tuple[RigidTransform, LaserScan]]:
    """Return the poses and the scans of a visit that comes by some places."""
    rng, out = np.random.default_rng(seed), []
    for x, y in places:
        at = RigidTransform(x + rng.uniform(-0.1, 0.1), y + rng.uniform(-0.1, 0.1), rng.uniform(-math.pi, math.pi))
        ranges = scan(walls, at, SCANNER, rng).ranges
        out.append((at, LaserScan(SCANNER.angle_min, SCANNER.angle_increment, ranges, 0.0, SCANNER.range_max)))
    return out


def with_odometry(
    taken: Sequence[tuple[RigidTransform, LaserScan]], name: str, jumps: dict[int, tuple[float, float]] | None = None
) -> list[VisitScan]:
    """Return the scans of a visit with odometry, which jumps by some metres before some scans."""
    begin, out, x, y = taken[0][0].inverse(), [], 0.0, 0.0
    for number, (at, laser) in enumerate(taken):
        dx, dy = (jumps or {}).get(number, (0.0, 0.0))
        x, y = x + dx, y + dy
        odometry = begin.compose(replace(at, x=at.x + x, y=at.y + y))
        out.append(VisitScan(scan_of(laser), name, odometry=odometry))
    return out
