"""Poses that odometry carries from usable scans of a visit to the scans next to them."""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from association import Deadline, MapIndex
from registration import RigidTransform

from ..views import Steps
from . import tuning
from .scans import Localized


def odometry_deviations(driven: float, turned: float) -> tuple[float, float]:
    """Return the standard deviations of position (m) and heading (rad) by odometry, after a way (m) and turns (rad)."""
    heading = tuning.ODOMETRY_TURN + tuning.ODOMETRY_TURN_A_METRE * driven + tuning.ODOMETRY_TURN_A_RADIAN * turned
    return tuning.ODOMETRY + tuning.ODOMETRY_A_METRE * driven, heading


@dataclass(frozen=True, slots=True, eq=False)
class Carrying:
    """Localizes scans that are not usable alone by the odometry of their visit.

    Attributes
    ----------
    index : MapIndex
    found : list of Localized
        Answers without odometry; replaced where odometry helps, with the carried pose as the sender's.
    deadline : Deadline
    until : float
        `time.monotonic()` seconds from which on no scan is searched.
    """

    index: MapIndex
    found: list[Localized]
    deadline: Deadline
    until: float = math.inf

    def carry(self) -> Steps[None]:
        """Carry poses forward and backward in each visit, one search at a step.

        1. Anchors are usable scans that another one of the visit confirms: the nearest before or after it agrees with
           it by odometry. A usable scan that none confirms, and that contradicts an anchor, is no evidence.
        2. The pose of the last anchor, moved on by odometry, is the prior of the next scan. If that is usable with it,
           its pose is carried on.
        3. If the next anchor contradicts what was carried to it, the scans between lose the carried poses.

        Raises
        ------
        CancelledError
            When the deadline was cancelled.
        """
        for visit in sorted({one.visit for one in self.found}):
            rows = [k for k, one in enumerate(self.found) if one.visit == visit and one.sent.odometry is not None]
            anchors = self._anchors([k for k in rows if self.found[k].usable])
            yield from self._along(rows, anchors)
            yield from self._along(rows[::-1], anchors)

    def _anchors(self, usable: Sequence[int]) -> set[int]:
        """Return the usable scans that another one confirms; mark those that only contradict one of these.

        If more pairs of neighbours contradict each other than agree, the odometry of the visit is not used.
        """
        pairs = list(itertools.pairwise(usable))
        agreeing = [pair for pair in pairs if self._is_near(*pair) and self._distance(*pair) <= tuning.AGREEING]
        against = [pair for pair in pairs if self._distance(*pair) > tuning.AGREEING]
        if len(against) > len(agreeing):
            return set()
        confirmed = {k for pair in agreeing for k in pair}
        for one in {k for pair in against if confirmed.intersection(pair) for k in pair} - confirmed:
            self.found[one] = replace(self.found[one], contradicted=True)
        return confirmed

    def _along(self, rows: Sequence[int], anchors: set[int]) -> Steps[None]:
        """Carry poses along some scans in this order, from anchor to anchor."""
        last: int | None = None
        alone: dict[int, Localized] = {}  # since the last anchor: answers without odometry
        for k in rows:
            one = self.found[k]
            if k in anchors:
                if last is not None and self._distance(last, k) > tuning.AGREEING:
                    for at, before in alone.items():
                        self.found[at] = before
                last, alone = k, {}
            elif last is not None and self._is_wanted(last, k):
                pose, covariance = self._predicted(last, k)
                carried = one.searched(self.index, self.deadline, replace(one.sent, pose=pose, covariance=covariance))
                yield
                if carried.located:
                    alone[k], self.found[k] = one, carried
                last = k if carried.precise else last

    def _is_wanted(self, last: int, k: int) -> bool:
        """Return whether a scan needs a pose, which another one can give, and there is time."""
        one, in_time = self.found[k], not self.deadline.passed and time.monotonic() <= self.until
        return in_time and not (one.located or one.held_back) and one.sent.pose is None and self._is_near(last, k)

    def _is_near(self, a: int, b: int) -> bool:
        """Return whether odometry between two scans is precise enough to tell anything."""
        return math.sqrt(np.diag(self._predicted(a, b)[1])[:2].max()) <= tuning.MOST_CONFIRMING_SIGMA

    def _distance(self, a: int, b: int) -> float:
        """Return the squared Mahalanobis distance of the poses of two scans by odometry."""
        pose, covariance = self._predicted(a, b)
        other = self.found[b]
        assert other.result.covariance is not None
        return pose.chi_square(other.pose, covariance + other.result.covariance)

    def _predicted(self, a: int, b: int) -> tuple[RigidTransform, np.ndarray]:
        """Return the pose of a scan by that of another and odometry, with its covariance."""
        known, begin, end = self.found[a], self.found[a].sent.odometry, self.found[b].sent.odometry
        assert begin is not None
        assert end is not None
        assert known.result.covariance is not None
        step = begin.inverse().compose(end)
        place, turn = odometry_deviations(math.hypot(step.x, step.y), abs(step.theta))
        moved = known.pose.carry(known.result.covariance, step)
        return known.pose.compose(step), moved + np.diag([place**2, place**2, turn**2])
