"""Priors: they separate equal places, may be wrong, and are never fused."""

from __future__ import annotations

import numpy as np

from association import AssociationResult, HardPrior, SoftPrior, Status

from .scenes import INSIDE, ROOM, SQUARE, answer_of, index_of, maze, pose, pose_in, same_pose, scan_of, seen

ROOM_INDEX = index_of(ROOM)
MAZE_INDEX = index_of(maze(1))


def codes(result: AssociationResult) -> list[str]:
    return [warning.code for warning in result.warnings]


def test_priors() -> None:
    index, at = index_of(SQUARE), pose(2.0, 2.2, 0.1)
    endpoints, _ = seen(SQUARE, at)
    assert answer_of(index, scan_of(endpoints)).status is Status.AMBIGUOUS
    soft = SoftPrior(pose(2.2, 2.0, 0.0), np.diag([0.25, 0.25, 0.05]))
    hard = HardPrior(pose(2.2, 2.0, 0.0), 0.5, 0.3)
    for prior in (soft, hard):
        result = answer_of(index, scan_of(endpoints), prior)
        assert result.status is Status.OK, prior
        assert result.usable
        assert same_pose(pose_in(result), at, 1e-9, 1e-9), "a prior is never fused into the pose"


def test_a_contradicted_prior_is_told_and_never_usable() -> None:
    endpoints, _ = seen(ROOM, INSIDE)
    wrong = pose(7.0, 1.0, -2.0)
    for prior in (SoftPrior(wrong, np.diag([0.01, 0.01, 0.01])), HardPrior(wrong, 0.5, 0.5)):
        result = answer_of(ROOM_INDEX, scan_of(endpoints), prior)
        assert not result.usable
        assert "prior_contradicted" in codes(result), prior


def test_a_usable_answer_lies_within_its_window() -> None:
    """A registered pose may leave a window that is narrower than the noise: it is returned, and not usable."""
    usable = told = 0
    for seed in range(40):
        endpoints, _ = seen(ROOM, INSIDE, noise=0.03, seed=seed)
        prior = HardPrior(pose(3.01, 2.49, 0.7), 0.02, 0.004)
        result = answer_of(ROOM_INDEX, scan_of(endpoints), prior)
        if result.pose is not None and not prior.contains(result.pose):
            assert not result.usable
            assert "prior_contradicted" in codes(result)
            told += 1
        usable += result.usable
    assert usable > 0
    assert told > 0


def test_a_prior_that_is_far_off_does_not_make_the_place_ambiguous() -> None:
    endpoints, _ = seen(ROOM, INSIDE)
    far = SoftPrior(pose(5.0, 2.5, 0.7), np.diag([0.01, 0.01, 0.01]))
    result = answer_of(ROOM_INDEX, scan_of(endpoints), far)
    assert (result.status, result.usable, result.probability) == (Status.OK, False, 0.5)
    assert codes(result) == ["prior_contradicted"]
    assert same_pose(pose_in(result), INSIDE, 1e-9, 1e-9)


def test_a_tiny_window_does_not_make_the_search_long() -> None:
    """Walls are tried at places within it, not all along at steps of its size."""
    at = pose(16.4, 12.7, -2.9)
    endpoints, _ = seen(maze(1), at, noise=0.01, cut=0.2, seed=0, radius=8.0)
    for radius in (1.0, 1e-4):
        result = answer_of(MAZE_INDEX, scan_of(endpoints), HardPrior(at, radius, 0.1))
        assert result.search.hypotheses < 1000
