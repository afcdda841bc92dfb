"""One wall is one piece of evidence: into however many pieces it is cut, and however often it is sent."""

from __future__ import annotations

import itertools
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import ArrayLike

from association import AssociationResult, MapIndex, Scan, Status, View, assemble
from examples.building import draw_cases
from registration import MeasuredSegments, RigidTransform, Segments
from registration.layout import Floats
from vectorization import LaserScan, vectorize

from .scenes import (
    CORRIDOR,
    INSIDE,
    ROOM,
    answer_of,
    equal_rooms,
    index_of,
    maze,
    pose,
    pose_in,
    same_pose,
    scan_of,
    seen,
)

MOST_PIECES = 16
PROBABILITY = 0.01  # by so much the chance may move where points are not spread as those of the whole
COVARIANCE = 0.05  # and the covariance, in any direction

# The room and the scan of two of its walls that make no sure answer.
LOBBY = np.array([[0, 0, 8, 0], [8, 0, 8, 3], [8, 3, 5, 3], [5, 3, 5, 6], [5, 6, 0, 6], [0, 6, 0, 0]], dtype=float)
CORNER = np.array([[-3, -1, 4.5, -1], [4.5, -1, 4.5, 1.5]])

# The same room twice, a wall of the second being 10 cm off.
UNLIKE_ROOMS = equal_rooms(2)
UNLIKE_ROOMS[12, [1, 3]] += 0.1

SEEDS = st.integers(0, 10**6)


def in_pieces(rng: np.random.Generator, ends: Floats) -> Floats:
    """Cut up a segment into 2 to 16 pieces."""
    cuts = np.unique([0.0, *rng.random(rng.integers(1, MOST_PIECES)).round(4), 1.0])  # none too short to be sent
    a, d = ends[:2], ends[2:] - ends[:2]
    return np.array([np.concatenate([a + s * d, a + t * d]) for s, t in itertools.pairwise(cuts.tolist())])


def otherwise(rng: np.random.Generator, ends: ArrayLike) -> Floats:
    """Send the same segments otherwise: each as it is, in pieces, twice, or both; in any order."""
    out = []
    for one in np.asarray(ends, dtype=float):
        kind = rng.integers(4)
        out += [one[None]] * (0, 1, 2, 1)[kind] + [in_pieces(rng, one)] * (1, 0, 0, 1)[kind]
    pieces = np.vstack(out)
    return pieces[rng.permutation(len(pieces))]


def twice_or_in_pieces(rng: np.random.Generator, ends: ArrayLike) -> Floats:
    """Send the same segments otherwise: each as it is, in pieces, or twice; in any order."""
    pieces = np.vstack(
        [
            in_pieces(rng, one) if rng.random() < 0.5 else np.repeat(one[None], rng.integers(1, 3), axis=0)
            for one in np.asarray(ends, dtype=float)
        ]
    )
    return pieces[rng.permutation(len(pieces))]


def assert_same(one: AssociationResult, other: AssociationResult) -> None:
    """Compare answers that differ by rounding alone, which also tells which of equal explanations comes first."""
    assert (other.status, other.usable) == (one.status, one.usable)
    assert other.probability == pytest.approx(one.probability, abs=PROBABILITY)
    assert_same_place(one, other)


def assert_same_place(one: AssociationResult, other: AssociationResult) -> None:
    """Compare the numbers of the best explanation alone."""
    assert (other.pose is None) == (one.pose is None)
    assert (other.diagnostics is None) == (one.diagnostics is None)
    if one.diagnostics is not None and other.diagnostics is not None:
        assert other.diagnostics.score == pytest.approx(one.diagnostics.score, abs=1e-5)
        assert other.diagnostics.inlier_fraction == pytest.approx(one.diagnostics.inlier_fraction, abs=1e-9)
        if one.diagnostics.margin is None or one.diagnostics.margin > 1e-5:
            assert same_pose(pose_in(one), pose_in(other), 1e-6, 1e-7)
            if one.covariance is not None and other.covariance is not None:
                assert_covariances(one, other, 1e-5)


def assert_covariances(one: AssociationResult, other: AssociationResult, share: float) -> None:
    """Compare the variances along all directions."""
    assert (other.covariance is None) == (one.covariance is None)
    if one.covariance is not None and other.covariance is not None:
        ratios = np.linalg.eigvals(np.linalg.solve(one.covariance, other.covariance)).real
        np.testing.assert_allclose(ratios, 1.0, atol=share)


