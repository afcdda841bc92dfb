"""A robot along a log: the prior of the next scan by odometry, and the maps that it was on."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from linefix import SoftPrior
from map_quality.update.odometry import odometry_deviations
from registration import RigidTransform

from .locators import Found

LOST = 5.0  # m; a prior wider than this is dropped


@dataclass(slots=True)
class Tracker:
    """Follows the last usable pose by odometry.

    A prior is weighed against the scan and never fused with it, so that a wrong one shows: where an answer contradicts
    it everything is forgotten, and the next scan is looked for all over the map.
    """

    _pose: RigidTransform | None = None
    _odometry: RigidTransform | None = None  # when that pose was found
    _last: RigidTransform | None = None  # of the scan before
    _driven: float = 0.0
    _turned: float = 0.0
    map_id: str | None = None  # of several maps the one that the last usable pose is on

    def prior(self, odometry: RigidTransform | None) -> SoftPrior | None:
        """Return the prior of the next scan's pose, None without one.

        Parameters
        ----------
        odometry : RigidTransform or None
            odom_from_base at its time; of the sensor where its poses are located.
        """
        if odometry is None or self._last is None:
            self._pose = None if odometry is None else self._pose
        else:
            step = self._last.inverse().compose(odometry)
            self._driven += math.hypot(step.x, step.y)
            self._turned += abs(step.theta)
        self._last = odometry
        if self._pose is None or self._odometry is None or odometry is None:
            return None
        sigma, angle = odometry_deviations(self._driven, self._turned)
        if sigma > LOST:
            return None
        here = self._pose.compose(self._odometry.inverse().compose(odometry))
        return SoftPrior(here, np.diag([sigma**2, sigma**2, angle**2]))

    def learn(self, found: Found, odometry: RigidTransform | None) -> None:
        """Update the last usable pose with the answer to that scan."""
        if "prior_contradicted" in found.warnings:
            self._pose = None
        elif found.usable:
            self._pose, self._odometry, self.map_id = found.pose, odometry, found.map_id
            self._driven = self._turned = 0.0


@dataclass(slots=True)
class Stay:
    """A part of a log with usable poses on one map; `first` and `last` are stamps of scans, seconds."""

    map_id: str
    first: float
    last: float
    scans: int = 1


@dataclass(slots=True)
class Stays:
    """The stays so far, in the order of the log; none where a single map is searched."""

    found: list[Stay] = field(default_factory=list)

    def take(self, stamp_ns: int, found: Found) -> None:
        """Add an answer; one that is not usable begins no stay and ends none."""
        if not found.usable or found.map_id is None:
            return
        stamp, last = 1e-9 * stamp_ns, self.found[-1] if self.found else None
        if last is None or last.map_id != found.map_id:
            self.found.append(Stay(found.map_id, stamp, stamp))
        else:
            last.last, last.scans = stamp, last.scans + 1
