"""Scans to the pose of the robot."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import linefix
from registration import InvalidArgumentError, RigidTransform

from .agreement import Observation
from .frames import Mount
from .messages import LaserScan, Time
from .odometry import Speed
from .tuning import INCONCLUSIVE_NATS, MAX_BEAMS

HERE = RigidTransform(0.0, 0.0, 0.0)
OPTIONS = linefix.AssociationOptions(max_alternatives=10)  # each of them may be where the robot is


@dataclass(frozen=True, slots=True, eq=False)
class Located:
    """The result of a scan.

    Attributes
    ----------
    stamp : Time
        Of the scan, of several the newest.
    answer : AssociationResult
    pose : RigidTransform or None
        map_from_base.
    covariance : (3, 3) or None
        Of `pose`: additive (x, y, theta) in the map frame.
    others : tuple of RigidTransform
        map_from_base of the alternatives.
    """

    stamp: Time
    answer: linefix.AssociationResult
    pose: RigidTransform | None
    covariance: NDArray[np.float64] | None
    others: tuple[RigidTransform, ...] = ()

    def observation(self, odometry: RigidTransform | None, stamp: int) -> Observation:
        """Return the result for the agreement, with odom_from_base at its stamp (nanoseconds)."""
        return Observation(
            stamp, self.pose, self.covariance, self.answer.usable, odometry, self.others, self._conclusive
        )

    @property
    def _conclusive(self) -> bool:
        """Whether each pose that explains the scan about as well is listed."""
        answer = self.answer
        if answer.status not in (linefix.Status.OK, linefix.Status.AMBIGUOUS) or answer.diagnostics is None:
            return False
        unlisted = (1.0 - answer.search.complete_above) * answer.diagnostics.score
        listed = len(answer.alternatives) < OPTIONS.max_alternatives
        return listed and answer.search.complete and unlisted >= INCONCLUSIVE_NATS


def seconds_of(message: LaserScan) -> float:
    """Return how long a scan took, 0 where the message does not say."""
    seconds = message.time_increment * len(message.ranges)
    return seconds if 0.0 < seconds < math.inf else 0.0


def motion_of(message: LaserScan, mount: Mount, speed: Speed | None) -> linefix.Motion | None:
    """Return the motion of a scanner while it scanned, from the speed of the robot.

    None where the speed is not known, or the message does not say how long the scan took.
    """
    if speed is None or not seconds_of(message):
        return None
    carried = speed.carried(mount.base_from_laser)
    return linefix.Motion(message.time_increment, carried.vx, carried.vy, carried.omega)


def laser_of(message: LaserScan, *, flipped: bool, motion: linefix.Motion | None = None) -> linefix.LaserScan:
    """Return a message as a scan; one that is mounted upside down turns the other way.

    Raises
    ------
    InputError
        When it is no scan, or the scanner turned nearly as fast as it scans.
    """
    if not 1 <= len(message.ranges) <= MAX_BEAMS:
        raise InvalidArgumentError(f"found {len(message.ranges)} ranges, expected 1 to {MAX_BEAMS}", argument="ranges")
    sign = -1.0 if flipped else 1.0
    return linefix.LaserScan(
        sign * message.angle_min,
        sign * message.angle_increment,
        np.asarray(message.ranges, dtype=np.float64),
        message.range_min,
        message.range_max,
        motion,
    )


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """A scan, and from where it was taken.

    Attributes
    ----------
    message : LaserScan
    mount : Mount
    base_from_then : RigidTransform
        Where the robot was at that time, as seen from where it was at the time that is asked about.
    speed : Speed or None
        Of the robot meanwhile; None: it is taken to stand still.
    """

    message: LaserScan
    mount: Mount
    base_from_then: RigidTransform = HERE
    speed: Speed | None = None

    @property
    def laser(self) -> linefix.LaserScan:
        """The scan as the search takes it; raises InputError where it is none."""
        motion = motion_of(self.message, self.mount, self.speed)
        return laser_of(self.message, flipped=self.mount.flipped, motion=motion)


def locate(index: linefix.MapIndex, looks: Sequence[Look], deadline: linefix.Deadline | None = None) -> Located:
    """Find where the robot is by one scan, or by several scanners together, at the time of the first one's first beam.

    Raises
    ------
    InputError
        When a message is no scan.
    """
    stamp = looks[0].message.header.stamp
    lasers = [look.laser for look in looks]
    if len(looks) > 1:
        places = [look.base_from_then.compose(look.mount.base_from_laser) for look in looks]
        views = [linefix.View(linefix.scan_of(laser), at) for laser, at in zip(lasers, places, strict=True)]
        together = linefix.locate(index, linefix.assemble(views), options=OPTIONS, deadline=deadline)
        others = tuple(one.pose for one in together.alternatives)
        return Located(stamp, together, together.pose, together.covariance, others)
    answer = linefix.locate(index, lasers[0], options=OPTIONS, deadline=deadline)
    if answer.pose is None:
        return Located(stamp, answer, None, None)
    laser_from_base = looks[0].mount.base_from_laser.inverse()
    covariance = None if answer.covariance is None else answer.pose.carry(answer.covariance, laser_from_base)
    others = tuple(one.pose.compose(laser_from_base) for one in answer.alternatives)
    return Located(stamp, answer, answer.pose.compose(laser_from_base), covariance, others)
