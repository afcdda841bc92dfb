"""Known correspondences to a pose: the main path."""

from __future__ import annotations

from numpy.typing import ArrayLike

from .chi_square import chi_square_quantile
from .correspondences import Correspondences
from .diagnostics import Residuals, covariance_of, diagnose, no_answer
from .estimate import Problem, fit_at, fit_joint, fit_one_step
from .options import RegistrationOptions
from .result import RegistrationResult
from .segments import MeasuredSegments, Segments
from .transform import RigidTransform
from .weights import weigh

TAIL = 0.001  # chance that chi2 of right pairs is larger; an answer beyond it is not usable
DEFAULT_OPTIONS = RegistrationOptions()


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
    given = Correspondences.of(map_segments, scan, pairs)
    weights = weigh(given, map_sigma, options)
    if not len(given):
        return no_answer(options)

    problem = Problem.of(given, weights, oriented=options.oriented)
    if at is not None:
        fit = fit_at(problem, at)
    else:
        fit = (fit_joint if options.estimator == "joint" else fit_one_step)(problem, options)
    degenerate = fit.freedom.degenerate or not problem.unique

    residuals = Residuals.of(problem, fit)
    diagnostics = diagnose(problem, fit, residuals, options)
    reversed_pair = options.oriented and residuals.against
    has_covariance = not degenerate and options.estimator == "joint"
    return RegistrationResult(
        degenerate=degenerate,
        usable=not degenerate and diagnostics.chi2 <= chi_square_quantile(diagnostics.dof, TAIL) and not reversed_pair,
        pose=problem.map_from_local.compose(fit.local_from_scan),
        covariance=covariance_of(problem, fit) if has_covariance else None,
        unobservable=fit.freedom.direction,
        offsets=residuals.offsets,
        angles=residuals.angles,
        weights=weights.used,
        diagnostics=diagnostics,
    )
