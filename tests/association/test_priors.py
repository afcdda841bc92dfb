"""Priors: they separate equal places, may be wrong, and are never fused into the pose."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from association import HardPrior, SoftPrior, Status
from registration import RigidTransform

from .scenes import (
    CORRIDOR,
    INSIDE,
    LOBBY,
    ROOM,
    SQUARE,
    answer_of,
    equal_rooms,
    index_of,
    known,
    maze,
    pose,
    ranges,
    reason_codes,
    same_pose,
    scan_of,
    seen,
    warning_codes,
)

ROOM_INDEX = index_of(ROOM)
MAZE_INDEX = index_of(maze(1))


def test_a_covariance_may_have_unlike_deviations() -> None:
    scale = np.array([1e-5, 1e5, 1e-2])
    correlated = np.array([[1.0, 0.9, 0.0], [0.9, 1.0, 0.0], [0.0, 0.0, 1.0]])
    assert SoftPrior(pose(), correlated * np.outer(scale, scale)).covariance[0, 0] == pytest.approx(1e-10)


@pytest.mark.parametrize(
    ("at", "inside"),
    [
        (pose(1.0, 2.0, 3.1), True),
        (pose(1.29, 2.39, 3.1), True),
        (pose(1.31, 2.41, 3.1), False),
        (pose(1.0, 2.0, -3.1), True),
        (pose(1.0, 2.0, -2.9), False),
        (pose(1.0, 2.0, 2.9), True),
        (pose(1.0, 2.0, 2.8), False),
    ],
)
def test_a_window_contains_what_is_near_in_place_and_angle(at: Any, inside: bool) -> None:
    assert HardPrior(pose(1.0, 2.0, 3.1), 0.5, 0.25).contains(at) is inside


@pytest.mark.parametrize(
    "prior", [SoftPrior(pose(2.2, 2.0, 0.0), np.diag([0.25, 0.25, 0.05])), HardPrior(pose(2.2, 2.0, 0.0), 0.5, 0.3)]
)
def test_a_prior_decides_between_the_four_ways_round_of_a_square(prior: SoftPrior | HardPrior) -> None:
    index, at = index_of(SQUARE), pose(2.0, 2.2, 0.1)
    scan = scan_of(seen(SQUARE, at)[0])
    assert answer_of(index, scan).status is Status.AMBIGUOUS
    result = answer_of(index, scan, prior)
    assert (result.status, result.usable) == (Status.OK, True)
    assert same_pose(result.pose, at, 1e-9, 1e-9), "a prior is never fused into the pose"


def test_a_prior_changes_neither_pose_nor_covariance() -> None:
    scan = ranges(ROOM, INSIDE, 1)
    plain = answer_of(ROOM_INDEX, scan)
    sharp = SoftPrior(pose(INSIDE.x + 0.02, INSIDE.y, INSIDE.theta), np.diag([1e-4, 1e-4, 1e-5]))
    for prior in (sharp, HardPrior(pose(2.7, 2.7, 0.6), 1.0, 0.4)):
        result = answer_of(ROOM_INDEX, scan, prior)
        assert same_pose(result.pose, plain.pose, 1e-9, 1e-9)
        np.testing.assert_allclose(known(result.covariance), known(plain.covariance), rtol=1e-6)


def test_a_prior_is_weighed_against_the_scan() -> None:
    """Of two rooms one lacks a wall; a prior that is sharp enough makes the answer the other."""
    index = index_of(equal_rooms(2)[:-1])
    scan = scan_of(seen(ROOM, INSIDE, noise=0.02, seed=1)[0])
    there = pose(INSIDE.x + 12.0, INSIDE.y, INSIDE.theta)
    wide, sharp = (SoftPrior(there, np.diag([s**2, s**2, 1.0])) for s in (8.0, 1.0))
    assert same_pose(answer_of(index, scan, wide).pose, INSIDE)
    assert same_pose(answer_of(index, scan, sharp).pose, there)


@pytest.mark.parametrize("hard", [True, False])
@pytest.mark.parametrize("wrong", [pose(7.0, 1.0, -2.0), pose(5.0, 2.5, 0.7)])
def test_a_contradicted_prior_has_a_warning_and_is_never_usable(hard: bool, wrong: RigidTransform) -> None:
    """A soft one does not make the place ambiguous."""
    prior = HardPrior(wrong, 0.5, 0.5) if hard else SoftPrior(wrong, np.diag([0.01, 0.01, 0.01]))
    for on_map in (0.9, 1.0):
        result = answer_of(ROOM_INDEX, scan_of(seen(ROOM, INSIDE)[0]), prior, on_map=on_map, usable_from=0.5)
        assert not result.usable
        assert known(result.probability) <= 0.5
        assert warning_codes(result) == ["prior_contradicted"]
        assert reason_codes(result)[0] == "prior_contradicted"
        assert hard or same_pose(result.pose, INSIDE, 1e-9, 1e-9)


def test_a_window_that_does_not_hold_the_truth_is_contradicted() -> None:
    """A pose that slides along a corridor inside of the window does not stand for the better one 8 m away."""
    walls = np.array([[0, 0, 30, 0], [30, 0, 30, 2], [30, 2, 14, 2], [14, 2, 14, 5], [12, 5, 12, 2], [12, 2, 0, 2]])
    at = pose(13.0, 1.0, 0.1)
    scan = scan_of(seen(walls, at, noise=0.01, radius=9.0, seed=1)[0])
    assert same_pose(answer_of(index_of(walls), scan).pose, at)
    result = answer_of(index_of(walls), scan, HardPrior(pose(21.0, 1.0, 0.1), 2.0, 0.3))
    assert not result.usable
    assert "prior_contradicted" in reason_codes(result)


def test_nothing_within_a_window_is_no_match() -> None:
    """The poses outside of it are alternatives."""
    result = answer_of(ROOM_INDEX, scan_of(seen(ROOM, INSIDE)[0]), HardPrior(pose(-30.0, 0.0), 0.5, 0.3))
    assert (result.status, result.pose, result.usable) == (Status.NO_MATCH, None, False)
    assert any(same_pose(one.pose, INSIDE) for one in result.alternatives)
    assert result.unmatched_scan == tuple(range(8))


def test_a_usable_answer_lies_within_its_window() -> None:
    """A pose may leave a window that is narrower than the noise: it is returned, and not usable."""
    usable = outside = 0
    for seed in range(40):
        prior = HardPrior(pose(3.01, 2.49, 0.7), 0.02, 0.004)
        result = answer_of(ROOM_INDEX, scan_of(seen(ROOM, INSIDE, noise=0.03, seed=seed)[0]), prior)
        if result.pose is not None and not prior.contains(result.pose):
            assert not result.usable
            assert "prior_contradicted" in warning_codes(result)
            outside += 1
        usable += result.usable
    assert usable > 0
    assert outside > 0


def test_of_a_family_of_poses_the_one_nearest_the_prior_is_returned() -> None:
    """Without a prior it is the one that centres what is seen on the map."""
    scan = scan_of(seen(CORRIDOR, pose(15.0, 0.8, 0.0))[0])
    result = answer_of(index_of(CORRIDOR), scan, SoftPrior(pose(11.0, 1.0, 0.0), np.eye(3)))
    assert result.status is Status.DEGENERATE
    assert (known(result.pose).x, known(result.pose).y) == pytest.approx((11.0, 0.8), abs=1e-6)
    assert result.message.startswith("The position along the direction")
    assert known(answer_of(index_of(CORRIDOR), scan).pose).x == pytest.approx(15.0, abs=1e-6)


def test_a_small_window_makes_the_search_short() -> None:
    """Walls are tried at places within it, not all along at steps of its size."""
    at = pose(16.4, 12.7, -2.9)
    ends = seen(maze(1), at, noise=0.01, cut=0.2, seed=0, radius=8.0)[0]
    for radius in (1.0, 1e-4):
        result = answer_of(MAZE_INDEX, scan_of(ends), HardPrior(at, radius, 0.1))
        assert result.search.hypotheses < 1000


def test_a_prior_does_not_make_too_few_walls_usable() -> None:
    """Two walls at right angles, with a prior that holds all of the map."""
    index = index_of(LOBBY)
    corner = scan_of([[-3.0, -1.0, 4.5, -1.0], [4.5, -1.0, 4.5, 1.5]], viewpoint=(0.0, 0.0))
    found = answer_of(index, corner, HardPrior(pose(3.5, 1.0), 20.0, 3.2))
    assert not found.usable