def assert_hardly_moved(one: AssociationResult, other: AssociationResult) -> None:
    """Compare answers to what is not quite the same."""
    assert other.probability == pytest.approx(one.probability, abs=PROBABILITY)
    assert_covariances(one, other, COVARIANCE)


def view_of(seed: int) -> tuple[Floats, Floats]:
    """Draw a map and a scan of it among clutter: of a room, of one of two, of a corridor, of a maze."""
    rng = np.random.default_rng(seed)
    kind = seed % 5
    clutter = int(rng.integers(0, 5))
    if kind == 0:
        return ROOM, seen(ROOM, INSIDE, noise=0.02, cut=0.5, clutter=clutter, seed=seed)[0]
    if kind == 1:
        return UNLIKE_ROOMS, seen(ROOM, INSIDE, noise=0.02, cut=0.5, clutter=clutter, seed=seed)[0]
    if kind == 2:
        return CORRIDOR, seen(CORRIDOR, pose(4.0, 0.8, 0.05), noise=0.01, cut=0.5, seed=seed)[0]
    at = RigidTransform(float(rng.uniform(10.0, 20.0)), float(rng.uniform(10.0, 20.0)), float(rng.uniform(-3.0, 3.0)))
    return maze(1), seen(maze(1), at, noise=0.02, cut=0.5, clutter=clutter, seed=seed, radius=7.0)[0]


@cache
def building() -> tuple[MapIndex, tuple[Scan, ...]]:
    """Return the demo's building, and its four scans as segments whose points are spread evenly."""
    walls, cases = draw_cases()
    scans = []
    for case in cases:
        angles = case.scan.angles
        laser = LaserScan(float(angles[0]), float(angles[1] - angles[0]), case.scan.ranges)
        measured = vectorize(laser).measured
        even = MeasuredSegments.from_segments(measured.segments, measured.sigma, measured.point_counts)
        scans.append(Scan(even, (0.0, 0.0)))
    return MapIndex.build(walls), tuple(scans)


def cut_evenly(rng: np.random.Generator, scan: Scan) -> Scan:
    """Cut segments into equal pieces, with their share of the points, or send them twice."""
    ends, sigma, points = [], [], []
    measured = scan.measured
    for one, s, n in zip(measured.segments.endpoints, measured.sigma, measured.point_counts, strict=True):
        count, again = int(rng.integers(1, min(MOST_PIECES, int(n)) + 1)), int(rng.integers(1, 3))
        shares = np.linspace(0.0, 1.0, count + 1)
        pieces = [(one[:2] + t * (one[2:] - one[:2])) for t in shares]
        ends += [np.concatenate(pair) for pair in itertools.pairwise(pieces)] * again
        sigma += [s] * count * again
        points += [n / count] * count * again
    order = rng.permutation(len(ends))
    segments = Segments.from_array(np.array(ends)[order])
    return Scan(
        MeasuredSegments.from_segments(segments, np.array(sigma)[order], np.array(points)[order]), scan.viewpoint
    )


@pytest.mark.parametrize("sent", [np.repeat(CORNER, 5, axis=0), np.vstack([np.linspace(0.0, 1.0, 5)] * 4)])
def test_two_walls_are_two_walls(sent: Floats) -> None:
    """Cut in four or sent five times, what proves nothing does not become sure."""
    if len(sent) != 10:
        cuts = sent[0]
        sent = np.vstack(
            [
                [[*(a + s * (b - a)), *(a + t * (b - a))] for s, t in itertools.pairwise(cuts)]
                for a, b in CORNER.reshape(-1, 2, 2)
            ]
        )
    index = index_of(LOBBY)
    one, other = (answer_of(index, scan_of(ends)) for ends in (CORNER, sent))
    assert_same(one, other)
    assert one.diagnostics is not None
    assert other.diagnostics is not None
    assert other.diagnostics.significance == pytest.approx(one.diagnostics.significance)
    assert not other.usable


