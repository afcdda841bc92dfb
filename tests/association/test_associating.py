"""The search finds the pose, whatever hides it, and does so repeatably."""

from __future__ import annotations

import dataclasses
import math
import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from association import AssociationOptions, Deadline, HardPrior, Status, associate
from registration import RigidTransform

from .scenes import INSIDE, ROOM, answer_of, equal_rooms, index_of, maze, pose, pose_in, same_pose, scan_of, seen

ROOM_INDEX = index_of(ROOM)
MAZE_INDEX = index_of(maze(1))
WORLDS = st.integers(0, 10**6)


def poses_of(seed: int) -> RigidTransform:
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(10.0, 20.0, 2)
    return RigidTransform(x, y, rng.uniform(-math.pi, math.pi))


def test_exact_scan_gives_the_exact_pose_and_every_pair() -> None:
    endpoints, truth = seen(ROOM, INSIDE)
    result = answer_of(ROOM_INDEX, scan_of(endpoints))
    assert result.status is Status.OK
    assert result.usable
    assert same_pose(pose_in(result), INSIDE, 1e-9, 1e-9)
    assert [c.map for c in result.correspondences] == truth.tolist()
    assert [c.scan for c in result.correspondences] == list(range(len(truth)))
    assert all(abs(c.offset) < 1e-9 and c.overlap > 1.0 - 1e-9 for c in result.correspondences)
    assert result.unmatched_scan == ()


@pytest.mark.parametrize("seed", range(8))
def test_partial_noisy_views_among_clutter(seed: int) -> None:
    """Walls seen in half, 2 cm of noise, and a third of the segments from no wall."""
    at = poses_of(seed)
    endpoints, truth = seen(maze(1), at, noise=0.02, cut=0.5, clutter=10, seed=seed, radius=9.0)
    result = answer_of(MAZE_INDEX, scan_of(endpoints))
    assert same_pose(pose_in(result), at)
    for c in result.correspondences:
        if truth[c.scan] >= 0:
            assert MAZE_INDEX.wall_of_piece[c.map] == MAZE_INDEX.wall_of_piece[truth[c.scan]]
    found = {c.scan for c in result.correspondences}
    assert found | set(result.unmatched_scan) == set(range(len(truth)))
    assert len(found & set(np.nonzero(truth >= 0)[0].tolist())) >= 0.8 * (truth >= 0).sum()


@pytest.mark.parametrize("seed", range(3))
def test_four_fifths_of_clutter(seed: int) -> None:
    at = poses_of(seed)
    endpoints, truth = seen(maze(1), at, noise=0.01, cut=0.2, clutter=48, seed=seed, radius=8.0)
    assert (truth < 0).mean() > 0.75
    assert same_pose(pose_in(answer_of(MAZE_INDEX, scan_of(endpoints))), at)


@given(WORLDS, st.floats(-math.pi, math.pi), st.floats(-50, 50), st.floats(-50, 50))
@settings(max_examples=15, deadline=None)
def test_moving_the_map_moves_the_pose(seed: int, theta: float, x: float, y: float) -> None:
    by, at = RigidTransform(x, y, theta), poses_of(seed)
    endpoints, _ = seen(maze(1), at, noise=0.02, cut=0.3, clutter=3, seed=seed, radius=9.0)
    moved = index_of(by.apply(maze(1).reshape(-1, 2, 2)).reshape(-1, 4))
    here, there = answer_of(MAZE_INDEX, scan_of(endpoints)), answer_of(moved, scan_of(endpoints))
    assert same_pose(by.compose(pose_in(here)), pose_in(there), 1e-6, 1e-7)
    assert here.status is there.status
    assert here.probability == pytest.approx(there.probability, abs=1e-3)


@given(WORLDS, st.floats(-math.pi, math.pi), st.floats(-3, 3), st.floats(-3, 3))
@settings(max_examples=15, deadline=None)
def test_moving_the_sensors_frame_moves_the_pose(seed: int, theta: float, x: float, y: float) -> None:
    """What is seen is the same, described from elsewhere."""
    by, at = RigidTransform(x, y, theta), poses_of(seed)
    endpoints, _ = seen(maze(1), at, noise=0.02, cut=0.3, clutter=3, seed=seed, radius=9.0)
    elsewhere = by.inverse().apply(endpoints.reshape(-1, 2, 2)).reshape(-1, 4)
    here, there = answer_of(MAZE_INDEX, scan_of(endpoints)), answer_of(MAZE_INDEX, scan_of(elsewhere))
    assert same_pose(pose_in(here).compose(by), pose_in(there), 1e-6, 1e-7)
    assert [c.map for c in here.correspondences] == [c.map for c in there.correspondences]


