"""Pairs as they are gathered and moved, their residuals, and the inverse of a small matrix."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from registration import Correspondences, JointSums, RegistrationOptions, RigidTransform, register
from registration.kernels import invert3
from registration.layout import SYMMETRIC3, Floats
from tests import reference

from .scenes import assert_close, correspondences, diagonal, drawn, noisy_pairs, symmetric

SEEDS = st.integers(0, 2**32 - 1)
FULL = np.array([[0, 1, 2], [1, 3, 4], [2, 4, 5]])
COLUMNS = (
    "map_directions", "map_midpoints", "map_offsets", "map_lengths", "directions", "midpoints", "lengths",
    "centroids", "spreads", "variances",
)  # fmt: skip


@given(SEEDS)
@settings(max_examples=20, deadline=None)
def test_gather(seed: int) -> None:
    rng = np.random.default_rng(seed)
    map_segments, scan = noisy_pairs(rng, 9)
    scan = replace(scan, sigma=rng.choice([0.0, 1e-200, 1e-12, 0.3], 9))
    pairs = np.stack([rng.integers(0, 9, 12), rng.integers(0, 9, 12)], axis=1)
    found = Correspondences.of(map_segments, scan, pairs)
    expected = zip(*reference.pair_rows(map_segments, scan, pairs), strict=True)
    for name, column in zip(COLUMNS, expected, strict=True):
        np.testing.assert_allclose(getattr(found, name), column, rtol=1e-15, atol=1e-15, err_msg=name)


@given(SEEDS)
@settings(max_examples=20, deadline=None)
def test_moved_origins(seed: int) -> None:
    rng, pairs, _, _ = drawn(seed)
    on_map, of_scan = rng.uniform(-5.0, 5.0, (2, 2))
    moved = pairs.about(on_map, of_scan)
    assert_close(moved.map_offsets, np.sum(moved.map_normals * moved.map_midpoints, axis=1))
    assert_close(moved.map_midpoints, pairs.map_midpoints - on_map)
    assert_close(moved.offsets, pairs.offsets - reference_normals(pairs) @ of_scan)
    assert_close(moved.centroids, pairs.centroids - of_scan)


def reference_normals(pairs: Correspondences) -> Floats:
    normals: Floats = pairs.directions @ reference.TURN.T
    return normals


@given(SEEDS)
@settings(max_examples=20, deadline=None)
def test_residuals(seed: int) -> None:
    rng = np.random.default_rng(seed)
    map_segments, scan = noisy_pairs(rng, 7, noise=0.05)
    pairs = correspondences(map_segments, scan)
    at, weights = RigidTransform(*rng.uniform(-3.0, 3.0, 3)), rng.uniform(0.1, 2.0, 7)
    counts = np.append(rng.random(6) < 0.5, True)
    weights[~counts] = 0.0
    found = register(map_segments, scan, diagonal(7), 0.0, RegistrationOptions(weights=weights), at)
    expected = np.sum(pairs.map_normals * at.apply(pairs.midpoints), axis=1) - pairs.map_offsets
    assert_close(found.offsets, expected)
    rows = zip(pairs.map_directions, pairs.map_midpoints, pairs.directions, pairs.midpoints, strict=True)
    turns = [math.remainder(reference.transformation_line(*row)[2] - at.theta, math.tau) for row in rows]
    assert_close(found.angles, turns)
    assert_close(pairs.angles(at.theta), turns)
    some = pairs.take(counts)
    measured = (some.map_normals, some.map_offsets, some.centroids, some.directions, some.spreads, weights[counts])
    cost = reference.joint_cost(at.theta, np.array([at.x, at.y]), *measured)
    assert found.diagnostics.chi2 == pytest.approx(cost, rel=1e-9)
    assert found.diagnostics.rms_offset == pytest.approx(math.sqrt(np.mean(found.offsets[counts] ** 2)))
    assert found.diagnostics.rms_angle == pytest.approx(math.sqrt(np.mean(found.angles[counts] ** 2)))


def definite(rng: np.random.Generator, size: int, spread: float = 3.0) -> Floats:
    """Draw a positive definite matrix whose rows differ in size by powers of ten."""
    root = rng.normal(size=(size, size + 1))
    scale = 10.0 ** rng.uniform(-spread, spread, size)
    return (root @ root.T) * np.outer(scale, scale)


def test_invert3_refuses_what_is_singular() -> None:
    singular = [np.diag([1.0, 0.0, 1.0]), np.array([[1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 1.0]])]
    singular += [np.outer(row, row) for row in ([1.0, 1.0, 1.0], [1.0, -2.0, 0.0], [0.5, 0.0, 1e3])]
    for matrix in singular:
        assert not invert3(symmetric(matrix)[0], np.empty(1, SYMMETRIC3)[0])
    # By the determinant, 3 gap^2 to the first order.
    for gap, regular in ((1e-6, True), (1e-7, False)):
        matrix = np.ones((3, 3)) + gap * np.eye(3)
        assert invert3(symmetric(matrix)[0], np.empty(1, SYMMETRIC3)[0]) == regular


@given(SEEDS)
@settings(max_examples=100, deadline=None)
def test_invert3(seed: int) -> None:
    matrix = definite(np.random.default_rng(seed), 3)
    scale = np.sqrt(np.diag(matrix))
    condition = np.linalg.cond(matrix / np.outer(scale, scale))
    if condition < 1e4:
        out = np.empty(1, SYMMETRIC3)
        assert invert3(symmetric(matrix)[0], out[0])
        product = (out.view(np.float64)[FULL] * np.outer(scale, scale)) @ (matrix / np.outer(scale, scale))
        assert np.abs(product - np.eye(3)).max() <= 1e-14 * condition**2
        in_place = symmetric(matrix)
        invert3(in_place[0], in_place[0])
        np.testing.assert_array_equal(in_place, out)


@given(SEEDS)
@settings(max_examples=20, deadline=None)
def test_the_covariance_is_the_inverse_of_the_information(seed: int) -> None:
    _, pairs, weights, _ = drawn(seed)
    sums = JointSums.of_set(pairs, weights)
    np.testing.assert_allclose(sums.covariance(0.4) @ sums.information(0.4), np.eye(3), atol=1e-9)
