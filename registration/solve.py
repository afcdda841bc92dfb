"""Known correspondences to a pose: the main path."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from .correspondences import Correspondences
from .diagnostics import no_answer, result_of
from .kernels.fitting import fit
from .layout import FITTED, FITTING, Records, record
from .observability import most_parallel
from .options import Estimator, RegistrationOptions, Rotation
from .result import RegistrationResult
from .segments import MeasuredSegments, Segments
from .transform import RigidTransform
from .weights import PairWeights, weigh

DEFAULT_OPTIONS = RegistrationOptions()
NOT_KNOWN = np.zeros(0)


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

    noise = NOT_KNOWN if weights.noise is None else weights.noise
    fitted = record(FITTED)
    how = _how(weights, options, at)
    offsets, angles = fit(given.rows, weights.used, weights.information, noise, how, fitted)
    return result_of(fitted, offsets, angles, weights, options)


def _how(weights: PairWeights, options: RegistrationOptions, at: RigidTransform | None) -> Records:
    """Return what the fit goes by, (1,) of `FITTING`."""
    # None but a caller's own weights are 0.
    count = len(weights.used) if options.weights is None else int(np.count_nonzero(weights.used))
    informed = weights.information is weights.used
    usual = _usual(options.estimator, options.rotation, count, oriented=options.oriented, informed=informed)
    how = np.frombuffer(bytearray(usual), FITTING)
    for place, pose in (("at", at), ("other", options.evaluate_at)):
        if pose is not None:
            how[place] = pose.theta, pose.x, pose.y
    if at is not None:
        how["given"] = 1
    if options.evaluate_at is not None:
        how["elsewhere"] = 1
    return how


@lru_cache
def _usual(estimator: Estimator, rotation: Rotation, count: int, *, oriented: bool, informed: bool) -> bytes:
    """Return a `FITTING` without a pose, for so many pairs that count, as bytes: numpy takes long to make one."""
    how = record(FITTING)
    how["one_step"], how["covariance"] = estimator == "one_step", estimator == "joint"
    how["wahba"], how["oriented"], how["informed"] = rotation == "wahba", oriented, informed
    how["parallel"] = most_parallel(count)
    return how.tobytes()
