"""Sums of both estimators are those of their slow references, whatever was added to them and taken out again."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from registration import Correspondences, JointSums, MeasuredSegments, OneStepSums, RigidTransform
from registration.layout import Floats
from registration.options import Rotation

from . import reference
from .scenes import assert_close, correspondences, directed, drawn, noisy_pairs

SEEDS = st.integers(0, 2**32 - 1)
FEW = settings(max_examples=20, deadline=None)
KINDS = pytest.mark.parametrize("kind", [JointSums, OneStepSums])


@KINDS
@given(SEEDS)
@FEW
def test_sums_add_up(kind: Any, seed: int) -> None:
    _, pairs, weights, _ = drawn(seed, 9)
    a, b = (kind.of_set(pairs.take(part), weights[part]) for part in (slice(0, 4), slice(4, 9)))
    both = kind.of_set(pairs, weights)
    np.testing.assert_allclose((a + b).values, both.values, rtol=1e-15)
    np.testing.assert_allclose((both - b).values, a.values, rtol=1e-15)
    assert (a.count, a.add(pairs, 7, 2.5).count, both.count) == (4, 5, 9)


@KINDS
def test_many_changes_leave_the_sums_of_what_remains(kind: Any) -> None:
    """One of the pairs is 100,000 km away."""
    rng, pairs, weights, _ = drawn(11, 40)
    far = pairs.about((1e8, -1e8), (1e8, 0.0))
    fresh = kind.of_set(pairs, weights)
    sums = fresh.add(far, 0, 1.0)
    for i in rng.integers(0, 40, 1000).tolist():
        sums = sums.add(pairs, i, weights[i]).remove(pairs, i, weights[i])
    np.testing.assert_allclose(sums.remove(far, 0, 1.0).values, fresh.values, rtol=1e-12)


def test_sums_are_read_only() -> None:
    sums = JointSums.of_set(correspondences(*noisy_pairs(np.random.default_rng(1), 3)), np.ones(3))
    with pytest.raises(ValueError, match="read-only"):
        sums.values[0] = 1.0


# --- Joint estimator --------------------------------------------------------------------------------------------------


@given(SEEDS)
@FEW
def test_joint_sums_with_their_cost_information_and_covariance(seed: int) -> None:
    """Pairs of weight 0 do not count."""
    rng, pairs, weights, measured = drawn(seed)
    sums = JointSums.of_set(pairs, weights)
    assert_close(sums.values, reference.joint_sums(*measured))
    counts = rng.random(7) < 0.5
    some = reference.joint_sums(*(values[counts] for values in measured))
    assert_close(JointSums.of_set(pairs, np.where(counts, weights, 0.0)).values, some)
    theta, x, y = rng.uniform(-3.0, 3.0, 3).tolist()
    expected = reference.joint_cost(theta, np.array([x, y]), *measured)
    assert sums.cost(theta, (x, y)) == pytest.approx(expected, rel=1e-9)
    assert_close(sums.information(theta), reference.joint_information(theta, *measured))
    np.testing.assert_allclose(sums.covariance(theta) @ sums.information(theta), np.eye(3), atol=1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_the_solution_is_the_minimum_of_the_valley_that_it_starts_in(seed: int) -> None:
    _, pairs, weights, measured = drawn(seed)
    sums, angles = JointSums.of_set(pairs, weights), np.linspace(-math.pi, math.pi, 721)
    costs = np.array([reference.least_cost(theta, *measured) for theta in angles[:-1]])
    for k in range(0, 720, 5):
        place = k
        while min(costs[place - 1], costs[(place + 1) % 720]) < costs[place]:
            place = min(((place - 1) % 720, (place + 1) % 720), key=lambda i: costs[i])
        theta, at, observable = sums.solve(angles[k])
        assert observable
        assert abs(math.remainder(theta - angles[place], math.tau)) < 0.02, angles[k]
        cost = sums.cost(theta, at)
        for step in (-1e-3, 1e-3):
            assert cost < sums.cost(theta + step, at)
            assert cost < sums.cost(theta, (at[0] + step, at[1]))
            assert cost < sums.cost(theta, (at[0], at[1] + step))


def test_the_angle_of_a_solution_is_wrapped_and_no_cost_is_negative() -> None:
    costs = []
    for seed in range(20):
        pose = RigidTransform(1.0, 2.0, -3.1)
        pairs = correspondences(*noisy_pairs(np.random.default_rng(seed), 7, noise=0.0, pose=pose))
        sums = JointSums.of_set(pairs, np.ones(7))
        theta, at, _ = sums.solve(3.1)
        assert theta == pytest.approx(-3.1, abs=1e-9)
        costs += [sums.cost(theta, at), sums.cost(theta, (1.0, 2.0))]
    assert min(costs) == 0.0
    assert max(costs) < 1e-9


# --- The paper's estimator --------------------------------------------------------------------------------------------


@given(SEEDS)
@FEW
def test_one_step_sums(seed: int) -> None:
    """About any reference, and moved from one to another; pairs of weight 0 do not count."""
    rng, pairs, weights, _ = drawn(seed)
    x, y, turn = rng.uniform([-5.0, -5.0, -0.6], [5.0, 5.0, 1.4]).tolist()
    about = RigidTransform(x, y, turn)

    def expected(chosen: Correspondences, with_weights: Floats, at: RigidTransform) -> Floats:
        columns = chosen.map_directions, chosen.map_midpoints, chosen.directions, chosen.midpoints
        return reference.one_step_sums(*columns, with_weights, (at.x, at.y, at.theta))

    counts = rng.random(7) < 0.5
    sums = OneStepSums.of_set(pairs, np.where(counts, weights, 0.0), about)
    assert_close(sums.values, expected(pairs.take(counts), weights[counts], about))
    before = OneStepSums.of_set(pairs, weights, about)
    dx, dy, turn = rng.uniform(-0.5, 0.5, 3)
    there = RigidTransform(about.x + dx, about.y + dy, about.theta + turn)
    found = expected(pairs, weights, there)
    assert_close(before.about(there).values, found)
    assert_close(before.costs(there, "mitsuta"), [found[6], found[8]])
    assert_close(before.costs(there, "wahba"), [found[6], 2.0 * found[9]])
    half = OneStepSums.of_set(pairs.take(slice(0, 3)), weights[:3], about)
    rest = OneStepSums.of_set(pairs.take(slice(3, 7)), weights[3:], there)
    np.testing.assert_allclose((half + rest).values, before.values, rtol=1e-9, atol=1e-9)


def test_an_angle_taken_out_across_the_wrap_is_gone() -> None:
    """With Alg. 1's principal values the sums would keep a multiple of 2 pi."""
    pairs = correspondences(directed([175, -175, 178]), MeasuredSegments.from_segments(directed([0, 0, 0])))
    sums = OneStepSums.of_set(pairs, np.ones(3), RigidTransform(0.0, 0.0, math.pi)).remove(pairs, 1, 1.0)
    assert math.degrees(sums.solve("mitsuta")[0].theta) == pytest.approx(176.5, abs=1e-9)


