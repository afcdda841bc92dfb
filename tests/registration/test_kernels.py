"""Every kernel does what its slow twin does."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit

from registration import Correspondences, RigidTransform, _kernels, _matrix_kernels, _one_step_kernels, _pair_kernels
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


def rows_of(normals, offsets, centroids, directions, spreads):
    """Return rows of which only the joint sums are right: map lines by normal and offset."""
    rows = np.zeros((len(offsets), _pair_kernels.PAIR_COLUMNS))
    pairs = Correspondences(rows)
    pairs.map_directions[:] = np.stack([normals[:, 1], -normals[:, 0]], axis=1)
    pairs.map_midpoints[:] = offsets[:, None] * normals
    pairs.centroids[:], pairs.directions[:], pairs.spreads[:] = centroids, directions, spreads
    return rows


@given(SEEDS)
@settings(max_examples=20, deadline=None)
def test_joint_sums(seed):
    rng, pairs, weights, joint = drawn(seed)
    sums = _kernels.joint_sums_compensated(pairs.rows, weights)
    np.testing.assert_allclose(sums.sum(axis=0), reference.joint_sums(*joint), **CLOSE)
    plain = np.zeros(_kernels.JOINT_SIZE)
    for n, p, m, d, spread, w in zip(*joint, strict=True):
        _kernels.joint_add(plain, *n, p, *m, *d, spread, w, 1.0)
    np.testing.assert_allclose(plain, reference.joint_sums(*joint), **CLOSE)
    counts = rng.random(7) < 0.5
    some = reference.joint_sums(*(values[counts] for values in joint))
    sums = _kernels.joint_sums_compensated(pairs.rows, np.where(counts, weights, 0.0))
    np.testing.assert_allclose(sums.sum(axis=0), some, **CLOSE)


@given(SEEDS)
@settings(max_examples=20, deadline=None)
def test_joint_cost_and_information(seed):
    rng, pairs, weights, joint = drawn(seed)
    theta, x, y = rng.uniform(-3.0, 3.0, 3)
    sums = _kernels.joint_sums_compensated(pairs.rows, weights)[0]
    assert _kernels.joint_cost(sums, theta, x, y) == pytest.approx(
        reference.joint_cost(theta, np.array([x, y]), *joint), rel=1e-9
    )
    information = np.empty((3, 3))
    _kernels.joint_information(sums, theta, information)
    np.testing.assert_allclose(information, reference.joint_information(theta, *joint), **CLOSE)


@given(SEEDS)
@settings(max_examples=5, deadline=None)
def test_joint_solve(seed):
    _, pairs, weights, joint = drawn(seed)
    sums = _kernels.joint_sums_compensated(pairs.rows, weights)[0]
    theta, x, y, cost, observable = _kernels.joint_solve(sums, 0.0, True)
    start = math.atan2(sums[_kernels.WAHBA_SIN], sums[_kernels.WAHBA_COS])
    expected_theta, expected_t = reference.joint_solve(start, *joint)
    assert observable
    np.testing.assert_allclose([theta, x, y], [expected_theta, *expected_t], **CLOSE)
    assert cost == pytest.approx(reference.joint_cost(theta, np.array([x, y]), *joint), rel=1e-9)


@pytest.mark.parametrize("start", np.linspace(-3.0, 3.0, 13))
def test_joint_solve_ends_in_a_minimum_wherever_it_starts(start):
    _, pairs, weights, _ = drawn(3)
    sums = _kernels.joint_sums_compensated(pairs.rows, weights)[0]
    theta, x, y, cost, _ = _kernels.joint_solve(sums, start, False)
    for step in (-1e-3, 1e-3):
        assert cost < _kernels.joint_cost(sums, theta + step, x, y)
        assert cost < _kernels.joint_cost(sums, theta, x + step, y)
        assert cost < _kernels.joint_cost(sums, theta, x, y + step)


def test_joint_solve_of_parallel_lines_gives_the_shortest_translation():
    # Two walls along 0.5 rad that face each other, seen in place but for 2 m across.
    along, across = np.array([math.cos(0.5), math.sin(0.5)]), np.array([-math.sin(0.5), math.cos(0.5)])
    rows = rows_of(
        np.array([across, -across]),
        np.array([2.0, 1.0]),
        np.array([4.0 * along, 5.0 * along - 3.0 * across]),
        np.array([along, -along]),
        np.ones(2),
    )
    sums = _kernels.joint_sums_compensated(rows, np.ones(2))[0]
    theta, x, y, cost, observable = _kernels.joint_solve(sums, 0.0, True)
    assert not observable
    np.testing.assert_allclose([theta, x, y, cost], [0.0, *(2.0 * across), 0.0], atol=1e-12)


@given(SEEDS)
@settings(max_examples=20, deadline=None)
def test_one_step_sums(seed):
    rng, pairs, weights, _ = drawn(seed)
    at = (*rng.uniform(-5.0, 5.0, 2), 0.4 + rng.uniform(-1.0, 1.0))
    for counts in (np.full(7, True), rng.random(7) < 0.5):
        sums = _one_step_kernels.one_step_sums(pairs.rows, *at, np.where(counts, weights, 0.0))
        some = pairs.take(counts)
        expected = reference.one_step_sums(
            some.map_directions, some.map_midpoints, some.directions, some.midpoints, weights[counts], at
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
    expected = about(1.0 + dx, 2.0 + dy, 0.3 + turn)
    np.testing.assert_allclose(after.sum(axis=0), expected, **CLOSE)
    costs = _one_step_kernels.one_step_costs(before, dx, dy, turn)
    np.testing.assert_allclose(costs, [expected[6], expected[8], 2.0 * expected[9]], **CLOSE)


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


@njit
def one_step_total(map_directions, gaps, directions, alpha, weights):
    sums = np.zeros((2, _one_step_kernels.ONE_STEP_SIZE))
    for row in range(len(weights)):
        one_step_change(sums, map_directions, gaps, directions, alpha, weights, row, 0.0, 1.0)
    return sums


@njit
def one_step_churn(sums, map_directions, gaps, directions, alpha, weights, rows):
    """Add and remove a pair per row, at once and all together: four changes each."""
    for row in rows:
        for sign in (1.0, -1.0):
            one_step_change(sums, map_directions, gaps, directions, alpha, weights, row, 0.125, sign)
    for sign in (1.0, -1.0):
        for row in rows:
            one_step_change(sums, map_directions, gaps, directions, alpha, weights, row, 0.25, sign)


@njit
def one_step_change(sums, map_directions, gaps, directions, alpha, weights, row, shift, sign):
    _one_step_kernels.one_step_add(
        sums,
        map_directions[row, 0],
        map_directions[row, 1],
        gaps[row] + shift,
        directions[row, 0],
        directions[row, 1],
        alpha,
        weights[row],
        sign,
    )


@pytest.mark.parametrize("offset", [0.0, 5e6], ids=["near", "utm"])
def test_a_million_changes_leave_the_one_step_sums_of_what_remains(offset):
    rng, pairs, weights, _ = drawn(11, 40)
    gaps = np.einsum("ij,ij->i", pairs.map_normals, pairs.map_midpoints) - pairs.offsets + offset
    kept = (pairs.map_directions, gaps, pairs.directions, 0.3, weights)
    sums = one_step_total(*kept)

    one_step_change(sums, *kept, 0, 1e8, 1.0)
    one_step_churn(sums, *kept, rng.integers(0, 40, 250_000))
    one_step_change(sums, *kept, 0, 1e8, -1.0)
    np.testing.assert_allclose(sums[0], one_step_total(*kept)[0], rtol=1e-12, atol=0.0)


@pytest.mark.parametrize("offset", [0.0, 5e6], ids=["near", "utm"])
def test_a_million_changes_leave_the_sums_of_what_remains(offset):
    rng, pairs, weights, _ = drawn(11, 40)
    map_offsets = pairs.map_offsets + offset
    kept = (pairs.map_normals, map_offsets, pairs.centroids, pairs.directions, pairs.spreads, weights)
    rows_kept = rows_of(*kept[:-1])
    sums = _kernels.joint_sums_compensated(rows_kept, weights)

    change(sums, *kept, 0, 1e8, 1.0)
    rows = rng.integers(0, 40, 250_000)
    churn(sums, *kept, rows)
    change(sums, *kept, 0, 1e8, -1.0)
    np.testing.assert_allclose(sums[0], _kernels.joint_sums_compensated(rows_kept, weights)[0], rtol=1e-12, atol=0.0)


@given(SEEDS)
@settings(max_examples=20, deadline=None)
def test_gather(seed):
    rng = np.random.default_rng(seed)
    map_segments, scan = noisy_pairs(rng, 9)
    scan = replace(scan, sigma=rng.choice([0.0, 1e-200, 1e-12, 0.3], 9))
    pairs = np.stack([rng.integers(0, 9, 12), rng.integers(0, 9, 12)], axis=1)
    s, m = scan.segments, map_segments
    rows = _pair_kernels.gather(
        pairs, m.directions, m.midpoints, m.lengths, s.directions, s.midpoints, s.lengths, scan.centroids, scan.spreads,
        scan.sigma, scan.points,
    )  # fmt: skip
    np.testing.assert_array_equal(rows, reference.pair_rows(map_segments, scan, pairs))
    for least in (0.0, 0.25):
        inverses, known = _pair_kernels.inverse_variances(rows, least)
        assert known == bool((scan.sigma[pairs[:, 0]] > 0.0).all() or least > 0.0)
        if known:
            np.testing.assert_allclose(inverses, 1.0 / (rows[:, 13] + least), rtol=1e-15)


def test_first_outside():
    pairs = np.array([[0, 3], [4, 0], [1, -1], [5, 2]])
    assert [_pair_kernels.first_outside(pairs, 0, count) for count in (6, 5, 4, 0)] == [-1, 3, 1, 0]
    assert [_pair_kernels.first_outside(pairs, 1, count) for count in (4, 3)] == [2, 0]


@given(SEEDS)
@settings(max_examples=20, deadline=None)
def test_middles_and_moved_origins(seed):
    rng, pairs, weights, _ = drawn(seed)
    counts = np.append(rng.random(6) < 0.5, True)
    some = pairs.take(counts)
    *middles, count = _pair_kernels.middles(pairs.rows, np.where(counts, weights, 0.0))
    np.testing.assert_allclose(middles, [*some.map_midpoints.mean(axis=0), *some.centroids.mean(axis=0)], **CLOSE)
    assert count == counts.sum()
    expected = pairs.rows.copy()
    expected[:, 2:4] -= middles[:2]
    expected[:, 7:9] -= middles[2:]
    expected[:, 10:12] -= middles[2:]
    np.testing.assert_array_equal(_pair_kernels.moved_origins(pairs.rows, *middles), expected)


@given(SEEDS)
@settings(max_examples=20, deadline=None)
def test_residuals(seed):
    rng, pairs, weights, joint = drawn(seed)
    at = RigidTransform(*rng.uniform(-3.0, 3.0, 3))
    counts = np.append(rng.random(6) < 0.5, True)
    offsets, angles, chi2, rms_offset, rms_angle = _pair_kernels.residuals(
        pairs.rows, np.where(counts, 1.0, 0.0), np.where(counts, weights, 0.0), at.theta, at.x, at.y
    )
    expected = np.sum(pairs.map_normals * at.apply(pairs.midpoints), axis=1) - pairs.map_offsets
    np.testing.assert_allclose(offsets, expected, **CLOSE)
    rows = zip(pairs.map_directions, pairs.map_midpoints, pairs.directions, pairs.midpoints, strict=True)
    alphas = [reference.transformation_line(*row)[2] for row in rows]
    turns = [math.remainder(alpha - at.theta, math.tau) for alpha in alphas]
    np.testing.assert_allclose(angles, turns, **CLOSE)
    np.testing.assert_array_equal(_pair_kernels.relative_angles(pairs.rows, at.theta), angles)
    cost = reference.joint_cost(at.theta, np.array([at.x, at.y]), *(values[counts] for values in joint))
    assert chi2 == pytest.approx(cost, rel=1e-9)
    assert rms_offset == pytest.approx(math.sqrt(np.mean(offsets[counts] ** 2)))
    assert rms_angle == pytest.approx(math.sqrt(np.mean(angles[counts] ** 2)))


def definite(rng, size, spread=3.0):
    """Draw a positive definite matrix whose rows differ in size by powers of ten."""
    root = rng.normal(size=(size, size + 1))
    scale = 10.0 ** rng.uniform(-spread, spread, size)
    return (root @ root.T) * np.outer(scale, scale)


@given(SEEDS)
@settings(max_examples=100, deadline=None)
def test_eigen2(seed):
    rng = np.random.default_rng(seed)
    matrix = definite(rng, 2)
    small, big, x, y = _matrix_kernels.eigen2(matrix[0, 0], matrix[0, 1], matrix[1, 1])
    values, axes = np.linalg.eigh(matrix)
    np.testing.assert_allclose([small, big], values, rtol=1e-12, atol=1e-14 * values[1])
    assert math.hypot(x, y) == pytest.approx(1.0, rel=1e-15)
    assert abs(axes[:, 0] @ [x, y]) == pytest.approx(1.0, rel=1e-12)


def test_eigen2_of_what_has_no_one_axis():
    for a in (0.0, 2.0):
        small, big, x, y = _matrix_kernels.eigen2(a, 0.0, a)
        np.testing.assert_allclose((small, big, x, y), (a, a, 1.0, 0.0), atol=1e-15)
    assert _matrix_kernels.eigen2(1.0, 1.0, 1.0)[0] == 0.0


@given(SEEDS, st.sampled_from([1e-12, 1e-6, 1e-2]))
@settings(max_examples=100, deadline=None)
def test_is_regular3(seed, least):
    rng = np.random.default_rng(seed)
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    matrix = (axes * [1.0, 1.0, 10.0 ** rng.uniform(-8.0, 0.0)]) @ axes.T
    scale = np.sqrt(np.diag(matrix))
    smallest = np.linalg.eigvalsh(matrix / np.outer(scale, scale))[0]
    units = 10.0 ** rng.uniform(-3.0, 3.0, 3)
    if abs(smallest - least) > 1e-9 * least:
        assert _matrix_kernels.is_regular3(matrix * np.outer(units, units), least) == (smallest > least)


def test_is_regular3_of_what_is_not():
    assert not _matrix_kernels.is_regular3(np.diag([1.0, 0.0, 1.0]), 1e-12)
    for row in ([1.0, 1.0, 1.0], [1.0, -2.0, 0.0], [0.5, 0.0, 1e3]):
        assert not _matrix_kernels.is_regular3(np.outer(row, row), 1e-12)
    assert not _matrix_kernels.is_regular3(np.array([[1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 1.0]]), 1e-12)
    # Two eigenvalues are small, the least of them on one side of 1e-12 or the other.
    for gap, regular in ((1e-11, True), (1e-13, False)):
        assert _matrix_kernels.is_regular3(np.ones((3, 3)) + 2.0 * gap * np.eye(3), 1e-12) is regular


@given(SEEDS)
@settings(max_examples=100, deadline=None)
def test_matrix_invert3_and_carried(seed):
    rng = np.random.default_rng(seed)
    matrix = definite(rng, 3)
    scale = np.sqrt(np.diag(matrix))
    inverse = _matrix_kernels.invert3(matrix)
    np.testing.assert_array_equal(inverse, inverse.T)
    product = (inverse * np.outer(scale, scale)) @ (matrix / np.outer(scale, scale))
    condition = np.linalg.cond(matrix / np.outer(scale, scale))
    np.testing.assert_allclose(product, np.eye(3), atol=1e-14 * condition)
    x, y = rng.uniform(-5.0, 5.0, 2)
    lever = np.array([[1.0, 0.0, y], [0.0, 1.0, -x], [0.0, 0.0, 1.0]])
    expected = lever @ matrix @ lever.T
    np.testing.assert_allclose(_matrix_kernels.carried(matrix, x, y), expected, rtol=1e-12, atol=1e-12 * expected.max())
