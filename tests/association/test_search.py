"""The search finds what is there, whatever hides it, and does so repeatably."""

import dataclasses
import math
import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from association import (
    AssociationOptions,
    CancelledError,
    Deadline,
    HardPrior,
    InvalidSearchError,
    MapIndex,
    SoftPrior,
    Status,
    associate,
)
from registration import RigidTransform, Segments

from .scenes import ROOM, SQUARE, maze, pose, same_pose, scan_of, seen

ROOM_INDEX = MapIndex.build(Segments.from_array(ROOM))
MAZE_INDEX = MapIndex.build(Segments.from_array(maze(1)))
INSIDE = pose(3.0, 2.5, 0.7)


def poses_of(seed):
    rng = np.random.default_rng(seed)
    return RigidTransform(*rng.uniform(10.0, 20.0, 2), rng.uniform(-math.pi, math.pi))


def test_exact_scan_gives_the_exact_pose_and_every_pair():
    endpoints, truth = seen(ROOM, INSIDE)
    result = associate(ROOM_INDEX, scan_of(endpoints))
    assert result.status is Status.OK
    assert result.usable
    assert same_pose(result.pose, INSIDE, 1e-9, 1e-9)
    assert [c.map for c in result.correspondences] == truth.tolist()
    assert [c.scan for c in result.correspondences] == list(range(len(truth)))
    assert all(abs(c.offset) < 1e-9 and c.overlap > 1.0 - 1e-9 for c in result.correspondences)
    assert result.unmatched_scan == ()


@pytest.mark.parametrize("seed", range(8))
def test_partial_noisy_views_among_clutter(seed):
    """Walls seen in half, 2 cm of noise, and a third of the segments from no wall."""
    at = poses_of(seed)
    endpoints, truth = seen(maze(1), at, noise=0.02, cut=0.5, clutter=10, seed=seed, radius=9.0)
    result = associate(MAZE_INDEX, scan_of(endpoints))
    assert same_pose(result.pose, at)
    for c in result.correspondences:
        if truth[c.scan] >= 0:
            assert MAZE_INDEX.wall_of_piece[c.map] == MAZE_INDEX.wall_of_piece[truth[c.scan]]
    found = {c.scan for c in result.correspondences}
    assert found | set(result.unmatched_scan) == set(range(len(truth)))
    assert len(found & set(np.nonzero(truth >= 0)[0].tolist())) >= 0.8 * (truth >= 0).sum()


@pytest.mark.parametrize("seed", range(3))
def test_four_fifths_of_clutter(seed):
    at = poses_of(seed)
    endpoints, truth = seen(maze(1), at, noise=0.01, cut=0.2, clutter=48, seed=seed, radius=8.0)
    assert (truth < 0).mean() > 0.75
    result = associate(MAZE_INDEX, scan_of(endpoints))
    assert same_pose(result.pose, at)


@given(st.integers(0, 10**6), st.floats(-math.pi, math.pi), st.floats(-50, 50), st.floats(-50, 50))
@settings(max_examples=15, deadline=None)
def test_moving_the_map_moves_the_pose(seed, theta, x, y):
    by, at = RigidTransform(x, y, theta), poses_of(seed)
    endpoints, _ = seen(maze(1), at, noise=0.02, cut=0.3, clutter=3, seed=seed, radius=9.0)
    moved = MapIndex.build(Segments.from_array(by.apply(maze(1).reshape(-1, 2, 2)).reshape(-1, 4)))
    here, there = associate(MAZE_INDEX, scan_of(endpoints)), associate(moved, scan_of(endpoints))
    assert same_pose(by.compose(here.pose), there.pose, 1e-6, 1e-7)
    assert here.status is there.status


def test_the_order_of_the_scan_does_not_matter():
    endpoints, _ = seen(maze(1), poses_of(1), noise=0.02, cut=0.5, clutter=6, seed=1, radius=9.0)
    order = np.random.default_rng(0).permutation(len(endpoints))
    one, other = associate(MAZE_INDEX, scan_of(endpoints)), associate(MAZE_INDEX, scan_of(endpoints[order]))
    assert same_pose(one.pose, other.pose, 1e-9, 1e-9)
    assert {(int(order[c.scan]), c.map) for c in other.correspondences} == {
        (c.scan, c.map) for c in one.correspondences
    }


