"""The matched lines of a consensus set, and least squares over them: for a pose together with other unknowns."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from registration import RigidTransform
from registration.layout import Floats, Records

from ..context import SearchContext
from ..tuning import ROUGHNESS
from .consensus_set import ConsensusSet
from .tuning import PAIRS_COMPARED, ROUGH_FRACTION


def are_few(best: ConsensusSet) -> bool:
    """Return whether the matched lines are few enough for `MatchedLines`, of which the time grows with their cube."""
    return int(np.count_nonzero(best.matched)) ** 2 <= PAIRS_COMPARED


@dataclass(frozen=True, slots=True)
class MatchedLines:
    """The matched lines of a consensus set, (n,) each.

    Attributes
    ----------
    rows : (n,) of `LINE`
        In the scan frame.
    walls : (n,) of `WALL`
        That each is on.
    shifts : (n,)
        Of the line under each from the wall's own, metres.
    inverse : (n, n)
        Of the covariance of the lines' offsets from their walls, 1/m^2.
    slopes : (n,)
        The information of the sines of their angles to the walls.
    """

    rows: Records
    walls: Records
    shifts: Floats
    inverse: Floats
    slopes: Floats

    @classmethod
    def of(cls, context: SearchContext, best: ConsensusSet, wall_sigma: float) -> MatchedLines:
        """Gather them; the walls' own errors have the deviation `wall_sigma`, common to the lines of one wall."""
        matched = best.matched
        rows, matches = context.lines.rows[matched], best.matches[matched]
        numbers = matches["wall"]
        ties = context.index.ties[numbers]
        tied = (ties[:, None] >= 0.0) & (ties >= 0.0)
        one_wall = np.where(tied, np.exp(-np.abs(ties[:, None] - ties)), numbers[:, None] == numbers)
        variances = 1.0 / rows["weight"] - ROUGHNESS**2 + ROUGH_FRACTION * wall_sigma**2
        inverse = np.linalg.inv(np.diag(variances) + wall_sigma**2 * one_wall)
        return cls(rows, context.index.walls.rows[numbers], matches["shift"], inverse, rows["spread"] / variances)

    def at(self, pose: RigidTransform) -> LinesAtPose:
        """Return where they lie at a pose, index frame from scan frame."""
        rows, walls = self.rows, self.walls
        c, s = math.cos(pose.theta), math.sin(pose.theta)
        x, y = c * rows["centroid_x"] - s * rows["centroid_y"], s * rows["centroid_x"] + c * rows["centroid_y"]
        to_wall = walls["offset"] + self.shifts - walls["dx"] * pose.y + walls["dy"] * pose.x
        across = walls["dx"] * y - walls["dy"] * x
        dx, dy = c * rows["dx"] - s * rows["dy"], s * rows["dx"] + c * rows["dy"]
        sines = walls["dx"] * dy - walls["dy"] * dx
        return LinesAtPose(walls["dx"], walls["dy"], x, y, dx, dy, across, across - to_wall, sines)

    def normal_equations(
        self, offsets: Floats, of_offsets: Floats, sines: Floats, of_sines: Floats
    ) -> tuple[Floats, Floats]:
        """Return the normal matrix (k, k), and the right side (k,), of the step that brings offsets and sines to 0.

        Parameters
        ----------
        offsets, sines : (n,)
        of_offsets, of_sines : (n, k)
            Their derivatives by the unknowns.
        """
        normal: Floats = of_offsets.T @ self.inverse @ of_offsets + of_sines.T @ (self.slopes[:, None] * of_sines)
        right: Floats = -(of_offsets.T @ (self.inverse @ offsets)) - of_sines.T @ (self.slopes * sines)
        return normal, right


@dataclass(frozen=True, slots=True)
class LinesAtPose:
    """Matched lines at a pose, (n,) each, with the axes of the index frame.

    Attributes
    ----------
    wall_dx, wall_dy
        The directions of their walls.
    x, y
        From the origin of the scan frame to their centroids, metres.
    dx, dy
        Their directions.
    across
        The part of (x, y) to the left of the wall's direction, metres.
    offsets
        By how much each lies to the left of its wall, metres.
    sines
        Of the angle from the wall to it.
    """

    wall_dx: Floats
    wall_dy: Floats
    x: Floats
    y: Floats
    dx: Floats
    dy: Floats
    across: Floats
    offsets: Floats
    sines: Floats

    @property
    def of_pose(self) -> Floats:
        """The derivatives of the offsets by x, y and heading, (n, 3)."""
        along = self.wall_dx * self.x + self.wall_dy * self.y
        return np.stack([-self.wall_dy, self.wall_dx, along], axis=1)

    @property
    def angle_of_pose(self) -> Floats:
        """The derivatives of the sines by x, y and heading, (n, 3)."""
        cosines = self.wall_dx * self.dx + self.wall_dy * self.dy
        nothing = np.zeros_like(cosines)
        return np.stack([nothing, nothing, cosines], axis=1)
