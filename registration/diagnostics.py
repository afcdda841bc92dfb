"""Numbers beside the pose: residuals, covariance, and the paper's measures."""

from __future__ import annotations

import math
import sys

import numpy as np
from numpy.typing import NDArray

from .correspondences import Correspondences
from .estimate import Fit, Problem, rotation_matrix
from .joint import JointSums
from .one_step import OneStepSums
from .options import RegistrationOptions
from .result import Ambiguity, RegistrationDiagnostics, RegistrationResult
from .transform import RigidTransform

Floats = NDArray[np.float64]


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


def residuals(pairs: Correspondences, fit: Fit) -> tuple[Floats, Floats]:
    """Return offsets at the midpoints in metres and angles in radians, (n,) each, of pairs about both middles."""
    return _offsets(pairs, pairs.midpoints, fit), pairs.angles(fit.theta)


def covariance_of(problem: Problem, fit: Fit) -> Floats:
    """Return the covariance of additive (x, y, theta) in the map frame, (3, 3).

    The inverse of the information matrix ``F`` when the weights are the information; else, for pairs weighted ``w`` of
    information ``i``, ``F(w)^-1 F(w^2 / i) F(w)^-1``.
    """
    weights, pairs = problem.weights, problem.centred
    covariance = _inverse(JointSums.of_set(pairs, weights.used).information(fit.theta))
    if weights.information is not weights.used:
        scatter = JointSums.of_set(pairs, weights.used**2 / weights.information).information(fit.theta)
        covariance = covariance @ scatter @ covariance
    # From the middle of the scan segments to the origin of the scan frame.
    x, y = rotation_matrix(fit.theta) @ problem.scan_origin
    lever = np.array([[1.0, 0.0, y], [0.0, 1.0, -x], [0.0, 0.0, 1.0]])
    moved: Floats = lever @ covariance @ lever.T
    return 0.5 * (moved + moved.T)


def diagnose(problem: Problem, fit: Fit, options: RegistrationOptions) -> RegistrationDiagnostics:
    """Evaluate chi2, the residuals' size and the paper's measures at a fit."""
    pairs = problem.centred
    offsets, angles = residuals(pairs, fit)
    at_centroids = _offsets(pairs, pairs.centroids, fit)
    chi2 = problem.weights.information @ (at_centroids**2 + pairs.spreads * np.sin(angles) ** 2)

    x, y = fit.local_translation(problem)
    sums = problem.one_step_sums(float(x), float(y))

    def ambiguity(at: RigidTransform) -> Ambiguity:
        return _ambiguity(sums, at, options)

    def moved(at: RigidTransform) -> RigidTransform:
        """Take a transform into the caller's map frame to the recentred one."""
        return RigidTransform(at.x - float(problem.map_origin[0]), at.y - float(problem.map_origin[1]), at.theta)

    at_pose = ambiguity(RigidTransform(float(x), float(y), fit.theta))
    return RegistrationDiagnostics(
        ambiguity=at_pose,
        ambiguity_before=ambiguity(moved(RigidTransform(0.0, 0.0, 0.0))),
        ambiguity_at=None if options.evaluate_at is None else ambiguity(moved(options.evaluate_at)),
        similarity=1.0 / at_pose.total if at_pose.total > sys.float_info.min else None,
        reliability=sums.reliability,
        determinant=sums.determinant,
        chi2=float(chi2),
        dof=2 * len(pairs) - (2 if fit.freedom.parallel else 3),
        rms_offset=_rms(offsets),
        rms_angle=_rms(angles),
        n=len(pairs),
    )


def _ambiguity(sums: OneStepSums, at: RigidTransform, options: RegistrationOptions) -> Ambiguity:
    return Ambiguity(
        options.k_translation * sums.translation_cost(at),
        options.k_rotation * sums.rotation_cost(at, options.rotation),
    )


def _offsets(pairs: Correspondences, points: Floats, fit: Fit) -> Floats:
    """Return the signed distances of moved scan points from their map lines, (n,) metres."""
    moved = points @ rotation_matrix(fit.theta).T + fit.translation
    distances: Floats = np.einsum("ij,ij->i", pairs.map_normals, moved - pairs.map_midpoints)
    return distances


def _inverse(information: Floats) -> Floats:
    """Invert a positive definite matrix of unlike units, scaled to a unit diagonal first."""
    scale = 1.0 / np.sqrt(np.diag(information))
    weighted = np.outer(scale, scale)
    inverse: Floats = np.linalg.inv(information * weighted) * weighted
    return inverse


def _rms(values: Floats) -> float:
    return math.sqrt(float(np.mean(values**2)))