def test_the_same_question_has_the_same_answer_to_the_bit():
    endpoints, _ = seen(maze(1), poses_of(2), noise=0.02, cut=0.5, clutter=8, seed=2, radius=9.0)
    answers = {repr(associate(MAZE_INDEX, scan_of(endpoints))) for _ in range(5)}
    assert len(answers) == 1


def test_utm_coordinates_lose_no_accuracy():
    shift = np.array([5e6, 4.2e6])
    far = MapIndex.build(Segments.from_array(ROOM + np.tile(shift, 2)))
    endpoints, _ = seen(ROOM, INSIDE, noise=0.01, seed=3)
    near, there = associate(ROOM_INDEX, scan_of(endpoints)), associate(far, scan_of(endpoints))
    assert same_pose(
        near.pose, RigidTransform(there.pose.x - shift[0], there.pose.y - shift[1], there.pose.theta), 2e-8, 1e-8
    )
    np.testing.assert_allclose(near.covariance, there.covariance, rtol=1e-6, atol=1e-12)


def test_directions_may_mean_nothing():
    endpoints, _ = seen(ROOM, INSIDE, noise=0.01, seed=4)
    turned = endpoints.copy()
    turned[::2] = turned[::2][:, [2, 3, 0, 1]]
    assert associate(ROOM_INDEX, scan_of(turned)).status is not Status.OK
    result = associate(ROOM_INDEX, scan_of(turned), options=AssociationOptions(oriented=False))
    assert result.status is Status.OK
    assert same_pose(result.pose, INSIDE)
    assert max(c.map for c in result.correspondences) < len(ROOM)
    assert all(abs(c.angle) < 0.1 for c in result.correspondences)


def test_a_scan_segment_over_several_pieces_of_a_wall():
    pieces = [np.concatenate([ROOM[0, :2] + [3.0 * k, 0], ROOM[0, :2] + [3.0 * k + 2.9, 0]]) for k in range(3)]
    index = MapIndex.build(Segments.from_array(np.vstack([pieces, ROOM[1:]])))
    endpoints, truth = seen(ROOM, INSIDE)
    result = associate(index, scan_of(endpoints))
    assert result.status is Status.OK
    floor = next(c for c in result.correspondences if truth[c.scan] == 0)
    assert {floor.map, *floor.alternatives} == {0, 1, 2}
    assert floor.overlap == pytest.approx((3 * 2.9) / 9.0, abs=1e-6)


def test_a_stopped_search_says_so_and_a_cancelled_one_raises():
    endpoints, _ = seen(ROOM, INSIDE)
    result = associate(ROOM_INDEX, scan_of(endpoints), deadline=Deadline(at=0.0))
    assert not result.search.complete
    assert not result.usable
    assert "search_incomplete" in [w.code for w in result.warnings]
    deadline = Deadline()
    deadline.cancel()
    with pytest.raises(CancelledError):
        associate(ROOM_INDEX, scan_of(endpoints), deadline=deadline)


@pytest.mark.parametrize("seed", range(4))
def test_the_short_search_misses_nothing_that_the_exhaustive_one_finds(seed):
    endpoints, _ = seen(maze(1), poses_of(seed), noise=0.02, cut=0.5, clutter=3, seed=seed, radius=8.0)
    short = associate(MAZE_INDEX, scan_of(endpoints))
    whole = associate(MAZE_INDEX, scan_of(endpoints), options=AssociationOptions(exhaustive=True))
    assert whole.search.exhaustive
    assert whole.search.bases > short.search.bases
    assert short.diagnostics.score == pytest.approx(whole.diagnostics.score)
    assert same_pose(short.pose, whole.pose, 1e-9, 1e-9)


def test_priors():
    index = MapIndex.build(Segments.from_array(SQUARE))
    at = pose(2.0, 2.2, 0.1)
    endpoints, _ = seen(SQUARE, at)
    assert associate(index, scan_of(endpoints)).status is Status.AMBIGUOUS
    soft = SoftPrior(pose(2.2, 2.0, 0.0), np.diag([0.25, 0.25, 0.05]))
    hard = HardPrior(pose(2.2, 2.0, 0.0), 0.5, 0.3)
    for prior in (soft, hard):
        result = associate(index, scan_of(endpoints), prior)
        assert result.status is Status.OK, prior
        assert result.usable
        assert same_pose(result.pose, at, 1e-9, 1e-9), "a prior is never fused into the pose"


