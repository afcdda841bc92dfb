"""The motion of the robot between two times, and its speed at one, from odometry."""

from __future__ import annotations

import bisect
import math
from collections import deque
from dataclasses import dataclass

from registration import IDENTITY, RigidTransform

from .messages import Odometry, Time
from .transforms import NS, matrix_of, planar
from .tuning import CLOCK_BACK_NS, MAX_SPEED, MAX_TURN_RATE, STALE_NS

KEPT = 2000  # messages; 20 s at 100 Hz
FRESH_NS = NS // 5  # a speed does not hold for longer


@dataclass(frozen=True, slots=True)
class Speed:
    """The speed of the robot: m/s and rad/s, in its base frame."""

    vx: float
    vy: float
    omega: float

    def carried(self, by: RigidTransform) -> Speed:
        """Return the speed of a frame that is fixed to this one, by its pose in this one."""
        vx, vy = self.vx - self.omega * by.y, self.vy + self.omega * by.x
        c, s = math.cos(by.theta), math.sin(by.theta)
        return Speed(c * vx + s * vy, c * vy - s * vx, self.omega)


def nanoseconds(stamp: Time) -> int:
    """Return a time as one number."""
    return int(stamp.sec) * NS + int(stamp.nanosec)


class OdometryHistory:
    """The newest poses and speeds of the robot in its odometry frame.

    Attributes
    ----------
    frame : str
        The odometry frame; empty before the first message.
    """

    def __init__(self) -> None:
        self.frame = ""
        self._stamps: deque[int] = deque(maxlen=KEPT)
        self._poses: deque[RigidTransform] = deque(maxlen=KEPT)
        self._speeds: deque[Speed] = deque(maxlen=KEPT)

    def take(self, message: Odometry, child_from_base: RigidTransform = IDENTITY) -> None:
        """Take a message; when the clock is set back, as when a bag is played again, all before is forgotten.

        Parameters
        ----------
        message : Odometry
            Of its child frame, twist as well.
        child_from_base : RigidTransform
            Pose of the base frame in the child frame.

        Raises
        ------
        ValueError
            When it is no pose, or no speed.
        """
        pose, twist = message.pose.pose, message.twist.twist
        place, turn = pose.position, pose.orientation
        matrix = matrix_of(place.x, place.y, place.z, (turn.x, turn.y, turn.z, turn.w))
        speed = Speed(twist.linear.x, twist.linear.y, twist.angular.z)
        if not (math.hypot(speed.vx, speed.vy) <= MAX_SPEED and abs(speed.omega) <= MAX_TURN_RATE):
            raise ValueError(
                f"found a twist of {speed.vx:.4g} m/s, {speed.vy:.4g} m/s and {speed.omega:.4g} rad/s, "
                f"expected at most {MAX_SPEED:g} m/s and {MAX_TURN_RATE:g} rad/s"
            )
        stamp = nanoseconds(message.header.stamp)
        if self._stamps and stamp <= self._stamps[-1]:
            if self._stamps[-1] - stamp <= CLOCK_BACK_NS:
                return  # out of order
            self._stamps.clear()
            self._poses.clear()
            self._speeds.clear()
        self.frame = message.header.frame_id.strip("/")
        self._stamps.append(stamp)
        self._poses.append(planar(matrix)[0].compose(child_from_base))
        self._speeds.append(speed.carried(child_from_base))

    @property
    def newest(self) -> tuple[int, RigidTransform] | None:
        """The newest time, nanoseconds, and odom_from_base at it."""
        return (self._stamps[-1], self._poses[-1]) if self._stamps else None

    def awaited(self, stamp: Time) -> bool:
        """Return whether odometry arrives, but has not reached a stamp."""
        behind = nanoseconds(stamp) - self._stamps[-1] if self._stamps else 0
        return 0 < behind <= STALE_NS

    def speed(self, at: int) -> Speed | None:
        """Return the speed of the robot at a time, nanoseconds; None where it is not known."""
        after = bisect.bisect_left(self._stamps, at)
        near = range(max(0, after - 1), min(after + 1, len(self._stamps)))
        nearest = min(near, key=lambda k: abs(self._stamps[k] - at), default=None)
        if nearest is None or abs(self._stamps[nearest] - at) > FRESH_NS:
            return None
        return self._speeds[nearest]

    def between(self, begin: int, end: int) -> RigidTransform | None:
        """Return where the robot was at `end`, relative to where it was at `begin`; None where that is not known.

        Times are in nanoseconds.
        """
        if begin == end:
            return IDENTITY
        a, b = self.at(begin), self.at(end)
        return None if a is None or b is None else a.inverse().compose(b)

    def step(self, begin: Time, end: Time) -> RigidTransform | None:
        """Return `between` of two stamps of messages."""
        return self.between(nanoseconds(begin), nanoseconds(end))

    def at(self, stamp: int) -> RigidTransform | None:
        """Return odom_from_base at a time, nanoseconds; None where it is not known."""
        if not self._stamps:
            return None
        after = bisect.bisect_left(self._stamps, stamp)
        if after in (0, len(self._stamps)):
            end = min(after, len(self._stamps) - 1)
            return self._poses[end] if abs(self._stamps[end] - stamp) <= STALE_NS else None
        begin, end = self._stamps[after - 1], self._stamps[after]
        a, b = self._poses[after - 1], self._poses[after]
        fraction = (stamp - begin) / (end - begin)
        step = a.inverse().compose(b)
        return a.compose(RigidTransform(fraction * step.x, fraction * step.y, fraction * step.theta))