@given(WORLDS)
@settings(max_examples=15, deadline=None)
def test_the_order_of_segments_does_not_matter(seed: int) -> None:
    """Neither that of the scan nor that of the map."""
    endpoints, _ = seen(maze(1), poses_of(seed), noise=0.02, cut=0.5, clutter=6, seed=seed, radius=9.0)
    rng = np.random.default_rng(seed)
    of_scan, of_map = rng.permutation(len(endpoints)), rng.permutation(len(maze(1)))
    one = answer_of(MAZE_INDEX, scan_of(endpoints))
    other = answer_of(index_of(maze(1)[of_map]), scan_of(endpoints[of_scan]))
    assert same_pose(pose_in(one), pose_in(other), 1e-9, 1e-9)
    assert {(int(of_scan[c.scan]), int(of_map[c.map])) for c in other.correspondences} == {
        (c.scan, c.map) for c in one.correspondences
    }
    assert other.probability == pytest.approx(one.probability, abs=1e-6)


@given(WORLDS)
@settings(max_examples=8, deadline=None)
def test_the_same_question_has_the_same_answer_to_the_bit(seed: int) -> None:
    """From an index that was used before and from a fresh one."""
    endpoints, _ = seen(maze(1), poses_of(seed), noise=0.02, cut=0.5, clutter=8, seed=seed, radius=9.0)
    indices = [MAZE_INDEX, MAZE_INDEX, index_of(maze(1))]
    assert len({repr(answer_of(index, scan_of(endpoints), seed=seed)) for index in indices}) == 1


def test_utm_coordinates_lose_no_accuracy() -> None:
    shift = np.array([5e6, 4.2e6])
    far = index_of(ROOM + np.tile(shift, 2))
    endpoints, _ = seen(ROOM, INSIDE, noise=0.01, seed=3)
    near, there = answer_of(ROOM_INDEX, scan_of(endpoints)), answer_of(far, scan_of(endpoints))
    back = RigidTransform(pose_in(there).x - shift[0], pose_in(there).y - shift[1], pose_in(there).theta)
    assert same_pose(pose_in(near), back, 2e-8, 1e-8)
    assert near.covariance is not None
    assert there.covariance is not None
    np.testing.assert_allclose(near.covariance, there.covariance, rtol=1e-6, atol=1e-12)


def test_directions_may_mean_nothing() -> None:
    endpoints, _ = seen(ROOM, INSIDE, noise=0.01, seed=4)
    turned = endpoints.copy()
    turned[::2] = turned[::2][:, [2, 3, 0, 1]]
    assert answer_of(ROOM_INDEX, scan_of(turned)).status is not Status.OK
    result = answer_of(ROOM_INDEX, scan_of(turned), oriented=False)
    assert result.status is Status.OK
    assert same_pose(pose_in(result), INSIDE)
    assert max(c.map for c in result.correspondences) < len(ROOM)
    assert all(abs(c.angle) < 0.1 for c in result.correspondences)


def in_three(walls: np.ndarray) -> np.ndarray:
    """Return the walls with the first one in three pieces."""
    begin, step = walls[0, :2], (walls[0, 2:] - walls[0, :2]) / 3.0
    pieces = [[*(begin + k * step), *(begin + (k + 0.97) * step)] for k in range(3)]
    return np.vstack([pieces, walls[1:]])


@pytest.mark.parametrize("oriented", [True, False])
def test_a_scan_segment_over_several_pieces_of_a_wall(oriented: bool) -> None:
    """Where directions mean nothing it is reported on the pieces as they were sent, too."""
    index = index_of(in_three(ROOM))
    endpoints, truth = seen(ROOM, INSIDE)
    if not oriented:
        endpoints = endpoints[:, [2, 3, 0, 1]]
    result = answer_of(index, scan_of(endpoints), oriented=oriented)
    assert result.status is Status.OK
    floor = next(c for c in result.correspondences if truth[c.scan] == 0)
    assert {floor.map, *floor.alternatives} == {0, 1, 2}
    assert floor.overlap == pytest.approx(0.97 + 0.01, abs=0.011)


@pytest.mark.parametrize("seed", range(4))
def test_the_short_search_misses_nothing_that_the_exhaustive_one_finds(seed: int) -> None:
    endpoints, _ = seen(maze(1), poses_of(seed), noise=0.02, cut=0.5, clutter=3, seed=seed, radius=8.0)
    short = answer_of(MAZE_INDEX, scan_of(endpoints))
    whole = answer_of(MAZE_INDEX, scan_of(endpoints), exhaustive=True)
    assert whole.search.exhaustive
    assert whole.search.bases >= short.search.bases
    assert short.diagnostics is not None
    assert whole.diagnostics is not None
    assert short.diagnostics.score == pytest.approx(whole.diagnostics.score)
    assert same_pose(pose_in(short), pose_in(whole), 1e-9, 1e-9)


def test_segments_may_have_to_lie_on_the_map_from_end_to_end() -> None:
    endpoints, _ = seen(ROOM, INSIDE)
    result = answer_of(ROOM_INDEX, scan_of(endpoints), min_overlap=1.0)
    assert result.usable
    assert len(result.correspondences) == len(endpoints)