def test_a_contradicted_prior_is_told_and_never_usable():
    endpoints, _ = seen(ROOM, INSIDE)
    wrong = pose(7.0, 1.0, -2.0)
    for prior in (SoftPrior(wrong, np.diag([0.01, 0.01, 0.01])), HardPrior(wrong, 0.5, 0.5)):
        result = associate(ROOM_INDEX, scan_of(endpoints), prior)
        assert not result.usable
        assert "prior_contradicted" in [w.code for w in result.warnings], prior


def test_a_usable_answer_lies_within_its_window():
    """What is registered may leave a window that is narrower than the noise: then it is told, and not usable."""
    usable = 0
    for seed in range(40):
        endpoints, _ = seen(ROOM, INSIDE, noise=0.03, seed=seed)
        prior = HardPrior(pose(3.01, 2.49, 0.7), 0.02, 0.004)
        result = associate(ROOM_INDEX, scan_of(endpoints), prior)
        if result.pose is not None and not prior.contains(result.pose):
            assert not result.usable
            assert "prior_contradicted" in [w.code for w in result.warnings]
        usable += result.usable
    assert 0 < usable < 40


def test_a_prior_that_is_far_off_does_not_make_the_place_ambiguous():
    endpoints, _ = seen(ROOM, INSIDE)
    result = associate(ROOM_INDEX, scan_of(endpoints), SoftPrior(pose(5.0, 2.5, 0.7), np.diag([0.01, 0.01, 0.01])))
    assert (result.status, result.usable, result.probability) == (Status.OK, False, 0.5)
    assert [w.code for w in result.warnings] == ["prior_contradicted"]
    assert same_pose(result.pose, INSIDE, 1e-9, 1e-9)


def test_segments_may_have_to_lie_on_the_map_from_end_to_end():
    endpoints, _ = seen(ROOM, INSIDE)
    result = associate(ROOM_INDEX, scan_of(endpoints), options=AssociationOptions(min_overlap=1.0))
    assert result.usable
    assert len(result.correspondences) == len(endpoints)


def test_segments_that_show_their_back_are_told():
    endpoints, _ = seen(SQUARE, pose(0.5, 0.3, 0.7))
    index = MapIndex.build(Segments.from_array(SQUARE))

    def codes(ends, viewpoint=(0.0, 0.0), **options):
        scan = scan_of(ends, viewpoint=viewpoint)
        return [w.code for w in associate(index, scan, options=AssociationOptions(**options)).warnings]

    assert codes(endpoints) == []
    endpoints[1] = endpoints[1][[2, 3, 0, 1]]
    assert codes(endpoints) == ["faces_away"]
    assert codes(endpoints, oriented=False) == []
    assert codes(endpoints, viewpoint=None) == []
    assert codes(np.zeros((0, 4))) == ["no_segments"]


def test_covariance_is_that_of_the_errors():
    """The mean squared Mahalanobis distance of 300 poses is 3, within four standard deviations of that mean."""
    rng = np.random.default_rng(9)
    total = 0.0
    for _ in range(300):
        local = INSIDE.inverse().apply(ROOM.reshape(-1, 2, 2)).reshape(-1, 4)
        noisy = []
        for segment in local:
            points = max(2, int(np.hypot(*(segment[2:] - segment[:2])) / 0.05))
            along = np.linspace(-0.5, 0.5, points)
            normal_noise = rng.normal(scale=0.02, size=points)
            slope, offset = np.polyfit(along, normal_noise, 1)
            d = (segment[2:] - segment[:2]) / np.hypot(*(segment[2:] - segment[:2]))
            n = np.array([-d[1], d[0]])
            noisy.append(
                np.concatenate([segment[:2] + (offset - slope / 2) * n, segment[2:] + (offset + slope / 2) * n])
            )
        result = associate(ROOM_INDEX, scan_of(np.array(noisy)))
        error = [result.pose.x - INSIDE.x, result.pose.y - INSIDE.y, result.pose.theta - INSIDE.theta]
        total += float(np.array(error) @ np.linalg.solve(result.covariance, error))
    assert abs(total / 300 - 3.0) < 4.0 * math.sqrt(6.0 / 300)


def test_residuals_beyond_the_sigmas_widen_the_covariance():
    endpoints, _ = seen(ROOM, INSIDE, noise=0.03, seed=5)
    trusting = associate(ROOM_INDEX, scan_of(endpoints, 1e-3))
    chi2, dof = trusting.diagnostics.registration.chi2, trusting.diagnostics.registration.dof
    assert chi2 > 10 * dof
    fair = associate(ROOM_INDEX, scan_of(endpoints, 1e-3 * math.sqrt(chi2 / dof)))
    np.testing.assert_allclose(trusting.covariance, fair.covariance, rtol=0.05, atol=1e-7)


