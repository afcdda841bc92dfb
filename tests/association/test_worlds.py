"""Drawn worlds with known answers: similar places, slides, other buildings and nothing at all."""

from __future__ import annotations

import math

import numpy as np
import pytest

from association import AssociationResult, SoftPrior, Status, message_of

from .scenes import (
    CORRIDOR,
    ROOM,
    SQUARE,
    answer_of,
    beams_of,
    equal_rooms,
    index_of,
    maze,
    pose,
    pose_in,
    same_pose,
    scan_of,
    seen,
)


def free_of(result: AssociationResult) -> tuple[float, float]:
    assert result.unobservable is not None
    return result.unobservable


def test_a_square_room_has_four_answers() -> None:
    result = answer_of(index_of(SQUARE), scan_of(seen(SQUARE, pose(2.0, 1.5, 0.4))[0]))
    assert result.status is Status.AMBIGUOUS
    assert not result.usable
    assert len(result.alternatives) == 3
    assert result.probability == pytest.approx(0.25, abs=0.05)
    assert result.diagnostics is not None
    assert result.diagnostics.margin == pytest.approx(0.0, abs=1e-6)
    assert result.diagnostics.runner_up == pytest.approx(1.0)


@pytest.mark.parametrize("rooms", [2, 5, 8])
def test_equal_rooms(rooms: int) -> None:
    at = pose(3.0 + 12.0, 2.0, 0.3)
    endpoints, _ = seen(equal_rooms(rooms)[len(ROOM) : 2 * len(ROOM)], at, noise=0.01, seed=1)
    result = answer_of(index_of(equal_rooms(rooms)), scan_of(endpoints), max_alternatives=20)
    assert result.status is Status.AMBIGUOUS
    poses = [pose_in(result), *(a.pose for a in result.alternatives)]
    for k in range(rooms):
        assert any(same_pose(p, pose(3.0 + 12.0 * k, 2.0, 0.3)) for p in poses), f"room {k}"


def test_one_of_two_equal_rooms_lacks_a_wall() -> None:
    """The visible part of that wall separates the rooms."""
    at = pose(3.0, 2.0, 0.3)
    scan = scan_of(seen(ROOM, at, noise=0.01, seed=1)[0])
    result = answer_of(index_of(equal_rooms(2)[:-1]), scan)
    assert result.status is Status.OK
    assert same_pose(pose_in(result), at)


def test_parallel_walls_at_distances_of_their_own() -> None:
    """The gaps decide which of five parallel walls are seen; the position along them is unobservable."""
    heights = [0.0, 2.0, 5.0, 9.0, 14.0]
    walls = np.array([[0.0, y, 30.0, y] if k % 2 == 0 else [30.0, y, 0.0, y] for k, y in enumerate(heights)])
    at = pose(15.0, 7.0, 0.2)
    result = answer_of(index_of(walls), scan_of(seen(walls[1:4], at, cut=0.3, seed=4)[0]))
    assert result.status is Status.DEGENERATE
    assert np.abs(free_of(result)) == pytest.approx([1.0, 0.0], abs=1e-3)
    assert (pose_in(result).y, pose_in(result).theta) == pytest.approx((7.0, 0.2), abs=0.01)
    assert {c.map for c in result.correspondences} == {1, 2, 3}


def test_a_corridor_is_fixed_across_and_free_along() -> None:
    endpoints, _ = seen(CORRIDOR, pose(4.0, 0.8, 0.05), cut=0.5, seed=2)
    result = answer_of(index_of(CORRIDOR), scan_of(endpoints))
    assert result.status is Status.DEGENERATE
    assert (result.covariance, result.probability) == (None, None)
    assert np.abs(free_of(result)) == pytest.approx([1.0, 0.0], abs=1e-3)
    assert pose_in(result).y == pytest.approx(0.8, abs=0.01) or pose_in(result).y == pytest.approx(1.2, abs=0.01)


def test_of_a_family_of_poses_the_one_nearest_the_prior() -> None:
    scan = scan_of(seen(CORRIDOR, pose(15.0, 0.8, 0.0))[0])
    result = answer_of(index_of(CORRIDOR), scan, SoftPrior(pose(11.0, 1.0, 0.0), np.eye(3)))
    assert result.status is Status.DEGENERATE
    assert (pose_in(result).x, pose_in(result).y) == pytest.approx((11.0, 0.8), abs=1e-6)
    assert pose_in(answer_of(index_of(CORRIDOR), scan)).x == pytest.approx(15.0, abs=1e-6)


def test_a_single_segment_is_degenerate() -> None:
    result = answer_of(index_of(ROOM), scan_of(seen(ROOM[:1], pose(3.0, 2.0, 0.2))[0]))
    assert result.status is Status.DEGENERATE
    assert (result.usable, result.probability) == (False, None)
    assert message_of(result).startswith("The position along the direction")


