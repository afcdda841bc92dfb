"""Walls are merged and listed as their references do it, and every wall stays findable, whatever the map is like."""

from __future__ import annotations

import math
import tracemalloc

import numpy as np
import pytest
from hypothesis import given, settings

from association import MapIndex
from association.index.merging import collinear_groups, ends_of, join_gates
from association.index.tuning import (
    CELL,
    CHAIN_GAP,
    LEAST_DIFFERENCE,
    MAX_CELLS,
    MAX_ENTRIES,
    MAX_SWEEP_CELLS,
    MERGE_LATERAL,
    MOST_LOOKS,
    SWEEP_CELL,
)
from association.layout import ENDS, POINT, as_records
from association.tables import Walls
from association.tuning import REACH, SECTORS
from registration import Segments
from registration.layout import Floats, Records, floats

from .kernels import reference as twin
from .kernels.reference import SEEDS
from .scenes import index_of, maze


def labels_of(ends: Floats, gap: float, lateral: float, angle: float) -> list[int]:
    directions = as_records(POINT, Segments.from_array(ends).directions)
    gates = join_gates(gap, lateral)._replace(least_cosine=math.cos(angle))
    labels: list[int] = collinear_groups(as_records(ENDS, ends), directions, gates, None).tolist()
    return labels


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


MAZE_INDEX = index_of(maze(1))


def cell_of(shape: Records, at: Floats) -> int | None:
    """Return the number of the cell that a point lies in, None outside the grid."""
    grid = shape[0]
    column, row = np.floor((at - np.array([grid["x0"], grid["y0"]])) / grid["cell"]).astype(int).tolist()
    inside = 0 <= column < grid["columns"] and 0 <= row < grid["rows"]
    return int(row * grid["columns"] + column) if inside else None


def lengths(walls: Walls) -> Floats:
    return np.asarray(np.subtract(*floats(walls.rows, "end", "begin")))


def test_collinear_pieces_become_one_wall() -> None:
    """Through all of them."""
    index = index_of([[0, 0, 2, 0], [2.1, 0.0, 4.1, 0.0], [4.1, 0.0, 5.1, 0.0], [0, 3, 5.1, 3]])
    first, other = (index.walls.rows[index.wall_of_piece[k]] for k in (0, 3))
    assert index.wall_of_piece[0] == index.wall_of_piece[1] == index.wall_of_piece[2] != index.wall_of_piece[3]
    assert (first["dx"], first["dy"], first["angle"]) == pytest.approx((1.0, 0.0, 0.0))
    begin, end = np.array([first["begin"], first["end"]]) + index.origin[0]
    assert (begin, end) == pytest.approx((0.0, 5.1))
    assert first["offset"] + index.origin[1] == pytest.approx(0.0)
    assert other["offset"] + index.origin[1] == pytest.approx(3.0)


@pytest.mark.parametrize(
    ("other", "why"),
    [
        ([2.6, 0, 4, 0], "a doorway between"),
        ([2.1, 0.2, 4, 0.2], "a step to the side"),
        ([2.1, 0, 4, 0.3], "another direction"),
        ([4, 0, 2.1, 0], "the opposite face"),
    ],
)
def test_what_does_not_continue_stays_apart(other: list[float], why: str) -> None:
    assert len(index_of([[0, 0, 2, 0], other]).walls.rows) == 2, why


@pytest.mark.parametrize("oriented", [True, False])
def test_pieces_may_make_a_wall_longer_than_a_segment_may_be(oriented: bool) -> None:
    """What is taken is limited so that numbers make sense; a wall of allowed pieces does."""
    rows = [[0, 0, 6e3, 0], [6e3, 0, 1.2e4, 0], [1.2e4, 0, 1.2e4, 9e3], [1.2e4, 9e3, 1.2e4, 1.8e4]]
    index = MapIndex.build(Segments.from_array(rows), oriented=oriented)
    np.testing.assert_allclose(np.unique(lengths(index.walls).round(6)), [1.2e4, 1.8e4])
    assert len(index.undirected.walls.rows) == 4


def test_a_slow_bend_is_not_straightened() -> None:
    """Twenty pieces, each within the merging angle of the last, turn by 30 degrees; a wall next to them stays."""
    turns = np.cumsum(np.full(20, math.radians(1.5)))
    corners = np.concatenate([[[0.0, 0.0]], np.cumsum(np.stack([np.cos(turns), np.sin(turns)], axis=1), axis=0)])
    straight = [[0.0, -5.0, 3.0, -5.0], [3.1, -5.0, 6.0, -5.0]]
    index = index_of(np.vstack([np.hstack([corners[:-1], corners[1:]]), straight]))
    assert len(index.walls.rows) == 21
    assert len(set(index.wall_of_piece.tolist())) == 21


def test_walls_name_their_neighbours_across_doorways() -> None:
    walls = [[0, 0, 3, 0], [4, 0, 6, 0], [7.2, 0.02, 9, 0.02], [12.1, 0, 13, 0], [6, 0.5, 4, 0.5]]
    index = index_of(walls)
    place = index.wall_of_piece
    rows = index.walls.rows[place]
    assert rows["before"].tolist() == [-1, place[0], place[1], -1, -1]
    assert rows["after"].tolist() == [place[1], place[2], -1, -1, -1]


