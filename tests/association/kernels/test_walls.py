"""Walls are merged and listed as their references do it."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings

from association.index.kernels import walls
from association.index.merging import collinear_groups, join_gates
from association.index.tuning import CHAIN_GAP, MOST_LOOKS
from association.layout import ENDS, GRID_SHAPE, POINT, as_records, record
from association.tuning import SECTORS
from registration import Segments
from registration.layout import Floats

from ..scenes import maze
from . import reference as twin
from .reference import SEEDS

SHAPE = record(GRID_SHAPE, x0=-7.3, y0=-9.1, cell=1.7, columns=27, rows=29)  # holds the maze and 6 m around it


def labels_of(ends: Floats, gap: float, lateral: float, angle: float) -> list[int]:
    directions = as_records(POINT, Segments.from_array(ends).directions)
    gates = join_gates(gap, lateral)._replace(least_cosine=math.cos(angle))
    return collinear_groups(as_records(ENDS, ends), directions, gates, None).tolist()


def continued(rng: np.random.Generator) -> Floats:
    """Draw pieces that go on from one another, with gaps, steps, turns and overlaps about what is allowed."""
    pieces: list[list[float]] = []
    for _ in range(12):
        x, y, angle = rng.uniform(-8.0, 8.0), rng.uniform(-8.0, 8.0), rng.uniform(-math.pi, math.pi)
        for _ in range(rng.integers(1, 6)):
            length = rng.uniform(0.2, 3.0)
            end = x + length * math.cos(angle), y + length * math.sin(angle)
            pieces.append([x, y, *end])
            gap, step = rng.uniform(-0.5, 0.5) * rng.choice([1.0, 6.0]), rng.uniform(-0.05, 0.05)
            x = end[0] + gap * math.cos(angle) - step * math.sin(angle)
            y = end[1] + gap * math.sin(angle) + step * math.cos(angle)
            angle += rng.uniform(-0.05, 0.05)
    return np.array(pieces)[rng.permutation(len(pieces))]


@given(SEEDS)
@settings(max_examples=30, deadline=None)
def test_collinear_groups(seed: int) -> None:
    ends = continued(np.random.default_rng(seed))
    assert labels_of(ends, 0.3, 0.03, 0.035) == twin.collinear_groups(ends, 0.3, 0.03, 0.035)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_long_chain_has_one_label(sign: float) -> None:
    """However the pieces are numbered, and across all cells."""
    x = np.linspace(-60.0, 60.0, 122)[:: int(sign)]
    chain = np.stack([x[:-1], 0.3 * x[:-1], x[1:], 0.3 * x[1:]], axis=1)
    for order in (np.arange(121), np.arange(121)[::-1], np.random.default_rng(0).permutation(121)):
        assert labels_of(chain[order], 0.3, 0.03, 0.035) == [0] * 121


def test_what_repeats_a_wall_is_of_it() -> None:
    """Sent twice, in pieces over the whole, and a long one over many cells."""
    whole, pieces = [0.0, 0.0, 40.0, 8.0], np.linspace(0.0, 1.0, 9)[:, None] * [40.0, 8.0]
    again = np.hstack([pieces[:-1], pieces[1:]])[::2]
    beside, across = [10.0, 2.1, 15.0, 3.1], [10.0, 2.0, 15.0, 3.1]
    for order in (np.arange(8), np.arange(8)[::-1]):
        ends = np.vstack([whole, whole, again, beside, across])
        labels = np.array(labels_of(ends[order], 0.3, 0.03, 0.035))[np.argsort(order)]
        assert len(set(labels[:6])) == 1
        assert len({labels[0], labels[6], labels[7]}) == 3


def test_a_wall_is_merged_however_many_others_are_about() -> None:
    """Only so many are compared with one piece; those near it, so that on no building there are more."""
    x = np.linspace(0.0, 5.7, 20)
    chain = np.stack([x, np.full(20, 3.0), x + 0.3, np.full(20, 3.0)], axis=1)
    rng = np.random.default_rng(0)
    begins, angles = rng.uniform(0.0, 6.0, (900, 2)), rng.uniform(0.5, 2.5, 900)
    others = np.hstack([begins, begins + np.stack([np.cos(angles), np.sin(angles)], axis=1)])
    for ends in (np.vstack([chain, others]), np.vstack([others, chain])):
        labels = np.array(labels_of(ends, CHAIN_GAP, 0.03, 0.035))
        assert len(set(labels[(ends[:, 1] == 3.0) & (ends[:, 3] == 3.0)])) == 1


def test_a_long_wall_sent_twice_is_one() -> None:
    """Beyond the places along it that are looked at its begin is."""
    wall, rng = [33.3, 77.7, 9000.0, 1000.0], np.random.default_rng(0)
    begins = rng.uniform(-9000.0, -10.0, (4000, 2))
    ends = np.vstack([wall, [33.3, 87.7, 9000.0, 1010.0], wall, np.hstack([begins, begins + np.array([0.0, 1.0])])])
    assert labels_of(ends, 0.3, 0.03, 0.035)[:3] == [0, 1, 0]


def test_one_piece_is_compared_with_so_many() -> None:
    """100,000 long walls in one place took minutes."""
    rng = np.random.default_rng(0)
    begins = rng.uniform(-0.1, 0.1, (2 * MOST_LOOKS, 2))
    ends = np.vstack(
        [[[-3.0, 0.0, 0.0, 0.0], [0.0, 0.0, 3.0, 0.0]], np.hstack([begins, begins + np.array([0.0, 5.0])])]
    )
    assert labels_of(ends, 0.3, 0.03, 0.035)[:2] == [0, 1]
    assert labels_of(ends[: MOST_LOOKS // 2], 0.3, 0.03, 0.035)[:2] == [0, 0]


def turned_maze(seed: int) -> Floats:
    """Return the maze turned by an angle, so that walls lie across cells, with one along each axis."""
    angle = np.random.default_rng(seed).uniform(-math.pi, math.pi)
    r = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
    inner = (maze(seed, 12, 10.0).reshape(-1, 2) - 5.0) @ r + 14.0
    return np.vstack([inner.reshape(-1, 4), [[0.0, 3.0, 20.0, 3.0], [5.0, 30.0, 5.0, 2.0]]])


@given(SEEDS)
@settings(max_examples=8, deadline=None)
def test_grid_cells(seed: int) -> None:
    """A wall is listed where it is near, and not farther than the diagonal of what its reach adds to a cell.

    The directions of a cell are those of the walls that it lists, whether it lists them or not.
    """
    ends, radius = turned_maze(seed), (0.02, 0.4, 2.0)[seed % 3]
    sectors = np.random.default_rng(seed).integers(0, SECTORS, len(ends)).astype(np.int32)
    starts, items, bits = walls.grid_cells(as_records(ENDS, ends), sectors, radius, SHAPE, True)
    assert walls.grid_cells(as_records(ENDS, ends), sectors, radius, SHAPE, False)[2].tolist() == bits.tolist()
    assert (starts[0], starts[-1]) == (0, len(items))
    distances = np.array([twin.distances_to_cells(end, SHAPE) for end in ends])
    for cell, (begin, end) in enumerate(itertools.pairwise(starts)):
        listed = items[begin:end].tolist()
        assert listed == sorted(set(listed))
        assert bits[cell] == sum({1 << int(sectors[i]) for i in listed})
        for i in range(len(ends)):
            assert i in listed or distances[i, cell] > radius - 1e-9
            assert i not in listed or distances[i, cell] < math.sqrt(2.0) * radius + 0.05