def test_a_reference_may_be_moved_across_the_wrap() -> None:
    pairs = correspondences(directed([175, -175, 178]), MeasuredSegments.from_segments(directed([0, 0, 0])))
    here, there = RigidTransform(0.0, 0.0, 3.0), RigidTransform(0.0, 0.0, -3.0)
    sums, fresh = (OneStepSums.of_set(pairs, np.ones(3), about) for about in (here, there))
    np.testing.assert_allclose(sums.about(there).values, fresh.values, atol=1e-12)
    assert sums.rotation_cost(there, "wahba") == pytest.approx(fresh.rotation_cost(there, "wahba"))
    assert sums.rotation_cost(there, "mitsuta") == pytest.approx(fresh.rotation_cost(there, "mitsuta"))


def test_sums_of_nothing() -> None:
    pairs = Correspondences.of(directed([0]), MeasuredSegments.from_segments(directed([0])), [])
    sums = OneStepSums.of_set(pairs, [])
    assert (sums.count, sums.reliability) == (0, 0.0)
    assert sums.solve("mitsuta") == (RigidTransform(0.0, 0.0, 0.0), False)


@pytest.mark.parametrize(
    ("degrees", "weights", "rotation", "expected"),
    [
        ([0, 0, 90], [1, 1, 1], "mitsuta", 30.0),
        ([0, 0, 90], [1, 1, 1], "wahba", math.degrees(math.atan(0.5))),
        ([10, 10, 10], [1, 1, 1], "mitsuta", 10.0),
        ([10, 10, 10], [1, 1, 1], "wahba", 10.0),
        ([170, -170, 175], [1, 1, 1], "mitsuta", 178.0 + 1.0 / 3.0),
        ([-170, 170], [1, 1], "mitsuta", 180.0),
        ([-90], [1], "wahba", -90.0),
        ([0, 60], [3, 1], "mitsuta", 15.0),
        ([0, 90], [3, 1], "wahba", math.degrees(math.atan2(1.0, 3.0))),
    ],
)
def test_mean_angles_in_closed_form(
    degrees: list[float], weights: list[float], rotation: Rotation, expected: float
) -> None:
    """Whatever the reference angle of the sums is."""
    pairs = correspondences(directed(degrees), MeasuredSegments.from_segments(directed(np.zeros(len(degrees)))))
    about = OneStepSums.of_set(pairs, weights).solve("wahba")[0].theta
    for off in np.radians([0.0, -40.0, 30.0, 50.0]):
        sums = OneStepSums.of_set(pairs, weights, RigidTransform(0.0, 0.0, about + off))
        assert math.degrees(sums.solve(rotation)[0].theta) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize(
    ("degrees", "expected"), [([0, 90], 1.0), ([0, 180], 0.0), ([0, 30], 0.5), ([0, 0, 90], 2.0 * math.sqrt(2.0) / 3.0)]
)
def test_reliability_in_closed_form(degrees: list[float], expected: float) -> None:
    pairs = correspondences(directed(degrees), MeasuredSegments.from_segments(directed(degrees)))
    sums = OneStepSums.of_set(pairs, np.ones(len(degrees)))
    assert sums.reliability == pytest.approx(expected, abs=1e-7)
    assert sums.determinant == pytest.approx((0.5 * expected * len(degrees)) ** 2, abs=1e-12)


def test_reliability_never_exceeds_1_by_rounding() -> None:
    found = []
    for first in np.linspace(0.0, 90.0, 200):
        cross = directed([first, first + 90.0])
        pairs = correspondences(cross, MeasuredSegments.from_segments(cross))
        found.append(OneStepSums.of_set(pairs, [0.1, 0.1]).reliability)
    assert max(found) == 1.0
