"""The generators of the comparison with peers give what they promise."""

from __future__ import annotations

import functools
import math

import numpy as np
import pytest

from benchmarks.peers.scenes import DRAWN_LEVELS, KINDS, SIZES, Cell, drawn_cell

cell_of = functools.cache(drawn_cell)  # drawn once for all tests that look at it
LONG = [pytest.mark.long]
CELLS = [
    pytest.param((kind, size, level), marks=LONG * (size == max(SIZES)), id=f"{kind}-{size}-{level.name}")
    for kind in KINDS
    for size in SIZES
    for level in DRAWN_LEVELS
]


@pytest.fixture(params=CELLS)
def drawn(request: pytest.FixtureRequest) -> tuple[Cell, tuple[str, int, object]]:
    kind, size, level = request.param
    return cell_of(kind, size, level, 3, seed=3), request.param


def test_counts_and_outliers_are_as_promised(drawn) -> None:
    cell, (_, _, level) = drawn
    for query in cell.queries:
        inliers, whole = int((query.on_map >= 0).sum()), len(query.scan)
        low, high = level.counts
        assert low - 1 <= (whole if level.whole else inliers) <= high + 1
        assert abs((whole - inliers) / whole - level.outliers) < 0.03


def test_the_truth_lays_every_inlier_on_its_segment_within_the_noise(drawn) -> None:
    cell, (_, _, level) = drawn
    for query in cell.queries:
        seen = query.pose.apply(query.scan.reshape(-1, 2)).reshape(-1, 4)
        for ends, wall in zip(seen[query.on_map >= 0], query.map[query.on_map[query.on_map >= 0]], strict=True):
            along = wall[2:] - wall[:2]
            length = math.hypot(*along)
            for end in ends.reshape(2, 2) - wall[:2]:
                across = (along[0] * end[1] - along[1] * end[0]) / length
                assert abs(across) < 5.0 * level.sigma
                assert -5.0 * level.sigma < end @ along / length < length + 5.0 * level.sigma
            assert (ends[2:] - ends[:2]) @ along > 0.0


def test_a_cell_is_drawn_again_from_its_seed_and_another_seed_gives_another() -> None:
    one, again, other = (drawn_cell("offices", 50, DRAWN_LEVELS[1], 3, seed) for seed in (5, 5, 6))
    assert all(np.array_equal(a.scan, b.scan) for a, b in zip(one.queries, again.queries, strict=True))
    assert not any(np.array_equal(a.scan, b.scan) for a, b in zip(one.queries, other.queries, strict=True))