def test_pieces_do_not_tell_a_room_from_its_twin() -> None:
    """Of two such rooms the true one is drawn 5 cm wrong; the map is known to be off by 3 cm."""
    wrong = LOBBY.copy()
    wrong[1, [0, 2]] += 0.05
    wrong[2, 0] += 0.05
    wrong[0, 2] += 0.05
    index = index_of(np.vstack([wrong, LOBBY + np.tile([20.0, 0.0], 2)]), 0.03)
    ends = seen(LOBBY, pose(3.0, 1.5, 0.4), cut=0.3, seed=1)[0]
    eight = [
        [np.concatenate([a + k / 8 * (b - a), a + (k + 1) / 8 * (b - a)]) for k in range(8)]
        for a, b in ends.reshape(-1, 2, 2)
    ]
    one, other = (answer_of(index, scan_of(sent)) for sent in (ends, np.vstack(eight)))
    assert one.status is Status.AMBIGUOUS
    assert_same(one, other)


@given(SEEDS)
@settings(max_examples=40, deadline=None)
def test_how_a_scan_is_cut_or_repeated_does_not_matter(seed: int) -> None:
    walls, ends = view_of(seed)
    index = index_of(walls)
    assert_same(
        answer_of(index, scan_of(ends)), answer_of(index, scan_of(otherwise(np.random.default_rng(seed), ends)))
    )


@given(SEEDS)
@settings(max_examples=15, deadline=None)
def test_with_lines_of_sight_it_does_not_matter_either(seed: int) -> None:
    """Rays go to the lines, not to their pieces."""
    rng = np.random.default_rng(seed)
    index = index_of(np.vstack([ROOM, [[4.5, 0.5, 4.5, 3.5]]]), float(rng.choice([0.0, 0.03])))
    ends = seen(ROOM, INSIDE, noise=0.02, cut=0.3, seed=seed)[0]
    sent = otherwise(rng, ends)
    assert_same(*(answer_of(index, scan_of(one, viewpoint=(0.0, 0.0))) for one in (ends, sent)))


@given(SEEDS)
@settings(max_examples=40, deadline=None)
def test_how_a_map_is_cut_does_not_matter(seed: int) -> None:
    walls, ends = view_of(seed)
    scan, rng = scan_of(ends), np.random.default_rng(seed)
    pieces = np.vstack([in_pieces(rng, one) for one in walls])
    other = pieces[rng.permutation(len(pieces))]
    assert_same(answer_of(index_of(walls), scan), answer_of(index_of(other), scan))


@given(SEEDS)
@settings(max_examples=40, deadline=None)
def test_how_often_walls_are_drawn_does_not_move_the_answer(seed: int) -> None:
    """Neither where it lies, nor its score nor its covariance."""
    walls, ends = view_of(seed)
    other = otherwise(np.random.default_rng(seed), walls)
    assert_same_place(answer_of(index_of(walls), scan_of(ends)), answer_of(index_of(other), scan_of(ends)))


@pytest.mark.parametrize("seed", [0, 1, 2, 3, 4, 2201, 303])
def test_how_often_walls_are_drawn_does_not_move_the_verdict(seed: int) -> None:
    """Listed twice, in pieces, or both."""
    walls, ends = view_of(seed)
    scan = scan_of(ends)
    one = answer_of(index_of(walls), scan)
    rng = np.random.default_rng(seed)
    for other in (np.vstack([walls, walls]), twice_or_in_pieces(rng, walls), otherwise(rng, walls)):
        assert_same(one, answer_of(index_of(other), scan))


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("place", range(4))
def test_how_a_building_is_cut_does_not_matter(place: int, seed: int) -> None:
    """For scans of three of its places, and of another building."""
    index, scans = building()
    pieces = [in_pieces(np.random.default_rng(seed), one) for one in index.segments.endpoints]
    walls = MapIndex.build(Segments.from_array(np.vstack(pieces)))
    assert_same(answer_of(index, scans[place]), answer_of(walls, scans[place]))


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("place", range(4))
def test_how_a_scan_of_a_building_is_cut_does_not_matter(place: int, seed: int) -> None:
    index, scans = building()
    other = cut_evenly(np.random.default_rng(seed), scans[place])
    assert_same(answer_of(index, scans[place]), answer_of(index, other))


def corner_with(*along: list[float]) -> Scan:
    """Return a scan of ROOM from its corner, with these of the wall along x."""
    return scan_of([*along, [9.0, 0.2, 9.0, 3.8], [9.0, 4.0, 5.2, 4.0], [5.0, 4.2, 5.0, 6.8]])


