"""Twins of the kernels that list where chains cross."""

from __future__ import annotations

import itertools
import math

import numpy as np

from association.index.tuning import SWEEP_CELL
from association.tuning import CROSSING_ANGLES, MIN_CROSSING
from registration.layout import Floats, Record, Records

from .geometry import direction, normal

Rectangle = tuple[float, float, float, float]  # begin and end of a chain, begin and end of another


def extents(a: Record, b: Record) -> Rectangle:
    """Return where two chains begin and end, counted along each from where their lines cross."""
    point = np.linalg.solve(np.array((normal(a), normal(b))), [a["offset"], b["offset"]])
    on_a, on_b = direction(a) @ point, direction(b) @ point
    return a["begin"] - on_a, a["end"] - on_a, b["begin"] - on_b, b["end"] - on_b


def reach_to(a: Record, b: Record) -> float:
    """Return up to how far from the crossing one has to look to see something of both; inf at small angles."""
    if abs(direction(a) @ normal(b)) < MIN_CROSSING:
        return math.inf
    first, last, bottom, top = extents(a, b)
    return float(max(first, -last, bottom, -top))


def crossings_of(chains: Records, reach: float) -> set[tuple[int, int]]:
    """Return all pairs that cross within reach, the second to the left of the first."""
    return {
        (p, q)
        for p, q in itertools.permutations(range(len(chains)), 2)
        if normal(chains[p]) @ direction(chains[q]) > 0.0 and reach_to(chains[p], chains[q]) <= reach
    }


def angle_bin(a: Record, b: Record) -> int:
    """Return the bin of the angle from one chain to another on its left."""
    return int(math.acos(direction(a) @ direction(b)) / math.pi * CROSSING_ANGLES)


def cells_of(rectangle: Rectangle, reach: float) -> list[tuple[int, int]]:
    """Return the cells that a rectangle reaches into, of those up to `reach` either way."""
    most = math.ceil(2.0 * reach / SWEEP_CELL) - 1
    first, last, bottom, top = np.clip(np.floor((np.array(rectangle) + reach) / SWEEP_CELL), 0, most).astype(int)
    return list(itertools.product(range(first, last + 1), range(bottom, top + 1)))


def counts_of(chains: Records, reach: float) -> Floats:
    """Return how many crossings there are, and entries in all lists."""
    found = crossings_of(chains, reach)
    return np.array([len(found), sum(len(cells_of(extents(chains[p], chains[q]), reach)) for p, q in found)])


def extents_of_segments(a: Record, b: Record) -> tuple[float, float]:
    """Return where the midpoints of two scan segments lie, counted along each from where their lines cross."""
    turned = np.array((direction(a), -direction(b))).T
    on_a, on_b = np.linalg.solve(turned, [b["x"] - a["x"], b["y"] - a["y"]])
    return -float(on_a), -float(on_b)
