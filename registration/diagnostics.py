"""From a fit to a result: the pose, its covariance, and its diagnostics."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np

from .kernels.observability import FIXED, FREE, PARALLEL
from .layout import Floats, Records
from .observability import chi_square_quantile
from .options import RegistrationOptions
from .result import Ambiguity, RegistrationDiagnostics, RegistrationResult
from .transform import RigidTransform
from .weights import PairWeights

TAIL = 0.001  # chance that chi2 of right pairs is larger; an answer beyond it is not usable


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


def result_of(
    fitted: Records, offsets: Floats, angles: Floats, weights: PairWeights, options: RegistrationOptions
) -> RegistrationResult:
    """Return what a fit answers, (1,) of `FITTED`, which leaves `offsets` and `angles`, (n,) each."""
    numbers: Any = fitted.item()
    (
        (theta, x, y), _, (xx, xy, xt, yy, yt, tt), free, free_x, free_y, _, unique, against, count,
        chi2, rms_offset, rms_angle, *costs, determinant, reliability,
    ) = numbers  # fmt: skip

    def ambiguity(translation: float, rotation: float) -> Ambiguity:
        return Ambiguity(options.k_translation * translation, options.k_rotation * rotation)

    at_pose, before = ambiguity(*costs[:2]), ambiguity(*costs[2:4])
    degenerate, dof = free != FIXED or not unique, 2 * count - (2 if free == PARALLEL else 3)
    fits = chi2 <= chi_square_quantile(dof, TAIL) and not (options.oriented and against)
    has_covariance = not degenerate and options.estimator == "joint"
    return RegistrationResult(
        degenerate=degenerate,
        usable=not degenerate and fits,
        pose=RigidTransform(x, y, theta),
        covariance=np.array((xx, xy, xt, xy, yy, yt, xt, yt, tt)).reshape(3, 3) if has_covariance else None,
        unobservable=(free_x, free_y) if free in (FREE, PARALLEL) else None,
        offsets=offsets,
        angles=angles,
        weights=weights.used,
        diagnostics=RegistrationDiagnostics(
            ambiguity=at_pose,
            ambiguity_before=before,
            ambiguity_at=None if options.evaluate_at is None else ambiguity(*costs[4:]),
            similarity=1.0 / at_pose.total if at_pose.total > sys.float_info.min else None,
            reliability=reliability,
            determinant=determinant,
            chi2=chi2,
            dof=dof,
            rms_offset=rms_offset,
            rms_angle=rms_angle,
            pairs=count,
        ),
    )
