"""The map index keeps every wall findable, whatever the map is like."""

import math
import time
import tracemalloc

import numpy as np
import pytest
from association._match_kernels import REACH, SECTORS

from association import InvalidMapError, MapIndex
from registration import Segments

from .scenes import ROOM, maze


def index_of(endpoints, sigma=0.0):
    return MapIndex.build(Segments.from_array(endpoints), sigma)


def lengths(index):
    return index.walls.rows[:, 4] - index.walls.rows[:, 3]


def test_collinear_pieces_become_one_wall():
    index = index_of([[0, 0, 2, 0], [2.1, 0.01, 4, 0.01], [4.0, 0.0, 5, 0.0], [0, 3, 5, 3]])
    assert sorted(np.round(lengths(index), 3)) == [5.0, 5.0]
    assert index.wall_of_piece[0] == index.wall_of_piece[1] == index.wall_of_piece[2] != index.wall_of_piece[3]


@pytest.mark.parametrize(
    ("other", "why"),
    [
        ([2.6, 0, 4, 0], "a doorway between"),
        ([2.1, 0.2, 4, 0.2], "a step to the side"),
        ([2.1, 0, 4, 0.3], "another direction"),
        ([4, 0, 2.1, 0], "the opposite face"),
    ],
)
def test_what_does_not_continue_stays_apart(other, why):
    assert len(index_of([[0, 0, 2, 0], other]).walls.rows) == 2, why


def test_a_slow_bend_is_not_straightened():
    """Twenty pieces, each within the merging angle of the last, turn by 30 degrees together."""
    turns = np.cumsum(np.full(20, math.radians(1.5)))
    corners = np.concatenate([[[0.0, 0.0]], np.cumsum(np.stack([np.cos(turns), np.sin(turns)], axis=1), axis=0)])
    index = index_of(np.hstack([corners[:-1], corners[1:]]))
    assert len(index.walls.rows) == 20


def test_grid_lists_every_wall_within_reach():
    index = index_of(maze(3))
    rng = np.random.default_rng(0)
    x0, y0, cell, columns, _ = index.grid.shape
    rows = index.walls.rows
    for point in rng.uniform(-14.0, 14.0, (400, 2)):
        c = int((point[1] - y0) / cell) * int(columns) + int((point[0] - x0) / cell)
        listed = set(index.grid.items[index.grid.starts[c] : index.grid.starts[c + 1]].tolist())
        along = rows[:, 0] * point[0] + rows[:, 1] * point[1]
        across = rows[:, 0] * point[1] - rows[:, 1] * point[0] - rows[:, 2]
        beyond = np.maximum(0.0, np.maximum(rows[:, 3] - along, along - rows[:, 4]))
        near = np.nonzero(np.hypot(across, beyond) <= REACH)[0]
        assert set(near.tolist()) <= listed


def test_directions_are_sorted_longest_first():
    index = index_of(maze(5))
    walls = index.walls
    for b in range(len(walls.bin_starts) - 1):
        inside = walls.longest[walls.bin_starts[b] : walls.bin_starts[b + 1]]
        assert (np.diff(inside) <= 0.0).all()
    assert walls.bin_starts[-1] == len(walls.rows)
    np.testing.assert_allclose(walls.summed[-1], lengths(index).sum())


def test_far_from_the_origin_nothing_is_lost():
    near, far = index_of(ROOM), index_of(ROOM + 5e6)
    np.testing.assert_allclose(far.walls.rows, near.walls.rows, atol=1e-8)


def test_built_without_directions_it_is_its_own_undirected():
    segments = Segments.from_array(maze(1))
    index = MapIndex.build(segments, oriented=False)
    assert index.undirected is index
    assert np.array_equal(index.walls.rows, MapIndex.build(segments).undirected.walls.rows)
    assert (len(index.segments), index.directed) == (2 * len(segments), len(segments))


def test_the_sweep_lists_the_sector_of_every_run():
    index = index_of(maze(1))
    runs, sectors = np.divmod(index.sectors.items, SECTORS)
    angles = index.runs.rows[runs, 5]
    off = (angles + math.pi - sectors * math.tau / SECTORS) % math.tau
    assert set(runs) == set(range(len(index.runs.rows)))
    assert np.minimum(off, math.tau - off).max() <= math.pi / SECTORS + 1e-9


def test_its_memory_is_known():
    """What a cache counts is what is held, within a tenth."""
    ends = np.random.default_rng(0).uniform(0.0, 300.0, (20_000, 2))
    segments = np.hstack([ends, ends + 0.5])
    index_of(segments)
    tracemalloc.start()
    index = index_of(segments)
    held, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert index.nbytes == pytest.approx(held, rel=0.1)


def test_memory_is_capped_however_long_the_walls_are():
    rng = np.random.default_rng(0)
    walls = np.column_stack(
        [np.zeros(5000), rng.uniform(0, 400, 5000), np.full(5000, 9990.0), rng.uniform(0, 400, 5000)]
    )
    index = index_of(walls)
    assert index.nbytes < 100e6
    assert len(index.grid.items) < 15e6


def test_a_heap_of_equal_pieces_is_indexed_in_bounded_time():
    """Where thousands begin in one place a look at all others would go with the square of their number."""
    begun = time.monotonic()
    index_of(np.tile(ROOM, (5000, 1)))
    assert time.monotonic() - begun < 10.0  # by the square: more than a minute


def test_memory_is_capped_whatever_the_extent():
    index = index_of([[0, 0, 1, 0], [99_000, 99_000, 99_001, 99_000]])
    assert index.grid.starts.nbytes < 100e6


@pytest.mark.parametrize(
    ("endpoints", "sigma", "argument"),
    [
        (np.zeros((0, 4)), 0.0, "map.segments"),
        ([[0, 0, 1, 0], [2e5, 0, 2e5 + 1, 0]], 0.0, "map.segments"),
        (ROOM, -1.0, "map.sigma"),
        (ROOM, math.nan, "map.sigma"),
    ],
)
def test_refusals(endpoints, sigma, argument):
    with pytest.raises(InvalidMapError) as refused:
        index_of(endpoints, sigma)
    assert refused.value.argument == argument
