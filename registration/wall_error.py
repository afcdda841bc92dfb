"""Estimation of the walls' error of a map from the residuals of the pairs on them."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .correspondences import MIN_SIGMA, Correspondences, cross
from .fitting import Problem
from .layout import Floats, X, Y
from .options import RegistrationOptions
from .result import RegistrationResult
from .segments import MeasuredSegments, Segments
from .solve import DEFAULT_OPTIONS, register
from .weights import weigh

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
    sigma, given = USUAL_WALL_ERROR, Correspondences.of(map_segments, scan, pairs)
    # A caller's own weights say all that there is to say.
    if len(given) and options.weights is None:
        seen, walls = np.asarray(pairs).T
        _, wall_of_pair = np.unique(walls, return_inverse=True)
        variances = scan.sigma[seen] ** 2 / np.maximum(scan.point_counts[seen], 1.0)
        for _ in range(ROUNDS):
            sigma = _wall_error(given, variances, wall_of_pair, sigma, oriented=options.oriented)
    return register(map_segments, scan, pairs, sigma, options)


def _wall_error(
    given: Correspondences, variances: Floats, wall_of_pair: NDArray[np.intp], sigma: float, *, oriented: bool
) -> float:
    """Return the standard deviation of the walls' offsets, metres, given one that is about right.

    The mean residual of wall k, m_k, has the variance ``(V + 1 / s_k) (1 - h_k)`` with its leverage h_k and the
    weight s_k of what was measured on it. Hence V is about ``sum(m_k^2 - (1 - h_k) / s_k) / sum(1 - h_k)``.
    """
    options = RegistrationOptions(oriented=oriented)
    problem, every = Problem.of(given, weigh(given, sigma, options), oriented=oriented)
    fit = problem.fit(options)
    weights = 1.0 / np.maximum(variances, MIN_SIGMA**2)
    summed = np.bincount(wall_of_pair, weights)

    def mean(values: Floats) -> Floats:
        return np.asarray(np.bincount(wall_of_pair, weights * values) / summed)

    middles = fit.between.apply(every.midpoints)
    offsets = cross(every.map_directions, middles) - every.map_offsets
    if fit.covariance is None:
        # Parallel walls fix their distance and the angle.
        leverages = np.full(len(summed), min(1.0, 2.0 / len(summed)))
    else:
        # Derivatives of the residuals by x, y and theta: n, and n . (d theta x R m).
        normals, arms = every.map_normals, middles - (fit.pose.x, fit.pose.y)
        turning = normals[:, Y] * arms[:, X] - normals[:, X] * arms[:, Y]
        gradients = np.stack([mean(normals[:, X]), mean(normals[:, Y]), mean(turning)])
        leverages = ((fit.covariance @ gradients) * gradients).sum(axis=0) / (sigma**2 + 1.0 / summed)
    free = np.clip(1.0 - leverages, 0.0, 1.0)
    count = USUAL_WALLS + float(free.sum())
    found = USUAL_WALLS * USUAL_WALL_ERROR**2 + float((mean(offsets) ** 2 - free / summed).sum())
    # An estimate from few walls is uncertain: Student's t has that much more variance.
    variance = max(found / count, LEAST_WALL_ERROR**2) * (1.0 + 2.0 / max(1.0, count - 2.0))
    return float(np.sqrt(variance))
