"""The best poses are those that their twin keeps, and a prior says what it says."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings

from association import HardPrior, SoftPrior
from association.layout import FOUND, PROGRESS, RULES, record
from association.options import Prior
from association.search.kernels import best_poses
from association.tuning import INSIDE, SOFT_FLOOR
from registration import RigidTransform
from registration.layout import Records

from ...kernels.drawn import INDEX, SEEDS
from ...records import estimate_of, pose_of
from ...reference import best_poses as twin
from ...reference.geometry import moved
from ...scenes import context_of, pose, scan_of

RULE = record(RULES, kept_share=0.65, distinct_distance=0.3, distinct_angle=0.1, rival_share=0.95)


def record_of(prior: Prior | None) -> Records:
    """Return a prior of the index frame as a record; the index lies about its own origin."""
    if prior is None:
        return context_of(INDEX, scan_of(np.zeros((0, 4)))).prior_record
    x, y = INDEX.origin
    there = pose(prior.pose.x + x, prior.pose.y + y, prior.pose.theta)
    if isinstance(prior, HardPrior):
        given: Prior = HardPrior(there, prior.radius, prior.angle)
    else:
        given = SoftPrior(there, prior.covariance)
    return context_of(INDEX, scan_of(np.zeros((0, 4))), given).prior_record


@given(SEEDS)
@settings(max_examples=100, deadline=None)
def test_prior_value(seed: int) -> None:
    rng = np.random.default_rng(seed)
    at = moved(pose(), rng.normal(size=3) * [2.0, 1.0, 1.0])
    root = rng.normal(size=(3, 3))
    poses = [moved(at, rng.normal(size=3)) for _ in range(8)]
    table = np.concatenate([estimate_of(one) for one in poses])
    for prior in (None, SoftPrior(at, root @ root.T + 0.01 * np.eye(3)), HardPrior(at, 1.0, 0.7)):
        expected = [twin.prior_value(prior, one) for one in poses]
        np.testing.assert_allclose(best_poses.prior_values(record_of(prior), table), expected, rtol=1e-6, atol=1e-9)
        assert best_poses.prior_value(record_of(prior)[0], table[0]) == pytest.approx(expected[0], rel=1e-6)


def test_what_priors_say_at_their_limits() -> None:
    soft = record_of(SoftPrior(pose(2.0, 3.0, 3.1), np.diag([0.25, 1.0, 0.01])))[0]

    def value(prior: Records, x: float, y: float, theta: float) -> float:
        return best_poses.prior_value(prior, estimate_of(pose(x, y, theta))[0])

    assert value(soft, 2.0, 3.0, 3.1) == 0.0
    assert value(soft, 2.5, 3.0, -3.1) == pytest.approx(-0.5 * (1.0 + 100.0 * (math.tau - 6.2) ** 2))
    assert value(soft, 200.0, 3.0, 3.1) == SOFT_FLOOR
    hard = record_of(HardPrior(pose(2.0, 3.0, 3.1), 0.5, 0.2))[0]
    assert value(hard, 2.4, 3.2, -3.1) == INSIDE
    assert value(hard, 2.4, 3.4, 3.1) == 0.0
    assert value(hard, 2.0, 3.0, 2.8) == 0.0


def listed(found: Records, count: int) -> list[tuple[RigidTransform, float, float]]:
    return [(pose_of(one), float(one["score"]), float(one["value"])) for one in found[:count]]


@given(SEEDS)
@settings(max_examples=100, deadline=None)
def test_keep(seed: int) -> None:
    """Many poses at few places, of equal values too, for a list that is soon full."""
    rng = np.random.default_rng(seed)
    found, progress = np.zeros(5, FOUND), np.zeros(1, PROGRESS)
    expected = twin.BestPoses(5, 0.3, 0.1)
    for _ in range(60):
        x, y, theta = rng.integers(0, 3, 3) * [0.4, 0.4, 3.0] + rng.choice([0.0, 0.07, 0.2], 3)
        at, score, value = pose(x, y, theta), float(rng.integers(1, 9)), float(rng.integers(1, 9))
        best_poses.keep(found, progress[0], RULE[0], estimate_of(at)[0], score, value)
        expected.keep(at, score, value)
        assert listed(found, int(progress["count"][0])) == expected.kept
        assert progress["least_kept"][0] == expected.least_kept


def offered(prior: Prior | None, poses: list[RigidTransform], scores: list[float]) -> tuple[Records, Records]:
    found, progress = np.zeros(4, FOUND), np.zeros(1, PROGRESS)
    for at, score in zip(poses, scores, strict=True):
        best_poses.offer(found, progress[0], RULE[0], record_of(prior)[0], estimate_of(at)[0], score)
    return found[: int(progress["count"][0])], progress


def test_only_poses_that_are_worth_it_are_kept() -> None:
    """A score of 0 is none; below 65 % of the best there is no rival; the best value is kept up to date."""
    far = [pose(float(k)) for k in range(4)]
    found, progress = offered(None, far, [0.0, 10.0, 6.4, 6.6])
    assert found["score"].tolist() == [10.0, 6.6]
    assert progress["best_value"][0] == 10.0
    found, progress = offered(None, far, [10.0, 20.0, 12.9, -1.0])
    assert found["score"].tolist() == [10.0, 20.0]
    assert progress["best_value"][0] == 20.0


def test_what_falls_off_a_full_list_is_not_offered_again() -> None:
    poses = [pose(float(k)) for k in range(6)]
    found, progress = offered(None, poses, [10.0, 9.0, 8.0, 7.0, 7.5, 7.4])
    assert sorted(found["score"]) == [7.5, 8.0, 9.0, 10.0]
    assert progress["least_kept"][0] == 7.5


def test_a_soft_prior_counts_when_poses_are_kept() -> None:
    """The value is score and prior together, and so is the floor."""
    prior = SoftPrior(pose(), np.eye(3))
    found, progress = offered(prior, [pose(), pose(3.0), pose(2.0), pose(0.0, 3.0)], [10.0, 10.9, 8.0, 11.1])
    np.testing.assert_allclose(found["value"], [10.0, 11.1 - 4.5])
    assert found["score"].tolist() == [10.0, 11.1]
    _, progress = offered(prior, [pose(2.0)], [10.0])
    assert progress["best_value"][0] == pytest.approx(8.0)


def test_outside_of_a_window_no_pose_is_kept() -> None:
    prior = HardPrior(pose(), 1.0, 0.5)
    found, progress = offered(prior, [pose(2.0), pose(0.9), pose(0.0, 0.0, 0.6)], [50.0, 10.0, 50.0])
    assert found[["x", "score", "value"]].tolist() == [(0.9, 10.0, 10.0)]
    assert progress["best_value"][0] == 10.0
