"""The transform from the map to the odometry frame, for a robot without another localizer (REP 105). No DDS in here."""

from __future__ import annotations

import math
from dataclasses import dataclass

from registration import RigidTransform, wrap_angle

from .agreement import Event, Observation
from .tuning import CORRECTION_SPEED, CORRECTION_TURN_RATE

SECOND = 1_000_000_000


@dataclass(slots=True)
class MapToOdom:
    """Follows the agreed poses; small corrections are spread over time, a newly agreed pose holds at once.

    Attributes
    ----------
    current : RigidTransform or None
        map_from_odom, as it is published; None before a pose is agreed.
    """

    current: RigidTransform | None = None
    _target: RigidTransform | None = None
    _stamp: int = 0

    def take(self, event: Event, scan: Observation) -> None:
        """Take a scan that is agreed or confirmed; others, and those without odometry, change nothing."""
        if event not in (Event.AGREED, Event.CONFIRMED) or scan.pose is None or scan.odometry is None:
            return
        self._target = scan.pose.compose(scan.odometry.inverse())
        if event is Event.AGREED or self.current is None:
            self.current, self._stamp = self._target, scan.stamp

    def advance(self, stamp: int, odometry: RigidTransform) -> RigidTransform | None:
        """Return map_from_odom at a time.

        Parameters
        ----------
        stamp : int
            Nanoseconds.
        odometry : RigidTransform
            odom_from_base: the correction is limited where the robot is, not at the origin of odometry.
        """
        if self.current is None or self._target is None:
            return None
        seconds = min(1.0, max(0.0, (stamp - self._stamp) / SECOND))
        self._stamp = stamp
        here, there = self.current.compose(odometry), self._target.compose(odometry)
        distance, angle = math.hypot(there.x - here.x, there.y - here.y), wrap_angle(there.theta - here.theta)
        needed = max(distance / CORRECTION_SPEED, abs(angle) / CORRECTION_TURN_RATE)
        if needed <= seconds:
            self.current = self._target
        elif seconds > 0.0:
            part = seconds / needed
            mixed = RigidTransform(
                here.x + part * (there.x - here.x), here.y + part * (there.y - here.y), here.theta + part * angle
            )
            self.current = mixed.compose(odometry.inverse())
        return self.current

    def reset(self) -> None:
        """Forget the pose, as when the map changed or the clock was set back."""
        self.current, self._target, self._stamp = None, None, 0
