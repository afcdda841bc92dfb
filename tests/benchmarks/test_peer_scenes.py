"""The generators of the comparison with peers give what they promise."""

from __future__ import annotations

import functools
import math

import numpy as np
import pytest

from benchmarks.peers.scenes import DRAWN_LEVELS, GUESS, KINDS, SHORTEST, SIZES, Cell, drawn_cell, polygons

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


def test_a_map_has_about_the_wanted_size(drawn) -> None:
    cell, (kind, size, _) = drawn
    for query in cell.queries:
        assert len(query.map) == size if kind == "polygons" else abs(len(query.map) - size) <= 0.2 * size


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


def test_inliers_are_cut_to_the_promised_share(drawn) -> None:
    cell, (_, _, level) = drawn
    low, high = level.cut or (1.0, 1.0)
    for query in cell.queries:
        on = query.on_map >= 0
        lengths = np.hypot(*(query.scan[on, 2:] - query.scan[on, :2]).T)
        walls = query.map[query.on_map[on]]
        whole = np.hypot(*(walls[:, 2:] - walls[:, :2]).T)
        assert (lengths > low * whole - 7.0 * level.sigma).all()
        assert (lengths < high * whole + 7.0 * level.sigma).all()
        assert (lengths > SHORTEST - 7.0 * level.sigma).all()
        assert len(set(query.on_map[on])) == on.sum()


def test_the_guess_is_as_far_off_as_promised(drawn) -> None:
    cell, _ = drawn
    for query in cell.queries:
        assert math.hypot(query.guess.x - query.pose.x, query.guess.y - query.pose.y) == pytest.approx(GUESS[0])
        assert abs(math.remainder(query.guess.theta - query.pose.theta, math.tau)) == pytest.approx(
            math.radians(GUESS[1])
        )


def test_a_cell_is_drawn_again_from_its_seed_and_another_seed_gives_another() -> None:
    one, again, other = (drawn_cell("offices", 50, DRAWN_LEVELS[1], 3, seed) for seed in (5, 5, 6))
    assert all(np.array_equal(a.scan, b.scan) for a, b in zip(one.queries, again.queries, strict=True))
    assert not any(np.array_equal(a.scan, b.scan) for a, b in zip(one.queries, other.queries, strict=True))


@pytest.mark.parametrize("size", [3, 9, 50, 201])
def test_polygons_are_closed_stand_free_and_have_free_space_outside(size: int) -> None:
    walls = polygons(size, np.random.default_rng(size))
    assert len(walls) == size
    starts, ends = walls[:, :2], walls[:, 2:]
    rings, first = [], 0
    for k in range(size):
        if np.allclose(ends[k], starts[first]):
            rings.append(walls[first : k + 1])
            first = k + 1
        else:
            assert np.allclose(ends[k], starts[k + 1])
    assert first == size
    for ring in rings:
        assert 3 <= len(ring) <= 8
        assert np.sum(ring[:, 0] * ring[:, 3] - ring[:, 2] * ring[:, 1]) < 0.0  # clockwise
    middles = [ring[:, :2].mean(axis=0) for ring in rings]
    radii = [np.hypot(*(ring[:, :2] - m).T).max() for ring, m in zip(rings, middles, strict=True)]
    gaps = [
        np.min(np.hypot(*(a[:, None, :2] - b[None, :, :2]).reshape(-1, 2).T))
        for i, a in enumerate(rings)
        for b in rings[:i]
    ]
    assert all(gap > 0.0 for gap in gaps)
    assert max(radii) < 4.0
