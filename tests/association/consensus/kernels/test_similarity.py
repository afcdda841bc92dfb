"""A similarity is fitted to a set of pairs as by dense least squares with the walls' errors as correlations."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings

from association.consensus.kernels.similarity import estimate_similarity, pose_of_similarity, solve_similarity
from association.layout import ESTIMATE
from registration.layout import JOINT_SUMS, Floats

from ...kernels.drawn import ASKED, SEEDS
from ...records import covariance_of, work_of
from ...reference.consensus import matches_on
from ...reference.geometry import direction, normal, point, wrap
from ...reference.pose_estimation import pairs_of
from .test_pose_estimation import Set, known_walls, some

FACTORS = (0.97, 0.99, 1.0, 1.01, 1.03)


def stretched(one: Set, factor: float) -> Set:
    """Return the set as if every length of the scan had been divided by a factor."""
    scan = one.scan.copy()
    for name in ("centroid_x", "centroid_y"):
        scan[name] /= factor
    return Set(scan, one.walls, one.held, one.start)


def estimated(one: Set) -> tuple[float, Floats, Floats]:
    """Return the walls' variance, (a, b, x, y) and their covariance."""
    solution, covariance = np.zeros(4), np.zeros((4, 4))
    question, work = ASKED._replace(scan=one.scan), work_of(len(one.scan), len(one.walls))
    matches = matches_on(one.held)
    variance, _ = estimate_similarity(question, known_walls(one), matches, solution, covariance, work)
    return variance, solution, covariance


def dense(one: Set, variance: float) -> tuple[Floats, Floats]:
    """Return the normal equations of all offsets and directions, matrix and right side."""
    pairs = pairs_of(one.scan, one.held, one.walls, variance)
    rows, right = [], []
    for part in ("offset", "turn"):
        for line, wall in zip(pairs.scan, pairs.walls, strict=True):
            (nx, ny), root = normal(wall), math.sqrt(line["spread"])
            x, y = point(line, "centroid_x", "centroid_y") if part == "offset" else root * direction(line)
            moved = [nx, ny] if part == "offset" else [0.0, 0.0]
            rows.append([nx * x + ny * y, ny * x - nx * y, *moved])
            right.append(wall["offset"] if part == "offset" else 0.0)
    j, inverse = np.array(rows), np.linalg.inv(pairs.covariance)
    return np.asarray(j.T @ inverse @ j), np.asarray(j.T @ inverse @ np.array(right))


@given(SEEDS)
@settings(max_examples=40, deadline=None)
def test_it_is_that_of_dense_least_squares(seed: int) -> None:
    one = stretched(some(seed), FACTORS[seed % len(FACTORS)])
    variance, solution, covariance = estimated(one)
    normal_matrix, right = dense(one, max(0.0, variance))
    size = 1.0 / np.sqrt(normal_matrix.diagonal() + 1.0)
    regular = np.linalg.eigvalsh(size[:, None] * normal_matrix * size)[0]
    if variance < 0.0:
        assert regular < 1e-5
    elif regular > 1e-5:
        np.testing.assert_allclose(solution, np.linalg.solve(normal_matrix, right), rtol=1e-5, atol=1e-5)
        np.testing.assert_allclose(covariance @ normal_matrix, np.eye(4), atol=1e-4)


@given(SEEDS)
@settings(max_examples=40, deadline=None)
def test_its_pose_has_the_covariance_that_derivatives_give(seed: int) -> None:
    one = some(seed)
    variance, solution, covariance = estimated(one)
    if variance < 0.0:
        return
    pose = np.zeros(1, ESTIMATE)
    factor, spread = pose_of_similarity(solution, covariance, pose[0])
    assert factor == pytest.approx(abs(complex(*solution[:2])))

    def read(values: Floats) -> Floats:
        a, b, x, y = values.tolist()
        return np.array([x, y, wrap(math.atan2(b, a) - pose[0]["theta"]), math.hypot(a, b)])

    step = 1e-6
    j = np.array([(read(solution + step * e) - read(solution - step * e)) / (2.0 * step) for e in np.eye(4)]).T
    whole = j @ covariance @ j.T
    np.testing.assert_allclose(covariance_of(pose[0]), whole[:3, :3], rtol=1e-4, atol=1e-6 * np.abs(whole).max())
    assert spread == pytest.approx(whole[3, 3], rel=1e-4)


def test_the_walls_error_is_what_the_factor_leaves() -> None:
    """Walls that a factor of 3 % puts off by decimetres are on their places with it."""
    exact = [some(seed, 0.0) for seed in range(40)]
    plain = [estimated(one)[0] for one in exact]
    off = [estimated(stretched(one, 1.03))[0] for one in exact]
    np.testing.assert_allclose(off, plain, rtol=0.1)


def test_nothing_is_solved_of_parallel_walls() -> None:
    """Nor of no pair at all."""
    solution, covariance = np.full(4, 7.0), np.full((4, 4), 7.0)
    sums = np.zeros(1, JOINT_SUMS)
    assert not solve_similarity(sums[0], solution, covariance)
    sums[0]["yy"] = sums[0]["cc"] = sums[0]["ss"] = 1e4
    assert not solve_similarity(sums[0], solution, covariance)
    assert (solution == 7.0).all()
    assert (covariance == 7.0).all()
