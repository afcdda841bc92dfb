"""Accuracy and covariance of the joint estimator."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from registration import RegistrationOptions, RegistrationResult, RigidTransform, register
from registration.layout import Floats
from registration.options import Weighting

from .scenes import POSE, diagonal, difference, fitted, pose_of, random_segments, scanned_points

SIGMA = 0.02
COUNT = 25


def trials(
    n: int, *, segments: int = 8, origin: tuple[float, float] = (0.0, 0.0), options: RegistrationOptions | None = None
) -> Iterator[tuple[Floats, Floats, RegistrationResult]]:
    """Register n noisy scans of one scene; yield pose minus truth, the covariance and the result."""
    rng = np.random.default_rng(20191)
    map_segments = random_segments(rng, segments)
    pose = POSE.compose(RigidTransform(origin[0], origin[1], 0.0))
    options = options or RegistrationOptions()
    for _ in range(n):
        scan = fitted(scanned_points(rng, map_segments, pose, SIGMA, COUNT), SIGMA)
        result = register(map_segments, scan, diagonal(segments), 0.0, options)
        assert result.covariance is not None
        yield difference(pose_of(result), pose), result.covariance, result


@pytest.mark.parametrize("origin", [(0.0, 0.0), (50.0, 30.0)], ids=["inside", "58 m away"])
def test_covariance_and_chi2_are_honest_and_the_bound_is_reached(origin: tuple[float, float]) -> None:
    offs, costs, nees, usable = [], [], [], 0
    for off, covariance, result in trials(2000, origin=origin):
        offs.append(off)
        costs.append(result.diagnostics.chi2)
        nees.append(off @ np.linalg.solve(covariance, off))
        usable += result.usable
    assert 2.7 <= np.mean(nees) <= 3.3
    assert np.mean(costs) == pytest.approx(13.0, rel=0.05)
    assert usable > 0.995 * 2000
    # The Cramer-Rao bound is the inverse of the information of the raw points at the truth, which noise moves little.
    bound = np.sqrt(np.diag(covariance))
    rms = np.sqrt(np.mean(np.square(offs), axis=0))
    assert (rms <= 1.05 * bound).all()


@pytest.mark.parametrize("weighting", ["uniform", "shorter_length"])
def test_covariance_is_honest_whatever_the_weighting(weighting: Weighting) -> None:
    nees = []
    for off, covariance, _ in trials(1000, options=RegistrationOptions(weighting=weighting)):
        nees.append(off @ np.linalg.solve(covariance, off))
    assert 2.7 <= np.mean(nees) <= 3.3


def test_to_first_order_it_is_point_to_line_least_squares() -> None:
    rng = np.random.default_rng(6)
    map_segments = random_segments(rng, 8)
    for sigma, tolerance in ((1e-2, 1e-4), (1e-4, 1e-8)):
        points = scanned_points(rng, map_segments, POSE, sigma, COUNT)
        pose = pose_of(register(map_segments, fitted(points, sigma), diagonal(8)))
        # Gauss-Newton on all raw points.
        direct = POSE
        for _ in range(6):
            moved = direct.apply(points)
            arms = moved - [direct.x, direct.y]
            n = np.broadcast_to(map_segments.normals[:, None], moved.shape)
            gaps = np.sum(n * moved, axis=2) - map_segments.offsets[:, None]
            turn = n[..., 1] * arms[..., 0] - n[..., 0] * arms[..., 1]
            rows = np.stack([n[..., 0], n[..., 1], turn], axis=2).reshape(-1, 3)
            step = np.linalg.lstsq(rows, -gaps.ravel(), rcond=None)[0]
            direct = RigidTransform(direct.x + step[0], direct.y + step[1], direct.theta + step[2])
        np.testing.assert_allclose(difference(pose, direct), 0.0, atol=tolerance)
        assert np.abs(difference(direct, POSE)).max() > 10.0 * tolerance
