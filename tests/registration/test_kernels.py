"""Sums and their solutions are those of their slow references."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from registration import Correspondences, JointSums, OneStepSums, RigidTransform
from registration.kernels import joint_add, joint_cost, joint_information, joint_solve, one_step_add
from registration.layout import JOINT_SUMS, LINE, ONE_STEP_SUMS, SEEN, SYMMETRIC3, Floats, Record, Records
from tests import reference

from .scenes import assert_close, correspondences, drawn, noisy_pairs

SEEDS = st.integers(0, 2**32 - 1)
FULL = np.array([[0, 1, 2], [1, 3, 4], [2, 4, 5]])
MEASURED = ("map_normals", "map_offsets", "centroids", "directions", "spreads")
Rows = tuple[Records, Records]


def rows_of(normals: Floats, offsets: Floats, centroids: Floats, directions: Floats, spreads: Floats) -> Rows:
    """Return map lines, by normal and offset, and what was seen on each, as the kernels take them."""
    lines, seen = np.zeros(len(offsets), LINE), np.zeros(len(offsets), SEEN)
    lines["dx"], lines["dy"], lines["offset"] = normals[:, 1], -normals[:, 0], offsets
    seen["dx"], seen["dy"] = directions.T
    seen["centroid_x"], seen["centroid_y"], seen["spread"] = *centroids.T, spreads
    return lines, seen


def joint_of(measured: Sequence[Floats]) -> Record:
    """Return the joint sums of pairs."""
    sums = np.zeros(1, JOINT_SUMS)
    for line, seen, weight in zip(*rows_of(*measured[:-1]), measured[-1], strict=True):
        joint_add(sums[0], line, seen, weight, 1.0)
    return sums[0]


@given(SEEDS)
@settings(max_examples=20, deadline=None)
def test_joint_sums(seed: int) -> None:
    rng, pairs, weights, measured = drawn(seed)
    expected = reference.joint_sums(*measured)
    assert_close(JointSums.of_set(pairs, weights).values, expected)
    assert_close(joint_of(measured).tolist(), expected)
    sums = np.array([tuple(expected)], JOINT_SUMS)
    for line, seen, weight in zip(*rows_of(*measured[:-1]), weights, strict=True):
        joint_add(sums[0], line, seen, weight, -1.0)
    np.testing.assert_allclose(sums.view(np.float64), 0.0, atol=1e-12 * np.abs(expected).max())
    counts = rng.random(7) < 0.5
    some = reference.joint_sums(*(values[counts] for values in measured))
    assert_close(JointSums.of_set(pairs, np.where(counts, weights, 0.0)).values, some)


@given(SEEDS)
@settings(max_examples=20, deadline=None)
def test_joint_cost_and_information(seed: int) -> None:
    rng, *_, measured = drawn(seed)
    theta, x, y = rng.uniform(-3.0, 3.0, 3)
    sums = joint_of(measured)
    assert joint_cost(sums, theta, x, y) == pytest.approx(
        reference.joint_cost(theta, np.array([x, y]), *measured), rel=1e-9
    )
    information = np.empty(1, SYMMETRIC3)
    joint_information(sums, theta, information[0])
    assert_close(information.view(np.float64)[FULL], reference.joint_information(theta, *measured))


@given(SEEDS)
@settings(max_examples=5, deadline=None)
def test_joint_solve(seed: int) -> None:
    *_, measured = drawn(seed)
    sums = joint_of(measured)
    theta, x, y, cost, observable = joint_solve(sums, 0.0, True)
    start = math.atan2(sums["wahba_sin"], sums["wahba_cos"])
    expected_theta, expected_t = reference.joint_solve(start, *measured)
    assert observable
    assert_close([theta, x, y], [expected_theta, *expected_t])
    assert cost == pytest.approx(reference.joint_cost(theta, np.array([x, y]), *measured), rel=1e-9)


@pytest.mark.parametrize("start", np.linspace(-3.0, 3.0, 13))
def test_joint_solve_ends_in_a_minimum_wherever_it_starts(start: float) -> None:
    *_, measured = drawn(3)
    sums = joint_of(measured)
    theta, x, y, cost, _ = joint_solve(sums, start, False)
    for step in (-1e-3, 1e-3):
        assert cost < joint_cost(sums, theta + step, x, y)
        assert cost < joint_cost(sums, theta, x + step, y)
        assert cost < joint_cost(sums, theta, x, y + step)


@pytest.mark.parametrize("seed", range(4))
def test_joint_solve_goes_down_into_the_valley_that_it_starts_in(seed: int) -> None:
    *_, measured = drawn(seed)
    sums = joint_of(measured)
    angles = np.linspace(-math.pi, math.pi, 721)
    costs = np.array([reference.least_cost(theta, *measured) for theta in angles[:-1]])
    for k in range(0, 720, 5):
        place = k
        while min(costs[place - 1], costs[(place + 1) % 720]) < costs[place]:
            place = min(((place - 1) % 720, (place + 1) % 720), key=lambda i: costs[i])
        theta, *_ = joint_solve(sums, angles[k], False)
        assert abs(math.remainder(theta - angles[place], math.tau)) < 0.02, angles[k]


def test_joint_solve_gives_a_wrapped_angle_and_no_negative_cost() -> None:
    costs = []
    for seed in range(20):
        pose = RigidTransform(1.0, 2.0, -3.1)
        pairs = correspondences(*noisy_pairs(np.random.default_rng(seed), 7, noise=0.0, pose=pose))
        sums = joint_of((*(getattr(pairs, name) for name in MEASURED), np.ones(7)))
        theta, *_, cost, _ = joint_solve(sums, 3.1, False)
        assert theta == pytest.approx(-3.1, abs=1e-9)
        costs += [cost, joint_cost(sums, theta, 1.0, 2.0)]
    assert min(costs) == 0.0
    assert max(costs) < 1e-9


def test_joint_solve_of_parallel_lines_gives_the_shortest_translation() -> None:
    # Two walls along 0.5 rad that face each other, seen in place but for 2 m across.
    along, across = np.array([math.cos(0.5), math.sin(0.5)]), np.array([-math.sin(0.5), math.cos(0.5)])
    measured = (
        np.array([across, -across]),
        np.array([2.0, 1.0]),
        np.array([4.0 * along, 5.0 * along - 3.0 * across]),
        np.array([along, -along]),
        np.ones(2),
        np.ones(2),
    )
    sums = joint_of(measured)
    theta, x, y, cost, observable = joint_solve(sums, 0.0, True)
    assert not observable
    np.testing.assert_allclose([theta, x, y, cost], [0.0, *(2.0 * across), 0.0], atol=1e-12)


@given(SEEDS)
@settings(max_examples=20, deadline=None)
def test_one_step_sums(seed: int) -> None:
    rng, pairs, weights, _ = drawn(seed)
    x, y = rng.uniform(-5.0, 5.0, 2)
    alpha = 0.4 + rng.uniform(-1.0, 1.0)
    for counts in (np.full(7, True), rng.random(7) < 0.5):
        about = RigidTransform(x, y, alpha)
        sums = OneStepSums.of_set(pairs, np.where(counts, weights, 0.0), about)
        some = pairs.take(counts)
        expected = reference.one_step_sums(
            some.map_directions, some.map_midpoints, some.directions, some.midpoints, weights[counts], (x, y, alpha)
        )
        assert_close(sums.values, expected)
        added = np.zeros(2, ONE_STEP_SUMS)
        for k in np.flatnonzero(counts):
            change_one_step(added, pairs, int(k), weights[k], about, 1.0)
        assert_close(added.view(np.float64).reshape(2, -1).sum(axis=0), expected)


@given(SEEDS)
@settings(max_examples=20, deadline=None)
def test_one_step_moved(seed: int) -> None:
    rng, pairs, weights, _ = drawn(seed)
    dx, dy, turn = rng.uniform(-0.5, 0.5, 3)

    def about(x: float, y: float, alpha: float) -> Floats:
        return reference.one_step_sums(
            pairs.map_directions, pairs.map_midpoints, pairs.directions, pairs.midpoints, weights, (x, y, alpha)
        )

    before = OneStepSums.of_set(pairs, weights, RigidTransform(1.0, 2.0, 0.3))
    at = RigidTransform(1.0 + dx, 2.0 + dy, 0.3 + turn)
    expected = about(at.x, at.y, at.theta)
    assert_close(before.about(at).values, expected)
    assert_close(before.costs(at, "mitsuta"), [expected[6], expected[8]])
    assert_close(before.costs(at, "wahba"), [expected[6], 2.0 * expected[9]])


@given(SEEDS)
@settings(max_examples=20, deadline=None)
def test_one_step_solve(seed: int) -> None:
    _, pairs, weights, _ = drawn(seed)
    sums = OneStepSums.of_set(pairs, weights)
    rows = zip(pairs.map_directions, pairs.map_midpoints, pairs.directions, pairs.midpoints, strict=True)
    lines = [reference.transformation_line(*row) for row in rows]
    expected = reference.one_step_translation(lines, weights)

    found, observable = sums.solve("wahba")
    assert observable
    assert_close([found.x, found.y], expected)
    assert found.theta == pytest.approx(reference.wahba(pairs.map_directions, pairs.directions, weights), abs=1e-9)

    total, _ = reference.mitsuta([alpha for *_, alpha in lines], weights)
    assert sums.solve("mitsuta")[0].theta == pytest.approx(total / weights.sum(), abs=1e-9)


@given(SEEDS)
@settings(max_examples=10, deadline=None)
def test_sums_are_exact_but_for_the_last_rounding(seed: int) -> None:
    _, pairs, weights, _ = drawn(seed, 200)
    weights = weights * 10.0 ** np.random.default_rng(seed).integers(-8, 12, 200)
    alone = [JointSums.of_pair(pairs, k, weight).values for k, weight in enumerate(weights)]
    sums = JointSums.of_set(pairs, weights)
    np.testing.assert_allclose(sums.values, reference.exact_sums(np.array(alone)), rtol=1e-15)
    np.testing.assert_array_equal((sums + sums).compensated, 2.0 * sums.compensated)
    np.testing.assert_array_equal((sums - sums).compensated, 0.0)


def change_one_step(
    sums: Records, pairs: Correspondences, k: int, weight: float, about: RigidTransform, sign: float
) -> None:
    """Add or remove pair k about a reference."""
    line, seen = np.zeros(1, LINE), np.zeros(1, SEEN)
    (line["dx"], line["dy"]), (seen["dx"], seen["dy"]) = pairs.map_directions[k], pairs.directions[k]
    gap = pairs.map_offsets[k] - pairs.map_normals[k] @ [about.x, about.y] - pairs.offsets[k]
    one_step_add(sums, line[0], seen[0], gap, about.theta, weight, sign)


@pytest.mark.parametrize("kind", [JointSums, OneStepSums])
def test_many_changes_leave_the_sums_of_what_remains(kind: type[JointSums | OneStepSums]) -> None:
    rng, pairs, weights, _ = drawn(11, 40)
    far = pairs.about((1e8, -1e8), (1e8, 0.0))
    fresh = kind.of_set(pairs, weights)
    sums = fresh.add(far, 0, 1.0)
    for i in rng.integers(0, 40, 1000).tolist():
        sums = sums.add(pairs, i, weights[i]).remove(pairs, i, weights[i])
    np.testing.assert_allclose(sums.remove(far, 0, 1.0).values, fresh.values, rtol=1e-12)


def test_compiled_changes_of_the_papers_sums_leave_no_trace() -> None:
    rng, pairs, weights, _ = drawn(11, 40)
    about, sums = RigidTransform(0.0, 0.0, 0.3), np.zeros(2, ONE_STEP_SUMS)
    for k in range(40):
        change_one_step(sums, pairs, k, weights[k], about, 1.0)
    expected = sums.copy()
    far = pairs.about((1e8, -1e8), (0.0, 0.0))
    change_one_step(sums, far, 0, 1.0, about, 1.0)
    for k in rng.integers(0, 40, 500).tolist():
        for sign in (1.0, -1.0):
            change_one_step(sums, pairs, k, weights[k], about, sign)
    change_one_step(sums, far, 0, 1.0, about, -1.0)
    found = sums.view(np.float64).reshape(2, -1)[0]
    np.testing.assert_allclose(found, expected.view(np.float64).reshape(2, -1)[0], rtol=1e-12)
