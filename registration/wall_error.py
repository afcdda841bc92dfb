"""Estimation of the walls' error of a map from the residuals of the pairs on them."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .kernels.pairs import MIN_SIGMA
from .options import RegistrationOptions
from .result import RegistrationResult
from .segments import MeasuredSegments, Segments
from .solve import DEFAULT_OPTIONS, register

# The error of walls before any residual, and the number of walls that it counts as: see `association.consensus.tuning`.
USUAL_WALL_ERROR = 0.02  # m
USUAL_WALLS = 2.0
LEAST_WALL_ERROR = 0.003  # m
ROUNDS = 4


def register_estimating(
    map_segments: Segments,
    scan: MeasuredSegments,
    pairs: ArrayLike,
    options: RegistrationOptions = DEFAULT_OPTIONS,
) -> RegistrationResult:
    """Register as `register` does, on a map with an unknown error of its walls.

    The error is estimated from what the joint fit leaves between the walls, shrunk to that of usual maps where the
    walls are few.

    Parameters
    ----------
    map_segments : Segments
        In the map frame.
    scan : MeasuredSegments
        In the scan frame.
    pairs : (n, 2) integers
        ``[scan_index, map_index]`` per correspondence.
    options : RegistrationOptions

    Returns
    -------
    RegistrationResult

    Raises
    ------
    InvalidArgumentError
        As `register`.
    """
    result, sigma = register(map_segments, scan, pairs, USUAL_WALL_ERROR, options), USUAL_WALL_ERROR
    # A caller's own weights say all that there is to say.
    if result.diagnostics.pairs and options.weights is None:
        how = RegistrationOptions(oriented=options.oriented)
        for _ in range(ROUNDS):
            sigma = _wall_error(map_segments, scan, np.asarray(pairs), sigma, how)
        result = register(map_segments, scan, pairs, sigma, options)
    return result


def _wall_error(
    map_segments: Segments, scan: MeasuredSegments, pairs: np.ndarray, sigma: float, options: RegistrationOptions
) -> float:
    """Return the standard deviation of the walls' offsets, metres, given one that is about right.

    The mean residual of wall k, m_k, has the variance ``(V + 1 / s_k) (1 - h_k)`` with its leverage h_k and the
    weight s_k of what was measured on it. Hence V is about ``sum(m_k^2 - (1 - h_k) / s_k) / sum(1 - h_k)``.
    """
    result = register(map_segments, scan, pairs, sigma, options)
    assert result.pose is not None
    walls, wall_of_pair = np.unique(pairs[:, 1], return_inverse=True)
    seen = pairs[:, 0]
    weights = 1.0 / np.maximum(scan.sigma[seen] ** 2 / np.maximum(scan.point_counts[seen], 1.0), MIN_SIGMA**2)
    summed = np.bincount(wall_of_pair, weights)

    def mean(values: np.ndarray) -> np.ndarray:
        return np.asarray(np.bincount(wall_of_pair, weights * values) / summed)

    # Derivatives of the residuals by x, y and theta: n, and n . (d theta x R m).
    normals = map_segments.normals[pairs[:, 1]]
    arms = result.pose.apply(scan.segments.midpoints[seen]) - [result.pose.x, result.pose.y]
    turning = normals[:, 1] * arms[:, 0] - normals[:, 0] * arms[:, 1]
    gradients = np.stack([mean(normals[:, 0]), mean(normals[:, 1]), mean(turning)], axis=1)
    variances = sigma**2 + 1.0 / summed
    if result.covariance is None:
        # Parallel walls fix their distance and the angle.
        leverages = np.full(len(walls), min(1.0, 2.0 / len(walls)))
    else:
        leverages = np.einsum("ki,ij,kj->k", gradients, result.covariance, gradients) / variances
    free = np.clip(1.0 - leverages, 0.0, 1.0)
    count = USUAL_WALLS + float(free.sum())
    found = USUAL_WALLS * USUAL_WALL_ERROR**2 + float((mean(result.offsets) ** 2 - free / summed).sum())
    # An estimate from few walls is uncertain: Student's t has that much more variance.
    variance = max(found / count, LEAST_WALL_ERROR**2) * (1.0 + 2.0 / max(1.0, count - 2.0))
    return float(np.sqrt(variance))
