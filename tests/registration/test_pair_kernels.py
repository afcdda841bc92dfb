"""Kernels that gather pairs, and those of small matrices, give what their references do."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from registration import Correspondences, RigidTransform
from registration.kernels import matrices, of_arrays
from registration.kernels import pairs as pairing
from registration.layout import SYMMETRIC3, Floats
from tests import reference

from .scenes import assert_close, drawn, noisy_pairs, symmetric

SEEDS = st.integers(0, 2**32 - 1)


@given(SEEDS)
@settings(max_examples=20, deadline=None)
def test_gather(seed: int) -> None:
    rng = np.random.default_rng(seed)
    map_segments, scan = noisy_pairs(rng, 9)
    scan = replace(scan, sigma=rng.choice([0.0, 1e-200, 1e-12, 0.3], 9))
    pairs = np.stack([rng.integers(0, 9, 12), rng.integers(0, 9, 12)], axis=1)
    rows = Correspondences.of(map_segments, scan, pairs).rows
    np.testing.assert_array_equal(rows, reference.pair_rows(map_segments, scan, pairs))
    for least in (0.0, 0.25):
        inverses, known = pairing.inverse_variances(rows, least)
        assert known == bool((scan.sigma[pairs[:, 0]] > 0.0).all() or least > 0.0)
        if known:
            np.testing.assert_allclose(inverses, 1.0 / (rows["scan"]["variance"] + least), rtol=1e-15)


def test_first_outside() -> None:
    pairs = np.array([[0, 3], [4, 0], [1, -1], [5, 2]])
    in_scan, on_map = [(-1, 0), (3, 0), (1, 0), (0, 0)], [(2, 1), (0, 1)]
    assert [pairing.first_outside(pairs[:2], count, 4) for count in (5, 4)] == [(-1, 0), (1, 0)]
    assert [pairing.first_outside(pairs, count, 4) for count in (6, 5, 4, 0)] == [(2, 1), *in_scan[1:]]
    assert [pairing.first_outside(pairs, 6, count) for count in (4, 3)] == on_map


@given(SEEDS)
@settings(max_examples=20, deadline=None)
def test_middles_and_moved_origins(seed: int) -> None:
    rng, pairs, weights, _ = drawn(seed)
    counts = np.append(rng.random(6) < 0.5, True)
    some = pairs.take(counts)
    *middles, count = pairing.middles(pairs.rows, np.where(counts, weights, 0.0))
    assert_close(middles, [*some.map_midpoints.mean(axis=0), *some.centroids.mean(axis=0)])
    assert count == counts.sum()
    map_x, map_y, scan_x, scan_y = middles
    expected = pairs.rows.copy()
    expected["map"]["x"] -= map_x
    expected["map"]["y"] -= map_y
    expected["scan"]["x"] -= scan_x
    expected["scan"]["y"] -= scan_y
    expected["scan"]["centroid_x"] -= scan_x
    expected["scan"]["centroid_y"] -= scan_y
    moved = pairs.about((map_x, map_y), (scan_x, scan_y))
    assert_close(moved.map_offsets, np.sum(moved.map_normals * moved.map_midpoints, axis=1))
    expected["map"]["offset"] = moved.map_offsets
    np.testing.assert_array_equal(moved.rows, expected)


@given(SEEDS)
@settings(max_examples=20, deadline=None)
def test_residuals(seed: int) -> None:
    rng, pairs, weights, measured = drawn(seed)
    at = RigidTransform(*rng.uniform(-3.0, 3.0, 3))
    counts = np.append(rng.random(6) < 0.5, True)
    offsets, angles, chi2, rms_offset, rms_angle, against = pairing.residuals(
        pairs.rows, np.where(counts, 1.0, 0.0), np.where(counts, weights, 0.0), at.theta, at.x, at.y
    )
    expected = np.sum(pairs.map_normals * at.apply(pairs.midpoints), axis=1) - pairs.map_offsets
    assert_close(offsets, expected)
    rows = zip(pairs.map_directions, pairs.map_midpoints, pairs.directions, pairs.midpoints, strict=True)
    alphas = [reference.transformation_line(*row)[2] for row in rows]
    turns = [math.remainder(alpha - at.theta, math.tau) for alpha in alphas]
    assert_close(angles, turns)
    np.testing.assert_array_equal(pairing.relative_angles(pairs.rows, at.theta), angles)
    cost = reference.joint_cost(at.theta, np.array([at.x, at.y]), *(values[counts] for values in measured))
    assert chi2 == pytest.approx(cost, rel=1e-9)
    assert rms_offset == pytest.approx(math.sqrt(np.mean(offsets[counts] ** 2)))
    assert rms_angle == pytest.approx(math.sqrt(np.mean(angles[counts] ** 2)))
    assert against == any(abs(turn) > 0.5 * math.pi for turn in turns)
    alone = pairing.residuals(pairs.rows[:1], np.ones(1), np.ones(1), at.theta, at.x, at.y)
    assert alone[-1] == (abs(turns[0]) > 0.5 * math.pi)


def definite(rng: np.random.Generator, size: int, spread: float = 3.0) -> Floats:
    """Draw a positive definite matrix whose rows differ in size by powers of ten."""
    root = rng.normal(size=(size, size + 1))
    scale = 10.0 ** rng.uniform(-spread, spread, size)
    return (root @ root.T) * np.outer(scale, scale)


@given(SEEDS)
@settings(max_examples=100, deadline=None)
def test_eigen2(seed: int) -> None:
    rng = np.random.default_rng(seed)
    matrix = definite(rng, 2)
    small, big, x, y = matrices.eigen2(matrix[0, 0], matrix[0, 1], matrix[1, 1])
    values, axes = np.linalg.eigh(matrix)
    np.testing.assert_allclose([small, big], values, rtol=1e-12, atol=1e-14 * values[1])
    assert math.hypot(x, y) == pytest.approx(1.0, rel=1e-15)
    assert abs(axes[:, 0] @ [x, y]) == pytest.approx(1.0, rel=1e-12)


def test_eigen2_of_what_has_no_one_axis() -> None:
    for a in (0.0, 2.0):
        small, big, x, y = matrices.eigen2(a, 0.0, a)
        np.testing.assert_allclose((small, big, x, y), (a, a, 1.0, 0.0), atol=1e-15)
    rows = np.random.default_rng(1).normal(size=(200, 2))
    assert min(matrices.eigen2(x * x, x * y, y * y)[0] for x, y in rows) == 0.0  # and not below, by rounding


@given(SEEDS, st.sampled_from([1e-12, 1e-6, 1e-2]))
@settings(max_examples=100, deadline=None)
def test_is_regular3(seed: int, least: float) -> None:
    rng = np.random.default_rng(seed)
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    matrix = (axes * [1.0, 1.0, 10.0 ** rng.uniform(-8.0, 0.0)]) @ axes.T
    scale = np.sqrt(np.diag(matrix))
    smallest = np.linalg.eigvalsh(matrix / np.outer(scale, scale))[0]
    units = 10.0 ** rng.uniform(-3.0, 3.0, 3)
    if abs(smallest - least) > 1e-9 * least:
        assert matrices.is_regular3(symmetric(matrix * np.outer(units, units))[0], least) == (smallest > least)


def test_is_regular3_of_what_is_not() -> None:
    singular = [np.diag([1.0, 0.0, 1.0]), np.array([[1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 1.0]])]
    singular += [np.outer(row, row) for row in ([1.0, 1.0, 1.0], [1.0, -2.0, 0.0], [0.5, 0.0, 1e3])]
    for matrix in singular:
        assert not matrices.is_regular3(symmetric(matrix)[0], 1e-12)
        assert not matrices.invert3(symmetric(matrix)[0], np.empty(1, SYMMETRIC3)[0])
    # Two eigenvalues are small, the least of them on one side of 1e-12 or the other.
    for gap, regular in ((1e-11, True), (1e-13, False)):
        matrix = np.ones((3, 3)) + 2.0 * gap * np.eye(3)
        assert matrices.is_regular3(symmetric(matrix)[0], 1e-12) == regular
    # By the determinant, 3 gap^2 to the first order.
    for gap, regular in ((1e-6, True), (1e-7, False)):
        matrix = np.ones((3, 3)) + gap * np.eye(3)
        assert matrices.invert3(symmetric(matrix)[0], np.empty(1, SYMMETRIC3)[0]) == regular


@given(SEEDS)
@settings(max_examples=100, deadline=None)
def test_inverses_and_carried(seed: int) -> None:
    rng = np.random.default_rng(seed)
    matrix = definite(rng, 3)
    scale = np.sqrt(np.diag(matrix))
    condition = np.linalg.cond(matrix / np.outer(scale, scale))
    out = np.empty(1, SYMMETRIC3)

    def error() -> float:
        product = (of_arrays.full_matrix(out) * np.outer(scale, scale)) @ (matrix / np.outer(scale, scale))
        return float(np.abs(product - np.eye(3)).max())

    matrices.invert3_scaled(symmetric(matrix)[0], out[0])
    assert error() <= 1e-14 * condition
    if condition < 1e4:
        assert matrices.invert3(symmetric(matrix)[0], out[0])
        assert error() <= 1e-14 * condition**2
    in_place = symmetric(matrix)
    matrices.invert3(in_place[0], in_place[0])
    np.testing.assert_array_equal(in_place, out if condition < 1e4 else in_place)

    x, y = rng.uniform(-5.0, 5.0, 2)
    lever = np.array([[1.0, 0.0, y], [0.0, 1.0, -x], [0.0, 0.0, 1.0]])
    expected = lever @ matrix @ lever.T
    matrices.carried(symmetric(matrix)[0], x, y, out[0])
    np.testing.assert_allclose(of_arrays.full_matrix(out), expected, rtol=1e-12, atol=1e-12 * expected.max())


@given(SEEDS)
@settings(max_examples=50, deadline=None)
def test_sandwich(seed: int) -> None:
    rng = np.random.default_rng(seed)
    outer, inner = definite(rng, 3), definite(rng, 3)
    expected = outer @ inner @ outer
    out = symmetric(outer)
    matrices.sandwich(out[0], symmetric(inner)[0], out[0])
    np.testing.assert_allclose(of_arrays.full_matrix(out), expected, rtol=1e-12, atol=1e-12 * np.abs(expected).max())