@pytest.mark.parametrize(
    ("options", "argument"),
    [
        ({"confidence": 1.5}, "options.confidence"),
        ({"min_overlap": -0.1}, "options.min_overlap"),
        ({"offset_tolerance": 5.0}, "options.offset_tolerance"),
        ({"angle_tolerance": math.nan}, "options.angle_tolerance"),
        ({"max_alternatives": -1}, "options.max_alternatives"),
    ],
)
def test_options_out_of_range(options, argument):
    with pytest.raises(InvalidSearchError) as refused:
        AssociationOptions(**options)
    assert refused.value.argument == argument


@pytest.mark.parametrize("bad", [np.zeros((3, 3)), np.diag([1.0, 1.0, -1.0]), np.full((3, 3), math.nan), np.eye(2)])
def test_a_prior_takes_a_covariance(bad):
    with pytest.raises(InvalidSearchError):
        SoftPrior(pose(), bad)


def test_tolerances_gate():
    endpoints, _ = seen(ROOM, INSIDE)
    along = (endpoints[0, 2:] - endpoints[0, :2]) / np.hypot(*(endpoints[0, 2:] - endpoints[0, :2]))
    endpoints[0] += 0.15 * np.tile([-along[1], along[0]], 2)
    loose = associate(ROOM_INDEX, scan_of(endpoints), options=AssociationOptions(offset_tolerance=0.3))
    tight = associate(ROOM_INDEX, scan_of(endpoints), options=AssociationOptions(offset_tolerance=0.02))
    assert len(tight.correspondences) == len(ROOM) - 1
    assert len(loose.correspondences) == len(ROOM)


def test_results_are_values():
    result = associate(ROOM_INDEX, scan_of(seen(ROOM, INSIDE)[0]))
    with pytest.raises(dataclasses.FrozenInstanceError):
        result.usable = False


def test_a_segment_across_a_doorway_is_reported_on_both_walls():
    """The pair is the piece that it lies on most; the overlap is that with all of the run."""
    walls = np.array([[0, 0, 3, 0], [4, 0, 9, 0], [9, 0, 9, 6], [9, 6, 0, 6], [0, 6, 0, 0]], dtype=float)
    index = MapIndex.build(Segments.from_array(walls))
    seen_walls = np.array([[1.0, 0, 8.0, 0], [9, 1, 9, 5], [8, 6, 2, 6], [0, 5, 0, 1]])
    result = associate(index, scan_of(seen_walls), prior=HardPrior(pose(0.0, 0.0, 0.0), 1.0, 0.3))
    across = next(c for c in result.correspondences if c.scan == 0)
    assert (across.map, across.alternatives) == (1, (0,))
    assert across.overlap == pytest.approx(6.0 / 7.0, abs=1e-6)


@pytest.mark.parametrize("seen_walls", [[[-3, 1, 3, 1], [3, -1, -3, -1]], [[-3, 1, 3, 1], [3, 1, 3, -2]]])
def test_a_deadline_holds_where_walls_are_kilometres_long(seen_walls):
    """Some hundred of them offer a million slides, and each crossing wall thousands of bases."""
    along = np.linspace(0.0, 9000.0, 300)
    far = np.full(300, 9999.0)
    none = np.zeros(300)
    walls = np.vstack([np.stack([none, along, far, along], 1), np.stack([along, none, along, far], 1)])
    index = MapIndex.build(Segments.from_array(walls))
    scan = scan_of(np.array(seen_walls, dtype=float))
    associate(index, scan, deadline=Deadline(at=time.monotonic()))
    begun = time.monotonic()
    result = associate(index, scan, deadline=Deadline(at=begun + 0.1))
    assert time.monotonic() - begun < 1.0
    assert not result.search.complete
    assert not result.usable


def test_a_tiny_window_does_not_make_the_search_long():
    """Walls are tried at places within it, not all along at steps of its size."""
    endpoints, _ = seen(maze(1), poses_of(0), noise=0.01, cut=0.2, seed=0, radius=8.0)
    counts = [
        associate(MAZE_INDEX, scan_of(endpoints), HardPrior(poses_of(0), radius, 0.1)).search.hypotheses
        for radius in (1.0, 1e-4)
    ]
    assert max(counts) < 1000