def test_an_empty_scan_matches_nothing() -> None:
    result = answer_of(index_of(ROOM), scan_of(np.zeros((0, 4))))
    assert result.status is Status.NO_MATCH
    assert result.pose is None
    assert result.diagnostics is None
    assert result.search.complete


@pytest.mark.parametrize("seed", range(6))
def test_the_scan_of_another_building_is_never_usable(seed: int) -> None:
    endpoints, _ = seen(maze(seed + 20), pose(15.0, 15.0, 0.3), noise=0.02, cut=0.4, seed=seed, radius=10.0)
    result = answer_of(index_of(maze(1)), scan_of(endpoints))
    assert not result.usable
    assert result.reasons


def test_a_wall_that_should_hide_another_speaks_against_a_pose() -> None:
    """Two equal rooms, one with a screen across that the scan sees through: the other one it is."""
    rooms = np.vstack([equal_rooms(2), [[16.5, 0.5, 16.5, 3.5]]])
    at = pose(3.0, 2.0, 0.3)
    endpoints, _ = seen(ROOM, at, noise=0.005, seed=3)
    assert answer_of(index_of(rooms), scan_of(endpoints)).status is Status.AMBIGUOUS
    sighted = answer_of(index_of(rooms), scan_of(endpoints, viewpoint=(0.0, 0.0)))
    assert same_pose(pose_in(sighted), at)
    assert sighted.diagnostics is not None
    assert sighted.diagnostics.margin is not None
    assert sighted.diagnostics.margin > 1.0
    other = answer_of(index_of(rooms[len(ROOM) :]), scan_of(endpoints, viewpoint=(0.0, 0.0)))
    assert other.missing_map == (len(ROOM),)


def test_a_wall_that_was_seen_is_not_missing() -> None:
    """Rays to the wall that is met edge-on graze the end of its neighbour."""
    walls = [[0, 0, 6, 0], [6, 0, 6, 2], [6, 2, 4, 2], [4, 2, 4, 5], [4, 5, 0, 5], [0, 5, 0, 0]]
    scan = [[-2, 1, -2, -5], [-2, -5, 0, -5], [0, -5, 0, -3], [0, -3, 3, -3], [3, -3, 3, 1]]
    result = answer_of(index_of(walls), scan_of(scan, viewpoint=(0.0, 0.0)))
    assert not set(result.missing_map) & {c.map for c in result.correspondences}


@pytest.mark.parametrize("theta", np.linspace(-math.pi, math.pi, 7).tolist())
def test_two_perpendicular_walls_fix_the_pose_but_not_which_corner(theta: float) -> None:
    at = pose(6.0, 2.0, theta)
    result = answer_of(index_of(ROOM), scan_of(seen(ROOM[:2], at)[0]))
    poses = [pose_in(result), *(a.pose for a in result.alternatives)]
    assert any(same_pose(p, at) for p in poses)
    assert not result.usable or same_pose(pose_in(result), at)


def test_beams_tell_where_along_a_corridor() -> None:
    """The segments are those of the two long walls; single beams meet the one end that is closed."""
    index, at = index_of(np.vstack([CORRIDOR, [[0.0, 2.0, 0.0, 0.0]]])), pose(7.0, 0.8, 0.1)
    walls = seen(CORRIDOR, at, cut=0.5, seed=2)[0]
    blind = answer_of(index, scan_of(walls, viewpoint=(0.0, 0.0)))
    told = answer_of(index, scan_of(walls, viewpoint=(0.0, 0.0), beams=beams_of(index, at)))
    assert blind.status is told.status is Status.DEGENERATE
    assert abs(pose_in(blind).x - at.x) > 0.5
    assert same_pose(pose_in(told), at, 0.1, 0.1)


def test_beams_tell_equal_rooms_apart() -> None:
    """One of two equal rooms has a niche that no segment shows."""
    niche = [[0, 0, 9, 0], [9, 0, 9, 1.5], [9, 1.5, 10.5, 1.5], [10.5, 1.5, 10.5, 2.5], [10.5, 2.5, 9, 2.5],
             [9, 2.5, 9, 4]]  # fmt: skip
    index = index_of(np.vstack([ROOM, np.array([*niche, *ROOM[2:]]) + np.tile([20.0, 0.0], 2)]))
    at = pose(3.0, 2.0, 0.3)
    endpoints = seen(ROOM[2:], at)[0]
    assert answer_of(index, scan_of(endpoints, viewpoint=(0.0, 0.0))).status is Status.AMBIGUOUS
    result = answer_of(index, scan_of(endpoints, viewpoint=(0.0, 0.0), beams=beams_of(index, at)))
    assert same_pose(pose_in(result), at, 0.05, 0.01)
    assert result.diagnostics is not None
    assert result.diagnostics.margin is not None
    assert result.diagnostics.margin > 1.0
