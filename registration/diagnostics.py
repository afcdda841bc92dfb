"""Numbers beside the pose: residuals, covariance, and the paper's measures."""

from __future__ import annotations

import sys
from dataclasses import dataclass

import numpy as np

from .estimate import Fit, Problem
from .joint import JointSums
from .kernels.of_arrays import carried_matrix
from .kernels.pairs import residuals
from .layout import Floats
from .options import RegistrationOptions
from .result import Ambiguity, RegistrationDiagnostics, RegistrationResult
from .transform import RigidTransform


def no_answer(options: RegistrationOptions) -> RegistrationResult:
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


@dataclass(frozen=True, slots=True, eq=False)
class Residuals:
    """What a fit leaves.

    Attributes
    ----------
    offsets, angles : (n,)
        At the midpoints, metres, and radians; of all pairs.
    chi2, rms_offset, rms_angle : float
        Of the pairs that count.
    against : bool
        Whether any scan segment runs against its map segment; lines fit either way round, so chi2 does not see it.
    """

    offsets: Floats
    angles: Floats
    chi2: float
    rms_offset: float
    rms_angle: float
    against: bool

    @classmethod
    def of(cls, problem: Problem, fit: Fit) -> Residuals:
        """Evaluate them."""
        at, weights = fit.local_from_centred, problem.weights
        return cls(*residuals(problem.centred.rows, weights.used, weights.information, at.theta, at.x, at.y))


def covariance_of(problem: Problem, fit: Fit) -> Floats:
    """Return the covariance of additive (x, y, theta) in the map frame, (3, 3).

    The inverse of the information matrix ``F`` when the weights are the information; else, for pairs weighted ``w`` of
    information ``i``, ``F(w)^-1 F(w^2 / i) F(w)^-1``.
    """
    weights, theta = problem.weights, fit.local_from_scan.theta
    covariance = fit.sums.covariance(theta)
    if weights.information is not weights.used:
        scatter = JointSums.of_set(problem.centred, weights.used**2 / weights.information).information(theta)
        covariance = covariance @ scatter @ covariance
    # From the middle of the scan segments to the origin of the scan frame.
    lever = problem.scan_from_centred
    return carried_matrix(covariance, theta, lever.x, lever.y)


def diagnose(problem: Problem, fit: Fit, residuals: Residuals, options: RegistrationOptions) -> RegistrationDiagnostics:
    """Put the residuals' size and the paper's measures at a fit together."""
    at = fit.local_from_scan
    sums = problem.one_step_sums(at.x, at.y)
    local_from_map = problem.map_from_local.inverse()

    def ambiguity(at: RigidTransform) -> Ambiguity:
        translation, rotation = sums.costs(at, options.rotation)
        return Ambiguity(options.k_translation * translation, options.k_rotation * rotation)

    at_pose, elsewhere = ambiguity(at), options.evaluate_at
    return RegistrationDiagnostics(
        ambiguity=at_pose,
        ambiguity_before=ambiguity(local_from_map),
        ambiguity_at=None if elsewhere is None else ambiguity(local_from_map.compose(elsewhere)),
        similarity=1.0 / at_pose.total if at_pose.total > sys.float_info.min else None,
        reliability=sums.reliability,
        determinant=sums.determinant,
        chi2=residuals.chi2,
        dof=2 * problem.count - (2 if fit.freedom.parallel else 3),
        rms_offset=residuals.rms_offset,
        rms_angle=residuals.rms_angle,
        n=problem.count,
    )
