"""Fit a pose together with an offset that all walls share: walls of a grid, or ranges, that are too far by centimetres.

The walls of an occupancy grid are up to a cell thick, and a laser reads some centimetres too far or too near. Both
displace all walls that a scan sees the same way, toward the sensor or away from it. In a room this looks like a factor
on the lengths, and it moves the pose where the scan sees one side only.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from registration import RigidTransform
from registration.layout import Floats, Records
from registration.values import value

from ..context import SearchContext
from ..tuning import FACTOR_DEVIATIONS, LOOSE_WALLS, ROUGHNESS
from .consensus_set import ConsensusSet
from .tuning import ESTIMATION_ROUNDS, ROUGH_FRACTION

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
        None where the map's sigma is not known, where the scan does not tell the free side of a wall, with few lines,
        and where the offset is within `FACTOR_DEVIATIONS` of its deviations of 0.
    """
    if not context.index.sigma or context.scan.views is not None or np.count_nonzero(best.matched) < UNKNOWNS:
        return None
    sides = _sides(context, best)
    if sides is None:
        return None
    lines = _Lines.of(context, best, sides, wall_sigma)
    pose, offset = best.pose, 0.0
    for _ in range(ESTIMATION_ROUNDS):
        normal, right = lines.normal_equations(pose, offset)
        covariance = np.linalg.pinv(normal[:4, :4], hermitian=True)
        x, y, turn, more = (covariance @ right[:4]).tolist()
        pose, offset = RigidTransform(pose.x + x, pose.y + y, pose.theta + turn), offset + more
    deviation = math.sqrt(covariance[3, 3])
    if not abs(offset) > FACTOR_DEVIATIONS * deviation:
        return None
    normal, right = lines.normal_equations(pose, offset)
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


@dataclass(frozen=True, slots=True)
class _Lines:
    """The matched lines of a consensus set, (n,) each.

    `sides` is 1 where the free side of the wall is its left, else -1; `inverse` (n, n) is that of the covariance of
    the lines' offsets, 1/m^2; `slopes` has the information of the sines of their angles to the walls.
    """

    rows: Records
    walls: Records
    shifts: Floats
    sides: Floats
    inverse: Floats
    slopes: Floats

    @classmethod
    def of(cls, context: SearchContext, best: ConsensusSet, sides: Floats, wall_sigma: float) -> _Lines:
        """Gather them; the walls' own errors have the deviation `wall_sigma`."""
        matched = best.matched
        rows, matches = context.lines.rows[matched], best.matches[matched]
        numbers = matches["wall"]
        ties = context.index.ties[numbers]
        tied = (ties[:, None] >= 0.0) & (ties >= 0.0)
        one_wall = np.where(tied, np.exp(-np.abs(ties[:, None] - ties)), numbers[:, None] == numbers)
        variances = 1.0 / rows["weight"] - ROUGHNESS**2 + ROUGH_FRACTION * wall_sigma**2
        inverse = np.linalg.inv(np.diag(variances) + wall_sigma**2 * one_wall)
        walls = context.index.walls.rows[numbers]
        return cls(rows, walls, matches["shift"], sides, inverse, rows["spread"] / variances)

    def normal_equations(self, pose: RigidTransform, offset: float) -> tuple[Floats, Floats]:
        """Return the normal matrix (5, 5), and the right side (5,), of x, y, heading, offset and factor."""
        rows, walls = self.rows, self.walls
        c, s = math.cos(pose.theta), math.sin(pose.theta)
        x, y = c * rows["centroid_x"] - s * rows["centroid_y"], s * rows["centroid_x"] + c * rows["centroid_y"]
        along, across = walls["dx"] * x + walls["dy"] * y, walls["dx"] * y - walls["dy"] * x
        to_wall = walls["offset"] + self.shifts - walls["dx"] * pose.y + walls["dy"] * pose.x
        residuals = across - to_wall - self.sides * offset
        columns = np.stack([-walls["dy"], walls["dx"], along, -self.sides, across], axis=1)
        dx, dy = c * rows["dx"] - s * rows["dy"], s * rows["dx"] + c * rows["dy"]
        sines, cosines = walls["dx"] * dy - walls["dy"] * dx, walls["dx"] * dx + walls["dy"] * dy
        normal = columns.T @ self.inverse @ columns
        right = -columns.T @ self.inverse @ residuals
        normal[2, 2] += self.slopes @ cosines**2
        right[2] -= self.slopes @ (cosines * sines)
        normal[3, 3] += 1.0 / LOOSE_WALLS**2
        right[3] -= offset / LOOSE_WALLS**2
        return normal, right
