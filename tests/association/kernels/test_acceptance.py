"""A consensus set is reported in the map's own pieces, as the twins say."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings

from association.kernels import acceptance
from association.layout import ENDS, MATCH, SCAN_LINE, as_records
from association.tables import Lines
from association.tuning import MAX_RIVALS
from registration.layout import Records

from ..records import estimate_of, sights_of
from ..reference import acceptance as twin
from ..reference.matching import match_scan
from ..scenes import context_of, index_of, local, pose, scan_of
from .drawn import GATES, SEEDS, SMALL, drawn, in_pieces, workspace_of


def sent(ends: np.ndarray) -> Records:
    """Return the ends of segments as those of a scan are, which nobody may write to."""
    records = as_records(ENDS, ends)
    records.flags.writeable = False
    return records


def test_union_length() -> None:
    lows, highs = np.array([3.0, 0.0, 0.5, 3.0, 9.0]), np.array([4.0, 2.0, 1.0, 5.0, 9.5])
    assert [acceptance.union_length(lows, highs, count) for count in range(6)] == [0.0, 1.0, 3.0, 3.0, 4.0, 4.5]


@given(SEEDS)
@settings(max_examples=100, deadline=None)
def test_union_length_of_many(seed: int) -> None:
    rng = np.random.default_rng(seed)
    lows = rng.integers(0, 40, 12).astype(float)
    highs = lows + rng.integers(0, 9, 12).astype(float)
    cells = {x for low, high in zip(lows, highs, strict=True) for x in range(int(low), int(high))}
    assert acceptance.union_length(lows, highs, 12) == len(cells)


@pytest.mark.parametrize(("bridging", "first"), [(True, 0), (False, 2)])
def test_first_wall(bridging: bool, first: int) -> None:
    index = index_of([[0.0, 0.0, 2.0, 0.0], [3.0, 0.0, 5.0, 0.0], [6.0, 0.0, 8.0, 0.0]])
    by_place = np.argsort(index.walls.rows["begin"])
    assert acceptance.first_wall(index.walls.rows, int(by_place[2]), bridging) == by_place[first]


@given(SEEDS)
@settings(max_examples=15, deadline=None)
def test_accept_matches(seed: int) -> None:
    """On a map whose walls were drawn in pieces, some of which overlap or come twice."""
    index = in_pieces(np.random.default_rng(seed))
    d = drawn(seed, radius=12.0, clutter=3, index=index)
    matches, _ = match_scan(d.scan, d.at, SMALL, index.tables.place, GATES)
    ends, walls = sent(d.endpoints.copy()), index.walls.rows
    lines = Lines(d.scan, d.row_of, 0.5)
    got = acceptance.accept_matches(matches, lines, ends, estimate_of(d.at), walls, index.pieces)
    expected = twin.accept_matches(matches["wall"], lines, d.endpoints, d.at, walls, index.pieces)
    assert_pairs(*got, expected)
    assert len(expected) > 0


def assert_pairs(
    pairs: np.ndarray, overlaps: np.ndarray, rivals: np.ndarray, starts: np.ndarray, expected: list[twin.Pair]
) -> None:
    assert pairs.tolist() == [[i, piece] for i, piece, _, _ in expected]
    np.testing.assert_allclose(overlaps, [overlap for _, _, overlap, _ in expected], atol=4e-4)
    assert [rivals[a:b].tolist() for a, b in itertools.pairwise(starts)] == [others for *_, others in expected]
    assert len(rivals) == starts[-1]


def accepted_on(walls: list[list[float]], *segments: list[float]) -> tuple[np.ndarray, ...]:
    """Accept segments of one line, in the frame of the map, as on the wall that its midpoint is nearest to."""
    index = index_of(walls)
    lines = context_of(index, scan_of(segments)).lines
    assert len(lines.rows) == 1
    matches, _ = match_scan(lines.rows, local(index, pose()), SMALL, index.tables.place, GATES)
    return acceptance.accept_matches(
        matches, Lines(lines.rows, lines.row_of, 0.5), sent(np.array(segments)),
        estimate_of(local(index, pose())), index.walls.rows, index.pieces,
    )  # fmt: skip


def test_only_long_segments_are_accepted_on_both_sides_of_a_doorway() -> None:
    walls = [[0.0, 0.0, 4.0, 0.0], [4.4, 0.0, 8.0, 0.0]]
    pairs, overlaps, rivals, _ = accepted_on(walls, [2.5, 0.0, 5.5, 0.0])  # 3 m: not long
    assert (pairs.tolist(), rivals.tolist()) == ([[0, 0]], [])
    assert overlaps[0] == pytest.approx(1.5 / 3.0)
    pairs, overlaps, rivals, _ = accepted_on(walls, [2.375, 0.0, 5.5, 0.0])
    assert (pairs.tolist(), rivals.tolist()) == ([[0, 0]], [1])
    assert overlaps[0] == pytest.approx((1.625 + 1.1) / 3.125)


def test_segments_of_one_line_are_accepted_one_by_one() -> None:
    """Those of which half lies on the wall; whether they may bridge a doorway is told by the line."""
    wall = [[0.0, 0.0, 4.0, 0.0]]
    on, beyond = [0.5, 0.0, 3.0, 0.0], [3.2, 0.0, 4.7, 0.0]
    pairs, overlaps, _, _ = accepted_on(wall, beyond, on)
    assert pairs.tolist() == [[0, 0], [1, 0]]
    assert overlaps.tolist() == pytest.approx([0.8 / 1.5, 1.0])
    beyond = [3.3, 0.0, 4.8, 0.0]
    pairs, overlaps, rivals, starts = accepted_on(wall, beyond, on)
    assert (pairs.tolist(), overlaps.tolist()) == ([[1, 0]], pytest.approx([1.0]))
    assert (rivals.tolist(), starts.tolist()) == ([], [0, 0])
    walls = [[0.0, 0.0, 4.0, 0.0], [4.4, 0.0, 8.0, 0.0]]
    pairs, overlaps, rivals, _ = accepted_on(walls, [2.0, 0.0, 3.5, 0.0], [3.5, 0.0, 5.1, 0.0])
    assert (pairs.tolist(), rivals.tolist()) == ([[0, 0], [1, 1]], [0])
    assert overlaps.tolist() == pytest.approx([1.0, (0.5 + 0.7) / 1.6])


def test_of_many_pieces_the_first_are_named() -> None:
    cuts = np.linspace(0.0, 6.0, 13).tolist()
    pieces = [[a, 0.0, b, 0.0] for a, b in itertools.pairwise(cuts)]
    pairs, overlaps, rivals, starts = accepted_on(pieces, [0.25, 0.0, 5.75, 0.0])
    assert pairs.tolist() == [[0, 1]]
    assert overlaps[0] == pytest.approx(1.0)
    assert rivals.tolist() == [0, *range(2, 2 + MAX_RIVALS - 1)]
    assert starts.tolist() == [0, MAX_RIVALS]


def test_nothing_matched_is_nothing_accepted() -> None:
    index, matches = index_of([[0.0, 0.0, 1.0, 0.0]]), np.zeros(2, MATCH)
    matches["wall"] = -1
    lines = Lines(np.zeros(2, SCAN_LINE), np.arange(2), 0.5)
    got = acceptance.accept_matches(
        matches, lines, sent(np.zeros((2, 4))), estimate_of(pose()), index.walls.rows, index.pieces
    )
    assert [len(array) for array in got] == [0, 0, 0, 1]


@given(SEEDS)
@settings(max_examples=20, deadline=None)
def test_missing_pieces(seed: int) -> None:
    rng = np.random.default_rng(seed)
    index = in_pieces(rng)
    d = drawn(seed, radius=8.0, clutter=0, index=index)
    matches = np.zeros(len(d.scan), MATCH)
    on_map = rng.random(len(d.scan)) < 0.8
    matches["wall"] = np.where(on_map, rng.integers(0, len(index.walls.rows), len(d.scan)), -1)
    viewpoint = rng.normal(size=2).tolist()
    sights, work = sights_of(d.scan, viewpoint), workspace_of(d.scan, index)
    got = acceptance.missing_pieces(sights, matches, estimate_of(d.at), index.tables.place, index.pieces, work)
    expected = twin.missing_pieces(d.scan, matches["wall"], viewpoint, d.at, index.walls.rows, index.pieces)
    assert sorted(got.tolist()) == expected