def test_a_piece_that_is_sent_twice_counts_once() -> None:
    """It does not draw the mean of the wall's points to itself, nor narrow their spread."""
    whole, half, rest = [0.5, 0.0, 8.5, 0.0], [0.5, 0.0, 4.5, 0.0], [4.5, 0.0, 8.5, 0.0]
    index = index_of(ROOM)
    assert_hardly_moved(answer_of(index, corner_with(whole)), answer_of(index, corner_with(half, half, rest)))


def test_which_segments_are_one_line_does_not_hang_on_the_longest() -> None:
    """A wall in two segments that differ by 1.5 degrees, the longer of them in four pieces."""
    first, second = [0.0, 0.0, 4.0, 0.0], [4.1, 0.0, 6.0, 0.05]
    pieces = [[float(k), 0.0, k + 1.0, 0.0] for k in range(4)]
    index = index_of(ROOM)
    one, other = (answer_of(index, corner_with(*some, second)) for some in ([first], pieces))
    assert one.diagnostics is not None
    assert other.diagnostics is not None
    assert other.diagnostics.score == pytest.approx(one.diagnostics.score, abs=0.1)
    assert_hardly_moved(one, other)


def test_a_wall_that_is_drawn_whole_and_in_pieces_is_one_wall() -> None:
    """Two lines of the scan lie on it; rounding must not lay each on another copy."""
    scan = scan_of([[1.0, 0.01, 3.0, 0.01], [5.0, 0.02, 8.0, 0.02], *ROOM[[1, 2, 3]].tolist()])
    for seed in (36, 75, 130):  # where rounding does so
        split, turn = np.random.default_rng(seed).random(2)
        split *= 9.0
        by = RigidTransform(3.0, 4.0, -3.0 + 6.0 * float(turn))
        again = np.vstack([ROOM, [[0.0, 0.0, split, 0.0], [split, 0.0, 9.0, 0.0]]])
        one, other = (answer_of(index_of(by.apply(m.reshape(-1, 2, 2)).reshape(-1, 4)), scan) for m in (ROOM, again))
        assert_same(one, other)


@pytest.mark.parametrize("on_map", [True, False])
def test_a_reversed_copy_is_no_second_witness_where_directions_mean_nothing(on_map: bool) -> None:
    """The map states it, or the options do."""
    index = MapIndex.build(Segments.from_array(LOBBY), oriented=not on_map)
    corner = seen(LOBBY, pose(3.0, 1.0, 0.4), noise=0.01, cut=0.6, seed=5)[0][:3]
    copies = np.vstack([corner, corner[:2, [2, 3, 0, 1]]])
    one, other = (answer_of(index, scan_of(ends, 0.01, (0.0, 0.0)), oriented=on_map) for ends in (corner, copies))
    assert_same(one, other)
    assert len(other.correspondences) == len(one.correspondences) + 2


def test_a_reversed_segment_is_another_side_where_directions_mean_something() -> None:
    index = index_of(np.vstack([LOBBY, LOBBY[:2, [2, 3, 0, 1]]]))
    there_and_back = np.vstack([CORNER, CORNER[:, [2, 3, 0, 1]]])
    one, other = (answer_of(index, scan_of(ends)) for ends in (CORNER, there_and_back))
    assert one.diagnostics is not None
    assert other.diagnostics is not None
    assert other.diagnostics.score > one.diagnostics.score + 5.0


@pytest.mark.parametrize("copies", [2, 3])
@pytest.mark.parametrize("seed", range(6))
def test_a_view_that_is_sent_again_changes_nothing(seed: int, copies: int) -> None:
    """Its segments are seen once, and its lines of sight pass through walls once."""
    walls, ends = view_of(seed)
    index, view = index_of(walls), View(scan_of(ends, viewpoint=(0.0, 0.0)))
    one, other = (answer_of(index, assemble([view] * count)) for count in (1, copies))
    assert_same(one, other)
    if one.diagnostics is not None and other.diagnostics is not None:
        assert other.diagnostics.margin == pytest.approx(one.diagnostics.margin, abs=1e-6)


def test_views_a_millimetre_apart_are_lines_of_sight_from_one_place() -> None:
    walls, ends = view_of(1)
    view = View(scan_of(ends, viewpoint=(0.0, 0.0)))
    near = View(scan_of(ends - np.tile([1e-3, 0.0], 2), viewpoint=(0.0, 0.0)), pose(1e-3))
    one, other = (answer_of(index_of(walls), assemble(views)) for views in ([view], [view, near]))
    assert other.probability == pytest.approx(one.probability, abs=PROBABILITY)
