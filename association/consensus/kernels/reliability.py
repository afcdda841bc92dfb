"""Decide from the sums of a consensus set whether it fixes a pose, by the paper's reliability.

The position of a set is fixed by ``A = sum w n n'`` over its pairs, with the normal n and the weight w of each. Its
eigenvalues are ``W (1 +- sqrt(1 - R^2)) / 2``, with ``W = trace A`` and the paper's reliability R, Eq. (28). Walls that
are parallel leave the smaller eigenvalue, and R, at 0. Measured angles have errors, so that parallel walls show a
small one: each pair adds ``w v``, with the variance ``v = 1 / (w s)`` of its angle and the spread s of its points. That
is ``1 / s``. The sums of these and of their squares, N and M, change in constant time when a pair comes or goes, as all
sums do. By them the smaller eigenvalue of n parallel walls is about a chi-square, after Satterthwaite: its mean is
``N (1 - 1 / n)``, with ``N^2 / M - 1`` degrees of freedom. Where it is not above what noise exceeds as seldom as three
standard deviations, the set is parallel up to noise.
"""

import math

from compiled import kernel
from registration.kernels import joint_cost
from registration.layout import Record

from ..tuning import FREE_DEVIATION, PARALLEL_QUANTILE


@kernel
def reliability_of(sums: Record) -> float:
    """Return the paper's reliability of a set, Eq. (28): 0 for parallel walls, 1 for walls that fix all directions."""
    det = sums.xx * sums.yy - sums.xy * sums.xy
    weight = sums.xx + sums.yy
    return min(1.0, 2.0 * math.sqrt(max(det, 0.0)) / weight) if weight > 0.0 else 0.0


@kernel
def least_reliability(sums: Record, noise: Record) -> float:
    """Return the reliability up to which a set is parallel by the errors of its angles; 1 for fewer than two pairs.

    `sums` are those of the pairs, `noise` is their record of `ANGLE_NOISE`.

    With the smaller eigenvalue l up to which it is, ``R^2 = 4 l (W - l) / W^2``.
    """
    weight = sums.xx + sums.yy
    if sums.count < 2.0 or weight <= 0.0:
        return 1.0
    freedom = max(1.0, noise.total * noise.total / noise.squares - 1.0)
    mean = noise.total * (1.0 - 1.0 / sums.count)
    part = mean / freedom * parallel_chi_square(freedom) / weight
    return 2.0 * math.sqrt(part * (1.0 - part)) if part < 0.5 else 1.0


@kernel
def parallel_chi_square(freedom: float) -> float:
    """Return the chi-square of angles that noise exceeds as seldom as three deviations, after Wilson and Hilferty."""
    k = 2.0 / (9.0 * freedom)
    return freedom * (1.0 - k + PARALLEL_QUANTILE * math.sqrt(k)) ** 3


@kernel
def fixes_pose(sums: Record, noise: Record) -> bool:
    """Return whether the pairs of a set fix its pose: its reliability is more than parallel walls show by noise."""
    return reliability_of(sums) > least_reliability(sums, noise)


@kernel
def hold_along_walls(sums: Record, x: float, y: float, estimate: Record, terms: Record) -> None:
    """Move a pose back to where it was along the direction that its walls leave open, and widen its covariance there.

    Of a set that fixes no pose. What it shows of that direction is noise, which would move the pose by metres.
    """
    across = 0.5 * math.atan2(2.0 * sums.xy, sums.xx - sums.yy)
    ux = -math.sin(across)
    uy = math.cos(across)
    shift = (estimate.x - x) * ux + (estimate.y - y) * uy
    estimate.x -= shift * ux
    estimate.y -= shift * uy
    estimate.xx += FREE_DEVIATION * FREE_DEVIATION * ux * ux
    estimate.xy += FREE_DEVIATION * FREE_DEVIATION * ux * uy
    estimate.yy += FREE_DEVIATION * FREE_DEVIATION * uy * uy
    terms.chi_square = joint_cost(sums, estimate.theta, estimate.x, estimate.y)