def test_tolerances_gate() -> None:
    endpoints, _ = seen(ROOM, INSIDE)
    along = (endpoints[0, 2:] - endpoints[0, :2]) / np.hypot(*(endpoints[0, 2:] - endpoints[0, :2]))
    endpoints[0] += 0.15 * np.tile([-along[1], along[0]], 2)
    for tolerance, count in ((0.3, len(ROOM)), (0.02, len(ROOM) - 1)):
        result = answer_of(ROOM_INDEX, scan_of(endpoints), offset_tolerance=tolerance)
        assert len(result.correspondences) == count


def test_the_estimator_of_the_final_pose_may_be_chosen() -> None:
    endpoints, _ = seen(ROOM, INSIDE, noise=0.02, seed=1)
    results = {
        (estimator, rotation): answer_of(ROOM_INDEX, scan_of(endpoints), estimator=estimator, rotation=rotation)
        for estimator in ("joint", "one_step")
        for rotation in ("wahba", "mitsuta")
    }
    assert len({repr(pose_in(result)) for result in results.values()}) >= 3
    assert all(same_pose(pose_in(result), INSIDE) for result in results.values())
    assert results["one_step", "wahba"].covariance is None


def test_a_segment_across_a_doorway_is_reported_on_both_walls() -> None:
    """The pair is the piece that it lies on most; the overlap is that with all of the run."""
    index = index_of([[0, 0, 3, 0], [4, 0, 9, 0], [9, 0, 9, 6], [9, 6, 0, 6], [0, 6, 0, 0]])
    scan = scan_of([[1, 0, 8, 0], [9, 1, 9, 5], [8, 6, 2, 6], [0, 5, 0, 1]])
    result = answer_of(index, scan, HardPrior(pose(), 1.0, 0.3))
    across = next(c for c in result.correspondences if c.scan == 0)
    assert (across.map, across.alternatives) == (1, (0,))
    assert across.overlap == pytest.approx(6.0 / 7.0, abs=1e-6)


def test_covariance_is_that_of_the_errors() -> None:
    """The mean squared Mahalanobis distance of 300 poses is 3, within four standard deviations of that mean."""
    rng, exact = np.random.default_rng(9), index_of(ROOM, 0.0)
    local = INSIDE.inverse().apply(ROOM.reshape(-1, 2, 2))
    lengths = np.hypot(*(local[:, 1] - local[:, 0]).T)
    points = np.maximum(2, (lengths / 0.05).astype(int))
    total = 0.0
    for _ in range(300):
        noisy = [_fitted(rng, begin, end, count) for (begin, end), count in zip(local, points.tolist(), strict=True)]
        result = answer_of(exact, scan_of(noisy))
        found = pose_in(result)
        error = np.array([found.x - INSIDE.x, found.y - INSIDE.y, found.theta - INSIDE.theta])
        assert result.covariance is not None
        total += float(error @ np.linalg.solve(result.covariance, error))
    assert abs(total / 300 - 3.0) < 4.0 * math.sqrt(6.0 / 300)


def _fitted(rng: np.random.Generator, begin: np.ndarray, end: np.ndarray, count: int) -> list[float]:
    """Measure points of a segment with 2 cm of noise, and fit a line to them."""
    slope, offset = np.polyfit(np.linspace(-0.5, 0.5, count), rng.normal(scale=0.02, size=count), 1)
    d = (end - begin) / np.hypot(*(end - begin))
    n = np.array([-d[1], d[0]])
    return [*(begin + (offset - slope / 2) * n), *(end + (offset + slope / 2) * n)]


def test_results_are_values() -> None:
    result = answer_of(ROOM_INDEX, scan_of(seen(ROOM, INSIDE)[0]))
    with pytest.raises(dataclasses.FrozenInstanceError):
        result.usable = False  # type: ignore[misc]


@pytest.mark.parametrize("exhaustive", [True, False])
def test_what_a_search_claims_holds_only_where_it_is_complete(exhaustive: bool) -> None:
    """Whenever the deadline passes: while poses are looked for, while they are compared, and after that."""
    options = AssociationOptions(exhaustive=exhaustive)
    index, scan = index_of(equal_rooms(6)), scan_of(seen(ROOM, INSIDE)[0], viewpoint=(0.0, 0.0))
    took: set[bool] = set()
    for tenths in range(0, 60, 2):
        search = associate(index, scan, None, options, Deadline(time.monotonic() + 1e-4 * tenths)).search
        took.add(search.complete)
        assert search.complete or not search.exhaustive
        assert search.complete is (search.complete_above < 1.0)
    whole = associate(index, scan, None, options).search
    assert (whole.complete, whole.exhaustive or not exhaustive) == (True, True)
    assert False in took
