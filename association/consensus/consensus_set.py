"""A scored consensus set: the search makes them of its poses, and the verdict weighs them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from registration import RigidTransform
from registration.kernels import MAX_DEVIATION
from registration.layout import Floats, Records


@dataclass(frozen=True, slots=True)
class ConsensusSet:
    """A pose with the correspondences that support it, and its score: one explanation of the scan.

    Attributes
    ----------
    estimate : (1,) of `ESTIMATE`
        Index frame from scan frame, with the covariance by the search's model.
    score : float
        With beams and lines of sight, nats, over a scan that is all clutter.
    posterior : float
        Score and prior.
    inside : bool
        True unless it lies outside the window of a hard prior.
    by_pairs : float
        The score of the pairs alone: gains less half of the chi-square, less the log-determinant.
    matches : (n,) of `MATCH`
    parts : (n,)
        Weight of each match, 0 to 1: one that scores little counts in part.
    """

    estimate: Records
    score: float
    posterior: float
    inside: bool
    by_pairs: float
    matches: Records
    parts: Floats

    @property
    def pose(self) -> RigidTransform:
        """Index frame from scan frame."""
        theta, x, y, *_ = self.estimate[0].item()
        return RigidTransform(x, y, theta)

    @property
    def matched(self) -> NDArray[np.bool_]:
        """Which rows of the scan are matched, (n,)."""
        found: NDArray[np.bool_] = self.matches["wall"] >= 0
        return found

    @property
    def free(self) -> bool:
        """Return whether a direction of the position is open: its deviation exceeds 0.5 m."""
        xx, xy, yy = (float(self.estimate[name][0]) for name in ("xx", "xy", "yy"))
        return bool(0.5 * (xx + yy) + math.hypot(0.5 * (xx - yy), xy) > MAX_DEVIATION**2)

    def fraction(self, lines: Records) -> float:
        """Return the fraction of the scan's length that is matched."""
        return float(self.parts @ lines["length"]) / float(lines["length"].sum())
