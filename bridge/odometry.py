"""How the robot moved between two times, and how fast at one, by what its odometry said."""

from __future__ import annotations

import bisect
import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from registration import RigidTransform

from .frames import NS, matrix_of
from .messages import Odometry, Time
from .tuning import MAX_SPEED, MAX_TURN_RATE

KEPT = 2000  # messages; 20 s at 100 Hz
STALE_NS = NS // 2  # a robot is not known to be where it was longer ago than this,
FRESH_NS = NS // 5  # nor to move as fast


@dataclass(frozen=True, slots=True)
class Speed:
    """How fast the robot moves: m/s and rad/s, in its own frame."""

    vx: float
    vy: float
    omega: float


def nanoseconds(stamp: Time) -> int:
    """Return a time as one number."""
    return int(stamp.sec) * NS + int(stamp.nanosec)


class Heard:
    """What odometry said of late."""

    def __init__(self) -> None:
        self._stamps: deque[int] = deque(maxlen=KEPT)
        self._poses: deque[RigidTransform] = deque(maxlen=KEPT)
        self._speeds: deque[Speed] = deque(maxlen=KEPT)

    def hear(self, message: Odometry) -> None:
        """Take what was said; when the clock goes back, as when a bag is played again, all before is forgotten.

        Raises
        ------
        ValueError
            When it is no pose, or no speed.
        """
        pose, twist = message.pose.pose, message.twist.twist
        place, turn = pose.position, pose.orientation
        matrix = matrix_of(place.x, place.y, place.z, (turn.x, turn.y, turn.z, turn.w))
        found = RigidTransform(place.x, place.y, math.atan2(matrix[1, 0], matrix[0, 0]))
        speed = Speed(twist.linear.x, twist.linear.y, twist.angular.z)
        if not (math.hypot(speed.vx, speed.vy) <= MAX_SPEED and abs(speed.omega) <= MAX_TURN_RATE):
            raise ValueError(
                f"found a twist of {speed.vx:.4g} m/s, {speed.vy:.4g} m/s and {speed.omega:.4g} rad/s, "
                f"expected at most {MAX_SPEED:g} m/s and {MAX_TURN_RATE:g} rad/s"
            )
        stamp = nanoseconds(message.header.stamp)
        if self._stamps and stamp <= self._stamps[-1]:
            self._stamps.clear()
            self._poses.clear()
            self._speeds.clear()
        self._stamps.append(stamp)
        self._poses.append(found)
        self._speeds.append(speed)

    def speed(self, at: int) -> Speed | None:
        """Return how fast the robot moved at a time, nanoseconds; None where nobody said."""
        after = bisect.bisect_left(self._stamps, at)
        near = range(max(0, after - 1), min(after + 1, len(self._stamps)))
        nearest = min(near, key=lambda k: abs(self._stamps[k] - at), default=None)
        if nearest is None or abs(self._stamps[nearest] - at) > FRESH_NS:
            return None
        return self._speeds[nearest]

    def step(self, begin: Time, end: Time) -> RigidTransform | None:
        """Return where the robot was at `end` as seen from where it was at `begin`; None where nobody said."""
        if begin == end:
            return RigidTransform(0.0, 0.0, 0.0)
        places = [self._at(nanoseconds(stamp)) for stamp in (begin, end)]
        if places[0] is None or places[1] is None:
            return None
        return places[0].inverse().compose(places[1])

    def _at(self, stamp: int) -> RigidTransform | None:
        if not self._stamps:
            return None
        after = bisect.bisect_left(self._stamps, stamp)
        if after in (0, len(self._stamps)):
            end = min(after, len(self._stamps) - 1)
            return self._poses[end] if abs(self._stamps[end] - stamp) <= STALE_NS else None
        a, b = self._poses[after - 1], self._poses[after]
        share = (stamp - self._stamps[after - 1]) / (self._stamps[after] - self._stamps[after - 1])
        step = a.inverse().compose(b)
        x, y, theta = np.array([step.x, step.y, step.theta]) * share
        return a.compose(RigidTransform(float(x), float(y), float(theta)))
