"""A scored consensus set: the search makes them of its poses, and the verdict weighs them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from registration import RigidTransform
from registration.layout import Floats, Records
from registration.values import value

from ..layout import ESTIMATE, MATCH
from ..options import Estimator
from .tuning import BEAMS_PASSED, BEAMS_READ


@value(frozen=True, slots=True)
class ConsensusSet:
    """A pose with the correspondences that support it, and its score: one explanation of the scan.

    Attributes
    ----------
    estimate : (1,) of `ESTIMATE`
        Index frame from scan frame; the covariance has the model's slack in it.
    score : float
        Log-likelihood over that of a scan that is all clutter, nats; without the prior.
    posterior : float
        Score and prior together, nats.
    inside : bool
        True if it lies within a hard prior's window, and without one.
    chi_square : float
        Of the offsets and angles of all pairs; the score takes half of it.
    one_step_chi_square : float
        Of the same pairs at the paper's estimate, Wahba's rotation first.
    length : float
        Of the matched segments together, metres.
    fraction : float
        Of the scan's length that is matched, 0 to 1.
    misfit : float
        Mean squared offset over what the sigmas alone expect.
    blocked : float
        Penalty in the score for lines of sight through walls, nats.
    read, passed : float
        Fractions of the beams that read the wall they should, and that passed through one; 0 without beams.
    count : float
        Rows of the scan that are matched; those that hardly are count in part.
    matches : (n,) of `MATCH`
        By row of the scan.
    """

    estimate: Records
    score: float
    posterior: float
    inside: bool
    chi_square: float
    one_step_chi_square: float
    length: float
    fraction: float
    misfit: float
    blocked: float
    read: float
    passed: float
    count: float
    matches: Records

    @classmethod
    def of(
        cls, estimate: Records, scores: tuple[float, ...], matches: Records, *, posterior: float, inside: bool
    ) -> ConsensusSet:
        """Return the set of a record of `SET_SCORE`, given as a tuple, and of the other arguments by name."""
        score, chi_square, one_step, length, fraction, misfit, blocked, read, passed, count = scores
        sums, seen = (chi_square, one_step), (length, fraction, misfit, blocked)
        return cls(estimate, score, posterior, inside, *sums, *seen, read, passed, count, matches)

    @property
    def pose(self) -> RigidTransform:
        """Index frame from scan frame."""
        theta, x, y, *_ = self.estimate[0].item()
        return RigidTransform(x, y, theta)

    @property
    def scores(self) -> tuple[float, ...]:
        """The same numbers in the order of `SET_SCORE`."""
        sums = self.score, self.chi_square, self.one_step_chi_square
        seen = self.length, self.fraction, self.misfit, self.blocked
        return *sums, *seen, self.read, self.passed, self.count

    @property
    def by_segments(self) -> float:
        """The score without the beams' part."""
        return self.score - BEAMS_READ * self.read + BEAMS_PASSED * self.passed

    def score_by(self, estimator: Estimator) -> float:
        """Return the score by the sums at an estimator's pose; that of the joint one orders and judges."""
        return self.score if estimator == "joint" else self.score + 0.5 * (self.chi_square - self.one_step_chi_square)

    @property
    def covariance(self) -> Floats:
        """Of additive (x, y, theta), (3, 3)."""
        _, _, _, xx, xy, xt, yy, yt, tt = self.estimate[0].item()
        return np.array((xx, xy, xt, xy, yy, yt, xt, yt, tt)).reshape(3, 3)

    @property
    def deviation(self) -> float:
        """Standard deviation of the position along its weakest direction, metres."""
        _, _, _, xx, xy, _, yy, _, _ = self.estimate[0].item()
        return math.sqrt(0.5 * (xx + yy) + math.hypot(0.5 * (xx - yy), xy))

    @property
    def matched(self) -> NDArray[np.bool_]:
        """Which rows of the scan are matched, (n,)."""
        found: NDArray[np.bool_] = self.matches["wall"] >= 0
        return found


def poses_of(sets: Sequence[ConsensusSet]) -> Records:
    """Return the poses of consensus sets for the kernels, (k,) of `ESTIMATE`."""
    return np.frombuffer(bytearray().join(one.estimate.tobytes() for one in sets), ESTIMATE)


def matches_of(sets: Sequence[ConsensusSet]) -> Records:
    """Return the matches of consensus sets for the kernels, (k, n) of `MATCH`."""
    together = bytearray().join(one.matches.tobytes() for one in sets)
    return np.frombuffer(together, MATCH).reshape(len(sets), -1)