def test_grid_lists_every_wall_within_reach() -> None:
    rows = MAZE_INDEX.walls.rows
    for at in np.random.default_rng(0).uniform(-14.0, 14.0, (400, 2)):
        along = rows["dx"] * at[0] + rows["dy"] * at[1]
        across = rows["dx"] * at[1] - rows["dy"] * at[0] - rows["offset"]
        beyond = np.maximum(0.0, np.maximum(rows["begin"] - along, along - rows["end"]))
        near = np.nonzero(np.hypot(across, beyond) <= REACH)[0]
        grid, cell = MAZE_INDEX.grid, cell_of(MAZE_INDEX.grid.shape, at)
        listed = [] if cell is None else grid.items[slice(*grid.starts[cell : cell + 2])].tolist()
        assert set(near.tolist()) <= set(listed)
        assert listed == sorted(set(listed))


def test_raster_has_the_directions_of_what_is_near() -> None:
    """Of walls and of chains, so that a doorway has the direction of its wall."""
    index = index_of([*maze(2)[:12], [40.0, 0.0, 43.0, 0.0], [44.4, 0.0, 48.0, 0.0]])
    ends = np.vstack([ends_of(index.walls), ends_of(index.chains)])
    angles = np.concatenate([index.walls.rows["angle"], index.chains.rows["angle"]])
    sectors = np.round((angles + math.pi) * SECTORS / math.tau).astype(int) % SECTORS
    for at in np.random.default_rng(0).uniform(-25.0, 25.0, (300, 2)):
        cell = cell_of(index.raster.shape, at)
        bits = 0 if cell is None else int(index.raster.bits[cell])
        for end, sector in zip(ends, sectors, strict=True):
            span, gap = end[2:] - end[:2], at - end[:2]
            nearest = end[:2] + np.clip(gap @ span / (span @ span), 0.0, 1.0) * span
            if np.hypot(*(at - nearest)) <= REACH + MERGE_LATERAL:
                assert bits >> sector & 1
    assert np.count_nonzero(index.raster.bits) < 0.8 * len(index.raster.bits), "it tells something"


def test_directions_are_sorted_longest_first() -> None:
    for walls in (index_of(maze(5)).walls, MAZE_INDEX.chains):
        count = len(walls.bin_starts) - 1
        bins = np.minimum(np.floor((walls.rows["angle"] + math.pi) / math.tau * count), count - 1)  # pi is in the last
        for b in range(count):
            inside = slice(walls.bin_starts[b], walls.bin_starts[b + 1])
            assert (np.diff(np.rint(walls.longest[inside] / LEAST_DIFFERENCE)) <= 0.0).all()
            assert (bins[inside] == b).all()
        assert walls.bin_starts[-1] == len(walls.rows)
        np.testing.assert_allclose(walls.longest, lengths(walls))
        np.testing.assert_allclose(walls.summed, [walls.longest[:k].sum() for k in range(len(walls.rows) + 1)])


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("oriented", [True, False])
def test_the_last_bits_of_equal_lengths_do_not_order_walls(seed: int, oriented: bool) -> None:
    """As from another processor: the same map, moved by fewer bits than lengths are rounded to."""
    rng = np.random.default_rng(seed)
    begins = np.array([[0.0, 3.0 * k] for k in range(8)])
    length, angle = 2.0 + rng.random(), rng.uniform(-math.pi, math.pi)
    ends = begins + np.array([length, 0.0])
    turn = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
    rows = np.hstack([begins @ turn, ends @ turn])
    moved = rows + 1e-13 * rng.standard_normal(rows.shape)
    one, other = (MapIndex.build(Segments.from_array(some), oriented=oriented) for some in (rows, moved))
    np.testing.assert_array_equal(one.wall_of_piece, other.wall_of_piece)
    for mine, its in ((one.walls, other.walls), (one.chains, other.chains)):
        np.testing.assert_allclose(mine.rows["offset"], its.rows["offset"], atol=1e-9)


def test_built_without_directions_it_is_its_own_undirected() -> None:
    segments = Segments.from_array(maze(1))
    index = MapIndex.build(segments, oriented=False)
    assert index.undirected is index
    assert np.array_equal(index.walls.rows, MapIndex.build(segments).undirected.walls.rows)
    assert (len(index.segments), index.directed) == (2 * len(segments), len(segments))
    turned = segments.endpoints[:, [2, 3, 0, 1]]
    assert np.array_equal(index.segments.endpoints, np.vstack([segments.endpoints, turned]))


def test_its_memory_is_known() -> None:
    """The size that a cache counts is right within a tenth."""
    ends = np.random.default_rng(0).uniform(0.0, 300.0, (20_000, 2))
    segments = np.hstack([ends, ends + 0.5])
    index_of(segments)
    tracemalloc.start()
    index = index_of(segments)
    held, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert index.nbytes == pytest.approx(held, rel=0.1)


def test_memory_is_capped_however_long_the_walls_are() -> None:
    rng = np.random.default_rng(0)
    along, none, far = rng.uniform(0, 400, (5000, 2)), np.zeros(5000), np.full(5000, 9990.0)
    index = index_of(np.column_stack([none, along[:, 0], far, along[:, 1]]))
    assert index.nbytes < 100e6
    assert len(index.grid.items) < 1.5 * MAX_ENTRIES


def test_memory_is_capped_whatever_the_extent() -> None:
    index = index_of([[0, 0, 1, 0], [99_000, 99_000, 99_001, 99_000]])
    for grid, size, most in ((index.grid, CELL, MAX_CELLS), (index.sweep.sectors, SWEEP_CELL, MAX_SWEEP_CELLS)):
        shape = grid.shape[0]
        assert shape["cell"] > size
        assert shape["columns"] * shape["rows"] < 1.01 * most
        ends = np.stack([index.pieces.ends["x1"], index.pieces.ends["y1"]], axis=1)
        assert all(cell_of(grid.shape, end) is not None for end in ends)
