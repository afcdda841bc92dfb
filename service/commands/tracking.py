"""What is known of a pose from the last one and the odometry since: the prior of the next scan."""

from __future__ import annotations

import math
from dataclasses import dataclass

from registration import RigidTransform

from .service import Json

# What odometry is trusted with, as standard deviations: at rest, for each metre driven, for each radian turned.
METRES, METRES_A_METRE = 0.1, 0.1
RADIANS, RADIANS_A_METRE, RADIANS_A_RADIAN = 0.05, 0.02, 0.1
LOST = 5.0  # m; a prior that says less than this is none


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

    def prior(self, odometry: RigidTransform | None) -> Json | None:
        """Return what is known of the pose of the next scan, None where nothing is.

        Parameters
        ----------
        odometry : RigidTransform or None
            odom_from_sensor at its time.
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
        sigma = METRES + METRES_A_METRE * self._driven
        angle = RADIANS + RADIANS_A_METRE * self._driven + RADIANS_A_RADIAN * self._turned
        if sigma > LOST:
            return None
        here = self._pose.compose(self._odometry.inverse().compose(odometry))
        covariance = [[sigma**2, 0.0, 0.0], [0.0, sigma**2, 0.0], [0.0, 0.0, angle**2]]
        return {"x": here.x, "y": here.y, "theta": here.theta, "covariance": covariance}

    def learn(self, answer: Json, odometry: RigidTransform | None) -> None:
        """Take up what came of that scan."""
        if any(one["code"] == "prior_contradicted" for one in answer["warnings"]):
            self._pose = None
        elif answer["usable"]:
            pose = answer["pose"]
            self._pose, self._odometry = RigidTransform(pose["x"], pose["y"], pose["theta"]), odometry
            self._driven = self._turned = 0.0
