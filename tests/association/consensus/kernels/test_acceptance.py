"""A consensus set is reported in the map's own pieces, as the references say."""

from __future__ import annotations

import itertools
import time

import numpy as np
import pytest
from hypothesis import given, settings

from association.consensus.kernels import acceptance
from association.consensus.tuning import MAX_OTHERS, MOST_UNDER
from association.layout import ENDS, MATCH, SCAN_LINE, as_records
from association.tables import Lines
from registration.layout import Records

from ...kernels.drawn import GATES, SEEDS, SMALL, drawn, in_pieces, workspace_of
from ...records import estimate_of, sights_of
from ...reference import acceptance as twin
from ...reference.matching import match_scan
from ...scenes import context_of, index_of, local, pose, scan_of


def sent(ends: np.ndarray) -> Records:
    """Return the ends of segments as a read-only array, as those of a scan are."""
    records = as_records(ENDS, ends)
    records.flags.writeable = False
    return records


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


def test_a_segment_is_accepted_on_both_sides_of_a_doorway() -> None:
    """On the side where most of it lies, and what lies on the other side counts for its overlap."""
    walls = [[0.0, 0.0, 4.0, 0.0], [4.4, 0.0, 8.0, 0.0]]
    pairs, overlaps, rivals, _ = accepted_on(walls, [2.375, 0.0, 5.5, 0.0])
    assert (pairs.tolist(), rivals.tolist()) == ([[0, 0]], [1])
    assert overlaps[0] == pytest.approx((1.625 + 1.1) / 3.125)


@pytest.mark.parametrize(("step", "others"), [(0.05, [1]), (0.09, [])])
def test_a_segment_is_accepted_on_walls_that_are_nearly_one(step: float, others: list[int]) -> None:
    pairs, overlaps, rivals, _ = accepted_on([[0.0, 0.0, 4.0, 0.0], [4.0, step, 8.0, step]], [1.0, 0.0, 5.0, 0.0])
    assert (pairs.tolist(), rivals.tolist()) == ([[0, 0]], others)
    assert overlaps[0] == pytest.approx(1.0 if others else 0.75)


def test_segments_of_one_line_are_accepted_one_by_one() -> None:
    """Those of which half lies on the wall; the line decides whether they may bridge a doorway."""
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
    assert rivals.tolist() == [0, *range(2, 2 + MAX_OTHERS - 1)]
    assert starts.tolist() == [0, MAX_OTHERS]


@given(SEEDS)
@settings(max_examples=60, deadline=None)
def test_pieces_that_overlap_one_another(seed: int) -> None:
    """Of a long wall drawn in many pieces at random, some of them twice, some of them all along it."""
    rng = np.random.default_rng(seed)
    begins = np.round(rng.uniform(0.0, 30.0, 40), 1)
    lengths = np.where(rng.random(40) < 0.1, 12.0, np.round(rng.uniform(0.1, 3.0, 40), 1))
    ends = np.stack([begins, 0.0 * begins, begins + lengths, 0.0 * begins], axis=1)
    index = index_of(np.vstack([ends, ends[:5], np.array([[0.0, 0.0, 33.0, 0.0]])[: seed % 2]]))
    starts = rng.uniform(-1.0, 28.0, 30)
    segments = np.stack([starts, 0.0 * starts, starts + rng.uniform(0.1, 6.0, 30), 0.0 * starts], axis=1)
    lines = Lines(as_lines_of(segments), np.arange(30), 0.0)
    matches = np.zeros(30, MATCH)
    matches["wall"] = rng.integers(0, len(index.walls.rows), 30)
    at = local(index, pose())
    got = acceptance.accept_matches(matches, lines, sent(segments), estimate_of(at), index.walls.rows, index.pieces)
    expected = twin.accept_matches(matches["wall"], lines, segments, at, index.walls.rows, index.pieces)
    overlapping = [overlap > 0.0 for _, _, overlap, _ in expected]
    assert got[1][~np.array(overlapping)].tolist() == [0.0] * (30 - sum(overlapping))
    pairs, overlaps, rivals, rival_starts = got
    assert_pairs(pairs, overlaps, rivals, rival_starts, expected)


def as_lines_of(segments: np.ndarray) -> Records:
    """Return each segment as a scan line of its own."""
    lines = np.zeros(len(segments), SCAN_LINE)
    lines["length"] = np.hypot(*(segments[:, 2:] - segments[:, :2]).T)
    return lines


@pytest.mark.parametrize("jitter", [0.0, 1e-9])
def test_the_work_does_not_grow_with_the_product_of_pieces_and_segments(jitter: float) -> None:
    """Of 100,000 pieces on one another under 2,000 segments: looked at one by one they take 200 million steps."""
    rng = np.random.default_rng(0)
    index = index_of(np.array([1.0, 2.0, 6.0, 2.0]) + rng.normal(0.0, 1.0, (100_000, 4)) * jitter)
    assert len(index.walls.rows) == 1
    segments = np.tile([1.0, 2.0, 6.0, 2.0], (2_000, 1))
    lines, matches = Lines(as_lines_of(segments[:1]), np.zeros(2_000, np.int64), 0.5), np.zeros(1, MATCH)
    arguments = matches, lines, sent(segments), estimate_of(local(index, pose())), index.walls.rows, index.pieces
    began = time.thread_time()
    pairs, overlaps, _, starts = acceptance.accept_matches(*arguments)
    assert time.thread_time() - began < 2.0
    assert len(pairs) == 2_000
    assert overlaps.min() > 1.0 - 1e-6
    assert (np.diff(starts) == MAX_OTHERS).all()
    if not jitter:
        assert pairs[:, 1].tolist() == [0] * 2_000


def test_of_more_pieces_than_are_compared_the_overlap_is_right() -> None:
    cuts = np.arange(3 * MOST_UNDER + 1) * 0.01
    pieces = np.stack([cuts[:-1], 0.0 * cuts[1:], cuts[1:], 0.0 * cuts[1:]], axis=1)[np.arange(3 * MOST_UNDER) % 3 > 0]
    index, segments = index_of(pieces), np.array([[2.0, 0.0, 28.0, 0.0]])
    assert len(index.walls.rows) == 1
    matches, lines = np.zeros(1, MATCH), Lines(as_lines_of(segments), np.zeros(1, np.int64), 0.5)
    at = estimate_of(local(index, pose()))
    pairs, overlaps, rivals, _ = acceptance.accept_matches(
        matches, lines, sent(segments), at, index.walls.rows, index.pieces
    )
    assert overlaps[0] == pytest.approx(2.0 / 3.0, abs=1e-3)
    assert len(pairs) == 1
    assert len(rivals) == MAX_OTHERS


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
