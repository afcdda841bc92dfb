"""Decide from the sums of a consensus set whether it fixes a pose, by the paper's reliability.

With ``A = sum a n n'`` over the pairs, the normal n of each wall and a weight a, ``W = trace A`` and ``D = det A``, the
paper's reliability is ``R = 2 sqrt(D) / W``, Eq. (28). The smaller eigenvalue of A is ``W (1 - sqrt(1 - R^2)) / 2``,
which is 0 where all walls are parallel.

Measured angles have errors. The weights are therefore the information of each pair's angle, ``a = w s``, with the
weight w of the pair and the spread s of its points. The smaller eigenvalue is then ``sum a sin^2`` of the angles to
their common direction. For parallel walls that is a chi-square with n - 1 degrees of freedom. If noise explains it, by
three standard deviations, the set is a family of poses along its walls, and fixes none of them.

A changes in constant time when a pair comes or goes, as all sums do.
"""

import math

from compiled import kernel
from registration.kernels import joint_cost
from registration.layout import Record

from ...tables import Workspace
from ..tuning import FREE_DEVIATION


@kernel
def add_angle(angles: Record, line: Record, information: float) -> None:
    """Add to the sums of angles a pair on a line of the map, with the information of its angle, 1/rad^2."""
    angles.xx += information * line.dy * line.dy
    angles.xy -= information * line.dx * line.dy
    angles.yy += information * line.dx * line.dx


@kernel
def clear_angles(angles: Record) -> None:
    """Set the sums of angles to those of no pair."""
    angles.xx = 0.0
    angles.xy = 0.0
    angles.yy = 0.0


@kernel
def reliability_of(angles: Record) -> float:
    """Return the reliability of a set, Eq. (28), by the information of its angles: 0 for parallel walls, to 1."""
    det = angles.xx * angles.yy - angles.xy * angles.xy
    weight = angles.xx + angles.yy
    return min(1.0, 2.0 * math.sqrt(max(det, 0.0)) / weight) if weight > 0.0 else 0.0


@kernel
def least_reliability(angles: Record, most_parallel: float) -> float:
    """Return the reliability up to which walls are parallel, at most 1.

    `most_parallel` is the chi-square l of their angles up to which they are: ``R^2 = 4 l (W - l) / W^2``.
    """
    weight = angles.xx + angles.yy
    part = most_parallel / weight if weight > 0.0 else 1.0
    return 2.0 * math.sqrt(part * (1.0 - part)) if part < 0.5 else 1.0


@kernel
def fixes_pose(work: Workspace) -> bool:
    """Return whether the pairs that are held fix a pose: their reliability is above that of parallel walls by noise."""
    scratch = work.scratch[0]
    most_parallel = work.parallel[int(scratch.plain.count)]
    return reliability_of(scratch.angles) > least_reliability(scratch.angles, most_parallel)


@kernel
def hold_along_walls(sums: Record, x: float, y: float, estimate: Record, terms: Record) -> None:
    """Move a pose back to where it was along the direction that its walls leave open, and widen its covariance there.

    The set fixes no pose. Its position along that direction is noise, which would move the pose by metres.
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
