"""The best poses are those that the reference stores."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings

from association import HardPrior, SoftPrior
from association.layout import FOUND
from association.options import Prior
from association.search.kernels import best_poses
from association.search.layout import BEST
from registration import RigidTransform
from registration.layout import Records

from ...kernels.drawn import SEEDS, prior_record
from ...kernels.plans import RULE, state_of
from ...records import estimate_of, pose_of
from ...reference import best_poses as twin
from ...scenes import pose


def listed(found: Records, count: int) -> list[tuple[RigidTransform, float, float]]:
    return [(pose_of(one), float(one["score"]), float(one["value"])) for one in found[:count]]


@given(SEEDS)
@settings(max_examples=100, deadline=None)
def test_keep(seed: int) -> None:
    """Many poses at few places, of equal values too, for a list that is soon full."""
    rng = np.random.default_rng(seed)
    found, best = np.zeros(5, FOUND), np.zeros(1, BEST)
    expected = twin.BestPoses(5, 0.3, 0.1)
    for _ in range(60):
        x, y, theta = rng.integers(0, 3, 3) * [0.4, 0.4, 3.0] + rng.choice([0.0, 0.07, 0.2], 3)
        at, score, value = pose(x, y, theta), float(rng.integers(1, 9)), float(rng.integers(1, 9))
        best_poses.store(found, best[0], RULE[0], estimate_of(at)[0], score, value)
        expected.keep(at, score, value)
        assert listed(found, int(best["count"][0])) == expected.kept
        assert best["least_value"][0] == expected.least_kept


def offered(prior: Prior | None, poses: list[RigidTransform], scores: list[float]) -> tuple[Records, Records]:
    found, best = np.zeros(4, FOUND), np.zeros(1, BEST)
    for at, score in zip(poses, scores, strict=True):
        best_poses.offer(found, best[0], RULE[0], prior_record(prior)[0], estimate_of(at)[0], score)
    return found[: int(best["count"][0])], best


def test_only_poses_that_are_worth_it_are_kept() -> None:
    """A score of 0 is none; below 65 % of the best there is no alternative; the best value is kept up to date."""
    far = [pose(float(k)) for k in range(4)]
    found, best = offered(None, far, [0.0, 10.0, 6.4, 6.6])
    assert found["score"].tolist() == [10.0, 6.6]
    assert best["best_value"][0] == 10.0
    found, best = offered(None, far, [10.0, 20.0, 12.9, -1.0])
    assert found["score"].tolist() == [10.0, 20.0]
    assert best["best_value"][0] == 20.0


def test_what_falls_off_a_full_list_is_not_offered_again() -> None:
    poses = [pose(float(k)) for k in range(6)]
    found, best = offered(None, poses, [10.0, 9.0, 8.0, 7.0, 7.5, 7.4])
    assert sorted(found["score"]) == [7.5, 8.0, 9.0, 10.0]
    assert best["least_value"][0] == 7.5


def test_a_soft_prior_counts_when_poses_are_kept() -> None:
    """The value is score and prior together, and so is the floor."""
    prior = SoftPrior(pose(), np.eye(3))
    found, best = offered(prior, [pose(), pose(3.0), pose(2.0), pose(0.0, 3.0)], [10.0, 10.9, 8.0, 11.1])
    np.testing.assert_allclose(found["value"], [10.0, 11.1 - 4.5])
    assert found["score"].tolist() == [10.0, 11.1]
    _, best = offered(prior, [pose(2.0)], [10.0])
    assert best["best_value"][0] == pytest.approx(8.0)


def test_outside_of_a_window_no_pose_is_kept() -> None:
    prior = HardPrior(pose(), 1.0, 0.5)
    found, best = offered(prior, [pose(2.0), pose(0.9), pose(0.0, 0.0, 0.6)], [50.0, 10.0, 50.0])
    assert found[["x", "score", "value"]].tolist() == [(0.9, 10.0, 10.0)]
    assert best["best_value"][0] == 10.0


def test_the_poses_of_bases_and_slides_are_put_in_order() -> None:
    """Ties stay as they were found."""
    of_bases, of_slides = state_of(8), state_of(8)
    of_bases.poses["value"], of_bases.poses["x"] = [1.0, 3.0, 2.0, 9.0, 9.0, 9.0, 9.0, 9.0], np.arange(8)
    of_slides.poses["value"], of_slides.poses["x"] = [3.0, 4.0, 0.5, 9.0, 9.0, 9.0, 9.0, 9.0], 10.0 + np.arange(8)
    of_bases.best["count"], of_slides.best["count"] = 3, 3
    assert best_poses.best_first(of_bases, of_slides)["x"].tolist() == [11.0, 1.0, 10.0, 2.0, 0.0, 12.0]
    of_slides.best["count"] = 0
    assert best_poses.best_first(of_bases, of_slides)["x"].tolist() == [1.0, 2.0, 0.0]
