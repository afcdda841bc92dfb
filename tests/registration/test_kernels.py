"""The kernels of the sums do what their slow references do."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit
from numba.core.registry import CPUDispatcher as Dispatcher
from numpy.typing import NDArray

from registration import RigidTransform
from registration.kernels import compensated, joint, of_arrays, one_step
from registration.kernels import pairs as pairing
from registration.layout import JOINT_SUMS, ONE_STEP_SUMS, PAIR, SYMMETRIC3, Floats, Record, Records
from tests import reference

from .scenes import assert_close, correspondences, drawn, noisy_pairs

SEEDS = st.integers(0, 2**32 - 1)


def rows_of(normals: Floats, offsets: Floats, centroids: Floats, directions: Floats, spreads: Floats) -> Records:
    """Return rows of which only the joint sums are right: map lines by normal and offset."""
    rows = np.zeros(len(offsets), PAIR)
    rows["map"]["dx"], rows["map"]["dy"], rows["map"]["offset"] = normals[:, 1], -normals[:, 0], offsets
    rows["scan"]["dx"], rows["scan"]["dy"] = directions.T
    rows["scan"]["centroid_x"], rows["scan"]["centroid_y"], rows["scan"]["spread"] = *centroids.T, spreads
    return rows


def plain(sums: Records) -> Floats:
    """Return compensated sums as rows of doubles, values and errors."""
    return sums.view(np.float64).reshape(2, -1)


@given(SEEDS)
@settings(max_examples=20, deadline=None)
def test_joint_sums(seed: int) -> None:
    rng, pairs, weights, measured = drawn(seed)
    expected = reference.joint_sums(*measured)
    sums = joint.joint_sums_compensated(pairs.rows, weights)
    assert_close(plain(sums).sum(axis=0), expected)
    sums = np.zeros(1, JOINT_SUMS)
    for row, w in zip(pairs.rows, weights, strict=True):
        joint.joint_add(sums[0], row["map"], row["scan"], w, 1.0)
    assert_close(sums.view(np.float64), expected)
    for row, w in zip(pairs.rows, weights, strict=True):
        joint.joint_add(sums[0], row["map"], row["scan"], w, -1.0)
    np.testing.assert_allclose(sums.view(np.float64), 0.0, atol=1e-12 * np.abs(expected).max())
    counts = rng.random(7) < 0.5
    some = reference.joint_sums(*(values[counts] for values in measured))
    sums = joint.joint_sums_compensated(pairs.rows, np.where(counts, weights, 0.0))
    assert_close(plain(sums).sum(axis=0), some)


@given(SEEDS)
@settings(max_examples=20, deadline=None)
def test_joint_cost_and_information(seed: int) -> None:
    rng, pairs, weights, measured = drawn(seed)
    theta, x, y = rng.uniform(-3.0, 3.0, 3)
    sums = joint.joint_sums_compensated(pairs.rows, weights)[0]
    assert joint.joint_cost(sums, theta, x, y) == pytest.approx(
        reference.joint_cost(theta, np.array([x, y]), *measured), rel=1e-9
    )
    information = np.empty(1, SYMMETRIC3)
    joint.joint_information(sums, theta, information[0])
    assert_close(of_arrays.full_matrix(information), reference.joint_information(theta, *measured))


@given(SEEDS)
@settings(max_examples=5, deadline=None)
def test_joint_solve(seed: int) -> None:
    _, pairs, weights, measured = drawn(seed)
    sums = joint.joint_sums_compensated(pairs.rows, weights)[0]
    theta, x, y, cost, observable = joint.joint_solve(sums, 0.0, True)
    start = math.atan2(sums["wahba_sin"], sums["wahba_cos"])
    expected_theta, expected_t = reference.joint_solve(start, *measured)
    assert observable
    assert_close([theta, x, y], [expected_theta, *expected_t])
    assert cost == pytest.approx(reference.joint_cost(theta, np.array([x, y]), *measured), rel=1e-9)


@pytest.mark.parametrize("start", np.linspace(-3.0, 3.0, 13))
def test_joint_solve_ends_in_a_minimum_wherever_it_starts(start: float) -> None:
    _, pairs, weights, _ = drawn(3)
    sums = joint.joint_sums_compensated(pairs.rows, weights)[0]
    theta, x, y, cost, _ = joint.joint_solve(sums, start, False)
    for step in (-1e-3, 1e-3):
        assert cost < joint.joint_cost(sums, theta + step, x, y)
        assert cost < joint.joint_cost(sums, theta, x + step, y)
        assert cost < joint.joint_cost(sums, theta, x, y + step)


@pytest.mark.parametrize("seed", range(4))
def test_joint_solve_goes_down_into_the_valley_that_it_starts_in(seed: int) -> None:
    _, pairs, weights, measured = drawn(seed)
    sums = joint.joint_sums_compensated(pairs.rows, weights)[0]
    angles = np.linspace(-math.pi, math.pi, 721)
    costs = np.array([reference.least_cost(theta, *measured) for theta in angles[:-1]])
    for k in range(0, 720, 5):
        place = k
        while min(costs[place - 1], costs[(place + 1) % 720]) < costs[place]:
            place = min(((place - 1) % 720, (place + 1) % 720), key=lambda i: costs[i])
        theta, *_ = joint.joint_solve(sums, angles[k], False)
        assert abs(math.remainder(theta - angles[place], math.tau)) < 0.02, angles[k]


def test_joint_solve_gives_a_wrapped_angle_and_no_negative_cost() -> None:
    costs = []
    for seed in range(20):
        pose = RigidTransform(1.0, 2.0, -3.1)
        pairs = correspondences(*noisy_pairs(np.random.default_rng(seed), 7, noise=0.0, pose=pose))
        sums = joint.joint_sums_compensated(pairs.rows, np.ones(7))[0]
        theta, *_, cost, _ = joint.joint_solve(sums, 3.1, False)
        assert theta == pytest.approx(-3.1, abs=1e-9)
        costs += [cost, joint.joint_cost(sums, theta, 1.0, 2.0)]
    assert min(costs) == 0.0
    assert max(costs) < 1e-9


def test_joint_solve_of_parallel_lines_gives_the_shortest_translation() -> None:
    # Two walls along 0.5 rad that face each other, seen in place but for 2 m across.
    along, across = np.array([math.cos(0.5), math.sin(0.5)]), np.array([-math.sin(0.5), math.cos(0.5)])
    rows = rows_of(
        np.array([across, -across]),
        np.array([2.0, 1.0]),
        np.array([4.0 * along, 5.0 * along - 3.0 * across]),
        np.array([along, -along]),
        np.ones(2),
    )
    sums = joint.joint_sums_compensated(rows, np.ones(2))[0]
    theta, x, y, cost, observable = joint.joint_solve(sums, 0.0, True)
    assert not observable
    np.testing.assert_allclose([theta, x, y, cost], [0.0, *(2.0 * across), 0.0], atol=1e-12)


@given(SEEDS)
@settings(max_examples=20, deadline=None)
def test_one_step_sums(seed: int) -> None:
    rng, pairs, weights, _ = drawn(seed)
    x, y = rng.uniform(-5.0, 5.0, 2)
    alpha = 0.4 + rng.uniform(-1.0, 1.0)
    for counts in (np.full(7, True), rng.random(7) < 0.5):
        sums = one_step.one_step_sums(pairs.rows, x, y, alpha, np.where(counts, weights, 0.0))
        some = pairs.take(counts)
        expected = reference.one_step_sums(
            some.map_directions, some.map_midpoints, some.directions, some.midpoints, weights[counts], (x, y, alpha)
        )
        assert_close(plain(sums).sum(axis=0), expected)


@given(SEEDS)
@settings(max_examples=20, deadline=None)
def test_one_step_moved(seed: int) -> None:
    rng, pairs, weights, _ = drawn(seed)
    dx, dy, turn = rng.uniform(-0.5, 0.5, 3)

    def about(x: float, y: float, alpha: float) -> Floats:
        return reference.one_step_sums(
            pairs.map_directions, pairs.map_midpoints, pairs.directions, pairs.midpoints, weights, (x, y, alpha)
        )

    before = np.concatenate([about(1.0, 2.0, 0.3), np.zeros(12)]).view(ONE_STEP_SUMS)
    after = one_step.one_step_moved(before, dx, dy, turn)
    expected = about(1.0 + dx, 2.0 + dy, 0.3 + turn)
    assert_close(plain(after).sum(axis=0), expected)
    costs = one_step.one_step_costs(before, dx, dy, turn)
    assert_close(costs, [expected[6], expected[8], 2.0 * expected[9]])


@given(SEEDS)
@settings(max_examples=20, deadline=None)
def test_one_step_solve(seed: int) -> None:
    _, pairs, weights, _ = drawn(seed)
    values = reference.one_step_sums(
        pairs.map_directions, pairs.map_midpoints, pairs.directions, pairs.midpoints, weights, (0.0, 0.0, 0.0)
    ).view(ONE_STEP_SUMS)[0]
    rows = zip(pairs.map_directions, pairs.map_midpoints, pairs.directions, pairs.midpoints, strict=True)
    lines = [reference.transformation_line(*row) for row in rows]
    expected = reference.one_step_translation(lines, weights)

    angle, x, y, observable = one_step.one_step_solve(values, True)
    assert observable
    assert_close([x, y], expected)
    assert angle == pytest.approx(reference.wahba(pairs.map_directions, pairs.directions, weights), abs=1e-9)

    total, _ = reference.mitsuta([alpha for *_, alpha in lines], weights)
    mean, *_ = one_step.one_step_solve(values, False)
    assert mean == pytest.approx(total / weights.sum(), abs=1e-9)


@given(SEEDS)
@settings(max_examples=10, deadline=None)
def test_compensated_sums_are_exact(seed: int) -> None:
    rng = np.random.default_rng(seed)
    terms = rng.normal(size=(200, 4)) * 10.0 ** rng.integers(-8, 12, (200, 4))
    sums = np.zeros((2, 4))
    for row in terms:
        for k in range(4):
            sums[:, k] = compensated.accumulated(sums[0, k], sums[1, k], row[k], 0.0)
    np.testing.assert_array_equal(sums[0], reference.exact_sums(terms))
    flat: Any = sums.ravel()
    np.testing.assert_array_equal(compensated.compensated_sum(flat, flat, 1.0), 2.0 * flat)
    np.testing.assert_array_equal(compensated.compensated_sum(flat, flat, -1.0), 0.0)


@njit
def joint_change(sums: Records, row: Record, weight: float, alpha: float, shift: float, sign: float) -> None:
    """Add or remove a pair whose map line is shifted meanwhile."""
    offset = row.map.offset
    row.map.offset = offset + shift
    joint.joint_add_compensated(sums, row.map, row.scan, weight, sign)
    row.map.offset = offset


@njit
def one_step_change(sums: Records, row: Record, weight: float, alpha: float, shift: float, sign: float) -> None:
    gap = row.map.offset - pairing.offset_of(row.scan) + shift
    one_step.one_step_add(sums, row.map, row.scan, gap, alpha, weight, sign)


def churner(change: Callable[..., None]) -> Callable[..., None]:
    """Return a function that adds and removes a pair for each of `order`, at once and all together: four changes."""

    @njit
    def churn(sums: Records, rows: Records, weights: Floats, alpha: float, order: NDArray[np.int64]) -> None:
        for i in order:
            for sign in (1.0, -1.0):
                change(sums, rows[i], weights[i], alpha, 0.125, sign)
        for sign in (1.0, -1.0):
            for i in order:
                change(sums, rows[i], weights[i], alpha, 0.25, sign)

    return cast(Callable[..., None], churn)


@pytest.mark.parametrize("offset", [0.0, 5e6], ids=["near", "utm"])
@pytest.mark.parametrize(("change", "kind"), [(joint_change, JOINT_SUMS), (one_step_change, ONE_STEP_SUMS)])
def test_a_million_changes_leave_the_sums_of_what_remains(
    change: Callable[..., None], kind: np.dtype[np.void], offset: float
) -> None:
    rng, pairs, weights, _ = drawn(11, 40)
    rows = pairs.rows.copy()
    rows["map"]["offset"] += offset

    def fresh() -> Records:
        sums = np.zeros(2, kind)
        for row, weight in zip(rows, weights, strict=True):
            change(sums, row, weight, 0.3, 0.0, 1.0)
        return sums

    count = 250_000 if isinstance(joint_change, Dispatcher) else 2_500  # as plain Python a million would take minutes
    sums = fresh()
    change(sums, rows[0], weights[0], 0.3, 1e8, 1.0)
    churner(change)(sums, rows, weights, 0.3, rng.integers(0, 40, count))
    change(sums, rows[0], weights[0], 0.3, 1e8, -1.0)
    np.testing.assert_allclose(plain(sums)[0], plain(fresh())[0], rtol=1e-12, atol=0.0)
