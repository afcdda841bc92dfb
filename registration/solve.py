"""Known correspondences to a pose: the main path."""

from __future__ import annotations

import math
import sys

import numpy as np
from numpy.typing import ArrayLike

from .correspondences import Correspondences, cross
from .fitting import Fit, Problem
from .layout import Floats
from .observability import Free, chi_square_quantile
from .options import RegistrationOptions
from .result import Ambiguity, RegistrationDiagnostics, RegistrationResult
from .segments import MeasuredSegments, Segments
from .transform import RigidTransform
from .weights import weigh

DEFAULT_OPTIONS = RegistrationOptions()
TAIL = 0.001  # probability that chi2 of right pairs is larger; an answer beyond it is not usable


def register(
    map_segments: Segments,
    scan: MeasuredSegments,
    pairs: ArrayLike,
    map_sigma: float = 0.0,
    options: RegistrationOptions = DEFAULT_OPTIONS,
    at: RigidTransform | None = None,
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
    at : RigidTransform or None
        Evaluate this transform, map_from_scan, in place of fitting one.

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
    return register_pairs(Correspondences.of(map_segments, scan, pairs), map_sigma, options, at)


def register_pairs(
    given: Correspondences, map_sigma: float, options: RegistrationOptions, at: RigidTransform | None = None
) -> RegistrationResult:
    """Register pairs that were gathered before, see `register`."""
    weights = weigh(given, map_sigma, options)
    if not len(given):
        return _no_answer(options)
    problem, every = Problem.of(given, weights, oriented=options.oriented)
    return _result_of(problem, every, problem.fit(options, at), weights.used, options)


def _no_answer(options: RegistrationOptions) -> RegistrationResult:
    """Return what there is to say about no pairs at all."""
    zero = Ambiguity(0.0, 0.0)
    at = None if options.evaluate_at is None else zero
    nothing = np.zeros(0)
    return RegistrationResult(
        degenerate=True,
        usable=False,
        pose=None,
        covariance=None,
        unobservable=None,
        offsets=nothing,
        angles=nothing,
        weights=nothing,
        diagnostics=RegistrationDiagnostics(zero, zero, at, None, 0.0, 0.0, 0.0, 0, 0.0, 0.0, 0),
    )


def _result_of(
    problem: Problem, every: Correspondences, fit: Fit, used: Floats, options: RegistrationOptions
) -> RegistrationResult:
    """Return the result of a fit to `every` pair that the estimator weighs by `used`."""
    free, between = fit.freedom.what, fit.between
    offsets = cross(every.map_directions, between.apply(every.midpoints)) - every.map_offsets
    angles = every.angles(between.theta)
    degenerate = free is not Free.NOTHING or not problem.unique
    diagnostics = _diagnostics(problem, fit, options, offsets[used > 0.0], angles[used > 0.0])
    fits = diagnostics.chi2 <= chi_square_quantile(diagnostics.dof, TAIL)
    if options.oriented and (np.abs(angles) > 0.5 * math.pi).any():
        fits = False
    return RegistrationResult(
        degenerate=degenerate,
        usable=not degenerate and fits,
        pose=fit.pose.shifted(*problem.middles[0].tolist()),
        covariance=fit.covariance,
        unobservable=fit.freedom.direction if free in (Free.DIRECTION, Free.PARALLEL) else None,
        offsets=offsets,
        angles=angles,
        weights=used,
        diagnostics=diagnostics,
    )


def _diagnostics(
    problem: Problem, fit: Fit, options: RegistrationOptions, offsets: Floats, angles: Floats
) -> RegistrationDiagnostics:
    """Return the diagnostics of a fit; offsets and angles are those of the pairs that count."""
    map_x, map_y = problem.middles[0].tolist()
    elsewhere = [] if options.evaluate_at is None else [options.evaluate_at.shifted(-map_x, -map_y)]
    ambiguities = problem.ambiguities([fit.pose, RigidTransform(-map_x, -map_y, 0.0), *elsewhere], options)
    total, count = ambiguities[0].total, len(offsets)
    determinant, reliability = problem.determinant_and_reliability()
    return RegistrationDiagnostics(
        ambiguity=ambiguities[0],
        ambiguity_before=ambiguities[1],
        ambiguity_at=ambiguities[2] if elsewhere else None,
        similarity=1.0 / total if total > sys.float_info.min else None,
        reliability=reliability,
        determinant=determinant,
        chi2=problem.chi_square(fit.between),
        dof=2 * count - (2 if fit.freedom.what is Free.PARALLEL else 3),
        rms_offset=math.sqrt(float(offsets @ offsets) / count),
        rms_angle=math.sqrt(float(angles @ angles) / count),
        pairs=count,
    )
