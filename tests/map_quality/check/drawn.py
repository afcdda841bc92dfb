"""A floor drawn along the middle of its walls, the same with both faces, and scans of it."""

from __future__ import annotations

import math
from functools import cache

import numpy as np

from association import MapIndex, Scan
from benchmarks.worlds import free_place
from registration import RigidTransform, Segments
from registration.layout import Floats
from simulation import Scanner, scan
from vectorization import LaserScan, vectorize

THICK = 0.2  # m, of the walls
DEPTH, WIDTH, LENGTH, DOOR = 4.5, 2.0, 22.0, 1.0  # m; of rooms, of the corridor between them and of the doors


@cache
def centre_lines() -> Floats:
    """Return rooms of many widths on both sides of a corridor, each with a door, (n, 4)."""
    rng = np.random.default_rng(3)
    lines = [[0.0, 0.0, 0.0, WIDTH], [LENGTH, 0.0, LENGTH, WIDTH]]
    for near, far in ((0.0, -DEPTH), (WIDTH, WIDTH + DEPTH)):
        widths = rng.uniform(2.5, 6.0, 5)
        edges = np.concatenate([[0.0], np.cumsum(widths)]) * LENGTH / widths.sum()
        lines.append([0.0, far, LENGTH, far])
        lines += [[edge, near, edge, far] for edge in edges]
        doors = rng.uniform(edges[:-1] + 0.3, edges[1:] - 0.3 - DOOR)
        begins, ends = [0.0, *(doors + DOOR)], [*doors, LENGTH]
        lines += [[begin, near, end, near] for begin, end in zip(begins, ends, strict=True)]
    found = np.array(lines)
    turned = rng.random(len(found)) < 0.5
    found[turned] = found[turned][:, [2, 3, 0, 1]]
    return found


@cache
def faces() -> Floats:
    """Return all four sides of every wall, free space on the left, (n, 4)."""
    lines = centre_lines()
    d = lines[:, 2:] - lines[:, :2]
    d *= 0.5 * THICK / np.hypot(d[:, 0], d[:, 1])[:, None]
    n = np.stack([-d[:, 1], d[:, 0]], axis=1)
    begin, end = lines[:, :2] - d, lines[:, 2:] + d
    corners = np.stack([begin + n, end + n, end - n, begin - n], axis=1)
    return np.concatenate([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 4)


def reversed_ends(segments: Floats) -> Floats:
    return segments[:, [2, 3, 0, 1]]


def index_of(segments: Floats, sigma: float | None = None) -> MapIndex:
    return MapIndex.build(Segments.from_array(segments), sigma)


@cache
def sampled(count: int = 6) -> tuple[tuple[RigidTransform, Scan], ...]:
    """Return scans with their truth."""
    rng = np.random.default_rng(7)
    walls = Segments.from_array(faces())
    found = []
    scanner = Scanner(beams=720, angle_increment=math.tau / 720)
    for _ in range(count):
        truth = free_place(walls, rng)
        taken = scan(walls, truth, scanner, rng)
        seen = vectorize(LaserScan(scanner.angle_min, scanner.angle_increment, taken.ranges, 0.0, scanner.range_max))
        found.append((truth, Scan(seen.measured, (0.0, 0.0), seen.beams)))
    return tuple(found)


def two_faces(thickness: float) -> Floats:
    lines = Segments.from_array(centre_lines())
    return np.vstack([one.moved_left(0.5 * thickness).endpoints for one in (lines, lines.reversed())])
