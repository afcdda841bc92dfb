"""A consensus set grows and shrinks as its twin's, which solves anew from nothing in every round."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from numpy.typing import ArrayLike

from association import Scan
from association.kernels import consensus
from association.layout import MATCH, Workspace
from association.tuning import ROUNDS, SPRING
from registration import MeasuredSegments, RigidTransform, Segments
from registration.kernels import joint_cost
from registration.layout import JOINT_SUMS, SYMMETRIC3

from ..records import assert_records, covariance_of, estimate_of, pose_of
from ..reference import consensus as twin
from ..reference import proposing
from ..reference.geometry import moved
from ..reference.matching import match_scan
from ..scenes import context_of, index_of, local, pose, same_pose, scan_of
from .drawn import GATES, INDEX, PLACE, SEEDS, SMALL, covariance, drawn


def test_turning() -> None:
    """As its twin has it, and the covariance of the place of the point that is held is 0."""
    out = np.zeros(1, SYMMETRIC3)
    consensus.turning(0.01, 2.0, -3.0, out[0])
    got = covariance_of(out[0])
    np.testing.assert_allclose(got, proposing.turning(0.01, np.array([2.0, -3.0])), rtol=1e-15)
    at_pin = np.array([[1.0, 0.0, 3.0], [0.0, 1.0, 2.0]])  # derivative of R p + t by (x, y, theta), R p = (2, -3)
    np.testing.assert_allclose(at_pin @ got @ at_pin.T, 0.0, atol=1e-15)


@given(SEEDS)
@settings(max_examples=30, deadline=None)
def test_value_matches(seed: int) -> None:
    """Also of matches so far off that they are none."""
    d = drawn(seed)
    matches, _ = match_scan(d.scan, d.near(), SMALL, PLACE, GATES)
    matches["offset"] += d.rng.choice([0.0, 0.3], len(matches)) * d.rng.normal(size=len(matches))
    matches["worth"] = d.rng.normal(size=len(matches))  # of another pose
    got, expected = matches.copy(), matches.copy()
    assert consensus.value_matches(d.scan, got) == pytest.approx(twin.value_matches(d.scan, expected))
    assert_records(got, expected, atol=1e-9)


def test_a_match_that_is_worth_nothing_is_none() -> None:
    d = drawn(3)
    matches, _ = match_scan(d.scan, d.at, SMALL, PLACE, GATES)
    k = int(np.argmax(matches["wall"]))
    deviation = math.sqrt(2.0 * d.scan["gain"][k] * matches["overlap"][k] * d.scan["offset_variance"][k])
    matches["sine"][k] = 0.0
    for off, is_one in ((0.999 * deviation, True), (1.001 * deviation, False), (-1.001 * deviation, False)):
        some = matches.copy()
        some["offset"][k] = off
        consensus.value_matches(d.scan, some)
        assert bool(some["wall"][k] >= 0) is bool(some["worth"][k] > 0.0) is is_one


def test_hold_and_clear() -> None:
    """The spring costs the square of the distance from where it holds, and lets go without a trace."""
    sums = np.zeros(1, JOINT_SUMS)
    consensus.hold(sums[0], 2.0, -1.0, 1.0)
    assert joint_cost(sums[0], 0.7, 5.0, 3.0) == pytest.approx(SPRING * (3.0**2 + 4.0**2))
    assert joint_cost(sums[0], -0.7, 2.0, -1.0) == pytest.approx(0.0, abs=1e-12)
    consensus.hold(sums[0], 2.0, -1.0, -1.0)
    np.testing.assert_allclose(sums.view(float), 0.0, atol=1e-15)
    sums.view(float)[:] = 1.0
    consensus.clear(sums[0])
    assert not sums.view(float).any()


@given(SEEDS)
@settings(max_examples=12, deadline=None)
def test_refine(seed: int) -> None:
    """From poses that are a little off, and from some that are far off."""
    d = drawn(seed)
    work = Workspace.of(len(d.scan))
    # What another pose left behind.
    work.held[:], work.scratch["sums"].view(float)[:] = d.rng.integers(-1, 9, len(d.scan)), 1.0
    for start in (d.near(), d.near(0.05, 0.2, 0.2), d.near(0.02, 4.0, 4.0)):
        spread, matches = covariance(d.rng), np.zeros(len(d.scan), MATCH)
        for rounds in (1, ROUNDS):
            estimate = estimate_of(start, spread)
            got = consensus.refine(d.scan, estimate[0], PLACE, GATES[0], matches, work, rounds)
            expected = twin.refine(d.scan, start, spread, PLACE, GATES, rounds)
            assert got == pytest.approx(expected.score, abs=1e-4)
            assert same_pose(pose_of(estimate[0]), expected.pose, 1e-5, 1e-6)
            np.testing.assert_allclose(covariance_of(estimate[0]), expected.covariance, rtol=1e-4, atol=1e-8)
            np.testing.assert_array_equal(matches["wall"], expected.matches["wall"])
            np.testing.assert_allclose(matches["worth"], expected.matches["worth"], atol=1e-4)


def test_refine_finds_the_pose_again() -> None:
    """From 10 cm and 1 degree off, the consensus set grows back to all walls that were seen."""
    d = drawn(7, radius=12.0)
    estimate = estimate_of(moved(d.at, [0.017, 0.07, -0.07]), np.diag([0.01, 0.01, 4e-4]))
    matches = np.zeros(len(d.scan), MATCH)
    consensus.refine(d.scan, estimate[0], PLACE, GATES[0], matches, Workspace.of(len(d.scan)), 4)
    assert same_pose(pose_of(estimate[0]), d.at, 0.03, 0.005)
    truth = d.truth[d.order]
    expected = np.where(truth >= 0, INDEX.wall_of_piece[truth], -1)
    np.testing.assert_array_equal(matches["wall"][expected >= 0], expected[expected >= 0])


def refined(walls: ArrayLike, scan: Scan, start: RigidTransform) -> tuple[float, RigidTransform]:
    """Return the score and the pose, in the map frame, of a pose that comes without a covariance."""
    index = index_of(walls)
    rows = context_of(index, scan).segments.rows
    estimate, matches = estimate_of(local(index, start), SMALL), np.zeros(len(rows), MATCH)
    score = consensus.refine(rows, estimate[0], index.tables.place, GATES[0], matches, Workspace.of(len(rows)), ROUNDS)
    x, y = index.origin
    return score, moved(pose_of(estimate[0]), [0.0, x, y])


@pytest.mark.parametrize(("off", "stays"), [(0.02, False), (0.06, True)])
def test_a_set_that_would_carry_its_pose_far_away_leaves_it(off: float, stays: bool) -> None:
    """Two walls 30 mrad apart: what is seen `off` beside one of them puts the crossing 33 times as far along."""
    walls = [[0.0, 0.0, 10.0, 0.0], [10.0, 3.0, 0.0, 3.3]]
    seen = [[2.0, 0.0, 8.0, 0.0], [8.0, 3.06 + off, 2.0, 3.24 + off]]
    score, at = refined(walls, scan_of(seen), pose())
    assert score > 10.0
    assert same_pose(at, pose(), 1e-9, 1e-9) is stays


@pytest.mark.parametrize(("off", "stays"), [(0.15, False), (0.25, True)])
def test_a_set_that_would_turn_its_pose_far_leaves_it(off: float, stays: bool) -> None:
    """A short segment knows so little of its angle that its gate is wide."""
    score, at = refined(
        [[0.0, 0.0, 10.0, 0.0]], scan_of([[4.75, 0.0, 5.25, 0.0]], 0.06), pose(5.0, 0.0, off).compose(pose(-5.0))
    )
    assert score > 0.0
    assert at.theta == pytest.approx(off if stays else 0.0, abs=0.01)


def test_a_set_that_does_not_fix_the_rotation_is_worth_nothing() -> None:
    """A segment that is known by one point, where the sensor stands."""
    seen = Segments.from_array([[-0.5, 0.0, 0.5, 0.0]])
    point = MeasuredSegments.from_segments(seen, 0.02, moments=(np.zeros((1, 2)), np.zeros(1)))
    assert refined([[0.0, 0.0, 10.0, 0.0]], Scan(point), pose(5.0, 0.0))[0] == 0.0
