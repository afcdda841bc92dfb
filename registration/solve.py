"""Known correspondences to a pose: the main path."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import chdtri

from .correspondences import Correspondences
from .diagnostics import covariance_of, diagnose, no_answer, residuals
from .estimate import Problem, fit_joint, fit_one_step
from .one_step import OneStepSums
from .options import RegistrationOptions
from .orientation import choose_rotation
from .result import RegistrationResult
from .segments import MeasuredSegments, Segments
from .transform import RigidTransform
from .weights import PairWeights, weigh

Floats = NDArray[np.float64]

TAIL = 0.001  # chance that chi2 of right pairs is larger; an answer beyond it is not usable
DEFAULT_OPTIONS = RegistrationOptions()


def register(
    map_segments: Segments,
    scan: MeasuredSegments,
    pairs: ArrayLike,
    map_sigma: float = 0.0,
    options: RegistrationOptions = DEFAULT_OPTIONS,
) -> RegistrationResult:
    """Find the rigid transform that lays scan segments on their map lines.

    Parameters
    ----------
    map_segments : Segments
        In the map frame, however far from its origin.
    scan : MeasuredSegments
        In the scan frame.
    pairs : (n, 2) integers
        ``[scan_index, map_index]`` per correspondence; n may be 0.
    map_sigma : float
        Standard deviation of the offset of a map line, metres, 0 to 1e3.
    options : RegistrationOptions

    Returns
    -------
    RegistrationResult
        With ``degenerate`` set where no unique transform fits. Then the pose is, of those that fit, the one whose
        translation along the free direction is smallest; the one-step estimator gives the paper's answer as long as it
        has one.

    Raises
    ------
    InvalidArgumentError
        When `pairs`, a sigma or a weight is wrong; with the argument and the index at fault.
    """
    given = Correspondences.of(map_segments, scan, pairs)
    weights = weigh(given, map_sigma, options)
    if not len(given):
        return no_answer(options)

    problem, centred, unique = _pose_problem(given, weights, oriented=options.oriented)
    fit = (fit_joint if options.estimator == "joint" else fit_one_step)(problem, options)
    degenerate = fit.freedom.degenerate or not unique

    x, y = fit.local_translation(problem) + problem.map_origin
    offsets, angles = residuals(centred, fit)
    diagnostics = diagnose(problem, fit, options)
    has_covariance = not degenerate and options.estimator == "joint"
    direction = fit.freedom.direction
    return RegistrationResult(
        degenerate=degenerate,
        usable=not degenerate and diagnostics.chi2 <= float(chdtri(diagnostics.dof, TAIL)),
        pose=RigidTransform(float(x), float(y), fit.theta),
        covariance=covariance_of(problem, fit) if has_covariance else None,
        unobservable=None if direction is None else (float(direction[0]), float(direction[1])),
        offsets=offsets,
        angles=angles,
        weights=weights.used,
        diagnostics=diagnostics,
    )


def _pose_problem(
    given: Correspondences, weights: PairWeights, *, oriented: bool
) -> tuple[Problem, Correspondences, bool]:
    """Recentre, and turn segments round where directions mean nothing.

    Returns the problem without the pairs of weight 0, all pairs about the middles of both sets, and whether only one
    way to turn them fits.
    """
    active = weights.used > 0.0
    counted = weights.take(active)
    map_origin = given.map_midpoints[active].mean(axis=0)
    scan_origin = given.centroids[active].mean(axis=0)
    local = given.about(map_origin, np.zeros(2))
    centred = local.about(np.zeros(2), scan_origin)
    unique = True
    if not oriented:
        is_noise = counted.noise is not None
        judged = counted.used if counted.noise is None else counted.noise
        theta, unique = choose_rotation(centred.take(active), judged, is_noise=is_noise)
        against = centred.runs_against(theta)
        local, centred = local.turned(against), centred.turned(against)
    pairs = local.take(active)
    reference = OneStepSums.of_set(pairs, counted.used).solve("wahba")[0].theta
    return Problem(pairs, centred.take(active), counted, map_origin, scan_origin, reference), centred, unique
