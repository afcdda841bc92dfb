"""Fit a pose together with an offset that all walls share: walls of a grid, or ranges, that are too far by centimetres.

The walls of an occupancy grid are up to a cell thick, and a laser reads some centimetres too far or too near. Both
displace all walls that a scan sees the same way, toward the sensor or away from it. In a room this looks like a factor
on the lengths, and it moves the pose where the scan sees one side only.
"""

from __future__ import annotations

import math

import numpy as np

from registration import RigidTransform
from registration.layout import Floats
from registration.values import value

from ..context import SearchContext
from ..tuning import FACTOR_DEVIATIONS, LOOSE_WALLS
from .consensus_set import ConsensusSet
from .matched_lines import MatchedLines, are_few
from .tuning import ESTIMATION_ROUNDS

UNKNOWNS = 5  # x, y, heading, offset, factor


@value(frozen=True, slots=True)
class CommonOffset:
    """A pose with the offset that all walls of its consensus set share.

    Attributes
    ----------
    pose : RigidTransform
        Index frame from scan frame.
    covariance : (3, 3)
        Of additive (x, y, theta), with the uncertainty of the offset.
    offset : float
        By how much the scan shows the walls on their free side, metres; negative where it shows them behind.
    deviation : float
        Its standard deviation.
    factor : float
        Factor on the scan's lengths, fitted together with the offset; the pose is without it.
    factor_deviation : float
        Its standard deviation.
    """

    pose: RigidTransform
    covariance: Floats
    offset: float
    deviation: float
    factor: float
    factor_deviation: float


def fit_common_offset(context: SearchContext, best: ConsensusSet, wall_sigma: float) -> CommonOffset | None:
    """Fit a pose and a common offset to a consensus set by least squares, linearized at its pose.

    Each matched line gives its offset from its wall and its angle to it. The walls' own errors have the deviation
    `wall_sigma`, common to the lines of one wall; the common offset has `LOOSE_WALLS`, and expectation 0.

    Returns
    -------
    CommonOffset or None
        None where the map's sigma is not known, where the scan does not tell the free side of a wall, with few lines or
        hundreds, and where the offset is within `FACTOR_DEVIATIONS` of its deviations of 0.
    """
    if not context.index.sigma or context.scan.views is not None or np.count_nonzero(best.matched) < UNKNOWNS:
        return None
    sides = _sides(context, best)
    if sides is None or not are_few(best):
        return None
    lines = MatchedLines.of(context, best, wall_sigma)
    pose, offset = best.pose, 0.0
    for _ in range(ESTIMATION_ROUNDS):
        normal, right = _normal_equations(lines, sides, pose, offset)
        covariance = np.linalg.pinv(normal[:4, :4], hermitian=True)
        x, y, turn, more = (covariance @ right[:4]).tolist()
        pose, offset = RigidTransform(pose.x + x, pose.y + y, pose.theta + turn), offset + more
    deviation = math.sqrt(covariance[3, 3])
    if not abs(offset) > FACTOR_DEVIATIONS * deviation:
        return None
    normal, right = _normal_equations(lines, sides, pose, offset)
    with_factor = np.linalg.pinv(normal, hermitian=True)
    factor = 1.0 + float((with_factor @ right)[4])
    of_pose = covariance[:3, :3].astype(np.float64)
    return CommonOffset(pose, of_pose, offset, deviation, factor, math.sqrt(with_factor[4, 4]))


def _sides(context: SearchContext, best: ConsensusSet) -> Floats | None:
    """Return 1 for each matched line whose wall has its free side on the left, -1 on the right; None if unknown."""
    walls = context.index.walls.rows[best.matches["wall"][best.matched]]
    if context.options.oriented:
        return np.ones(len(walls))
    if context.scan.viewpoint is None:
        return None
    x, y = best.pose.apply(np.array([context.scan.viewpoint]))[0]
    left: Floats = walls["dx"] * y - walls["dy"] * x - walls["offset"]
    return np.where(left >= 0.0, 1.0, -1.0)


def _normal_equations(lines: MatchedLines, sides: Floats, pose: RigidTransform, offset: float) -> tuple[Floats, Floats]:
    """Return the normal matrix (5, 5), and the right side (5,), of x, y, heading, offset and factor."""
    at = lines.at(pose)
    columns = np.stack([*at.of_pose.T, -sides, at.across], axis=1)
    of_angles = np.pad(at.angle_of_pose, ((0, 0), (0, 2)))
    normal, right = lines.normal_equations(at.offsets - sides * offset, columns, at.sines, of_angles)
    normal[3, 3] += 1.0 / LOOSE_WALLS**2
    right[3] -= offset / LOOSE_WALLS**2
    return normal, right
