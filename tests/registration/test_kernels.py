"""Every kernel does what its slow twin does."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit

from registration import _kernels, _one_step_kernels
from tests import reference

from .scenes import correspondences, noisy_pairs

SEEDS = st.integers(0, 2**32 - 1)
CLOSE = {"rtol": 1e-9, "atol": 1e-9}


def drawn(seed, n=7):
    rng = np.random.default_rng(seed)
    pairs = correspondences(*noisy_pairs(rng, n, noise=0.05))
    weights = rng.uniform(0.1, 2.0, n)
    joint = (pairs.map_normals, pairs.map_offsets, pairs.centroids, pairs.directions, pairs.spreads, weights)
    return rng, pairs, weights, joint


@given(SEEDS)
@settings(max_examples=20, deadline=None)
def test_joint_sums(seed):
    *_, joint = drawn(seed)
    expected = reference.joint_sums(*joint)
    np.testing.assert_allclose(_kernels.joint_sums(*joint), expected, **CLOSE)
    np.testing.assert_allclose(_kernels.joint_sums_compensated(*joint).sum(axis=0), expected, **CLOSE)


@given(SEEDS)
@settings(max_examples=20, deadline=None)
def test_joint_cost_and_information(seed):
    rng, _, _, joint = drawn(seed)
    theta, x, y = rng.uniform(-3.0, 3.0, 3)
    sums = _kernels.joint_sums(*joint)
    assert _kernels.joint_cost(sums, theta, x, y) == pytest.approx(
        reference.joint_cost(theta, np.array([x, y]), *joint), rel=1e-9
    )
    information = np.empty((3, 3))
    _kernels.joint_information(sums, theta, information)
    np.testing.assert_allclose(information, reference.joint_information(theta, *joint), **CLOSE)


@given(SEEDS)
@settings(max_examples=5, deadline=None)
def test_joint_solve(seed):
    *_, joint = drawn(seed)
    sums = _kernels.joint_sums(*joint)
    theta, x, y, cost, observable = _kernels.joint_solve(sums, 0.0, True)
    start = math.atan2(sums[_kernels.WAHBA_SIN], sums[_kernels.WAHBA_COS])
    expected_theta, expected_t = reference.joint_solve(start, *joint)
    assert observable
    np.testing.assert_allclose([theta, x, y], [expected_theta, *expected_t], **CLOSE)
    assert cost == pytest.approx(reference.joint_cost(theta, np.array([x, y]), *joint), rel=1e-9)


@pytest.mark.parametrize("start", np.linspace(-3.0, 3.0, 13))
def test_joint_solve_ends_in_a_minimum_wherever_it_starts(start):
    *_, joint = drawn(3)
    sums = _kernels.joint_sums(*joint)
    theta, x, y, cost, _ = _kernels.joint_solve(sums, start, False)
    for step in (-1e-3, 1e-3):
        assert cost < _kernels.joint_cost(sums, theta + step, x, y)
        assert cost < _kernels.joint_cost(sums, theta, x + step, y)
        assert cost < _kernels.joint_cost(sums, theta, x, y + step)


def test_joint_solve_of_parallel_lines_gives_the_shortest_translation():
    # Two walls along 0.5 rad that face each other, seen in place but for 2 m across.
    along, across = np.array([math.cos(0.5), math.sin(0.5)]), np.array([-math.sin(0.5), math.cos(0.5)])
    sums = _kernels.joint_sums(
        np.array([across, -across]),
        np.array([2.0, 1.0]),
        np.array([4.0 * along, 5.0 * along - 3.0 * across]),
        np.array([along, -along]),
        np.ones(2),
        np.ones(2),
    )
    theta, x, y, cost, observable = _kernels.joint_solve(sums, 0.0, True)
    assert not observable
    np.testing.assert_allclose([theta, x, y, cost], [0.0, *(2.0 * across), 0.0], atol=1e-12)


@given(SEEDS)
@settings(max_examples=20, deadline=None)
def test_one_step_sums(seed):
    rng, pairs, weights, _ = drawn(seed)
    at = (*rng.uniform(-5.0, 5.0, 2), 0.4 + rng.uniform(-1.0, 1.0))
    gaps = np.einsum("ij,ij->i", pairs.map_normals, pairs.map_midpoints - at[:2]) - pairs.offsets
    sums = _one_step_kernels.one_step_sums(pairs.map_directions, gaps, pairs.directions, at[2], weights)
    expected = reference.one_step_sums(
        pairs.map_directions, pairs.map_midpoints, pairs.directions, pairs.midpoints, weights, at
    )
    np.testing.assert_allclose(sums.sum(axis=0), expected, **CLOSE)


@given(SEEDS)
@settings(max_examples=20, deadline=None)
def test_one_step_moved(seed):
    rng, pairs, weights, _ = drawn(seed)
    dx, dy, turn = rng.uniform(-0.5, 0.5, 3)

    def about(x, y, alpha):
        return reference.one_step_sums(
            pairs.map_directions, pairs.map_midpoints, pairs.directions, pairs.midpoints, weights, (x, y, alpha)
        )

    before = np.stack([about(1.0, 2.0, 0.3), np.zeros(12)])
    after = _one_step_kernels.one_step_moved(before, dx, dy, turn)
    np.testing.assert_allclose(after.sum(axis=0), about(1.0 + dx, 2.0 + dy, 0.3 + turn), **CLOSE)


@given(SEEDS)
@settings(max_examples=20, deadline=None)
def test_one_step_solve(seed):
    _, pairs, weights, _ = drawn(seed)
    values = reference.one_step_sums(
        pairs.map_directions, pairs.map_midpoints, pairs.directions, pairs.midpoints, weights, (0.0, 0.0, 0.0)
    )
    rows = zip(pairs.map_directions, pairs.map_midpoints, pairs.directions, pairs.midpoints, strict=True)
    lines = [reference.transformation_line(*row) for row in rows]
    expected = reference.one_step_translation(lines, weights)

    angle, x, y, observable = _one_step_kernels.one_step_solve(values, True)
    assert observable
    np.testing.assert_allclose([x, y], expected, **CLOSE)
    assert angle == pytest.approx(reference.wahba(pairs.map_directions, pairs.directions, weights), abs=1e-9)

    total, _ = reference.mitsuta([alpha for *_, alpha in lines], weights)
    mean, *_ = _one_step_kernels.one_step_solve(values, False)
    assert mean == pytest.approx(total / weights.sum(), abs=1e-9)


@given(SEEDS)
@settings(max_examples=10, deadline=None)
def test_compensated_sums_are_exact(seed):
    rng = np.random.default_rng(seed)
    terms = rng.normal(size=(200, 4)) * 10.0 ** rng.integers(-8, 12, (200, 4))
    sums = np.zeros((2, 4))
    for row in terms:
        for k in range(4):
            _kernels.accumulate(sums, k, row[k], 0.0)
    np.testing.assert_array_equal(sums[0], reference.exact_sums(terms))
    _kernels.compensated_add(sums, sums.copy(), -1.0)
    np.testing.assert_array_equal(sums, 0.0)


@njit
def change(sums, normals, offsets, centroids, directions, spreads, weights, row, shift, sign):
    _kernels.joint_add_compensated(
        sums,
        normals[row, 0],
        normals[row, 1],
        offsets[row] + shift,
        centroids[row, 0],
        centroids[row, 1],
        directions[row, 0],
        directions[row, 1],
        spreads[row],
        weights[row],
        sign,
    )


@njit
def churn(sums, normals, offsets, centroids, directions, spreads, weights, rows):
    """Add and remove a pair per row, at once and all together: four changes each."""
    for row in rows:
        for sign in (1.0, -1.0):
            change(sums, normals, offsets, centroids, directions, spreads, weights, row, 0.125, sign)
    for sign in (1.0, -1.0):
        for row in rows:
            change(sums, normals, offsets, centroids, directions, spreads, weights, row, 0.25, sign)


@pytest.mark.parametrize("offset", [0.0, 5e6], ids=["near", "utm"])
def test_a_million_changes_leave_the_sums_of_what_remains(offset):
    rng, pairs, weights, _ = drawn(11, 40)
    map_offsets = pairs.map_offsets + offset
    kept = (pairs.map_normals, map_offsets, pairs.centroids, pairs.directions, pairs.spreads, weights)
    sums = _kernels.joint_sums_compensated(*kept)

    change(sums, *kept, 0, 1e8, 1.0)
    rows = rng.integers(0, 40, 250_000)
    churn(sums, *kept, rows)
    change(sums, *kept, 0, 1e8, -1.0)
    np.testing.assert_allclose(sums[0], _kernels.joint_sums_compensated(*kept)[0], rtol=1e-12, atol=0.0)
