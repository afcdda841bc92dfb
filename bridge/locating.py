"""Scans to the pose of the robot."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import linefix
from registration import InvalidArgumentError, RigidTransform

from .frames import Mount
from .messages import LaserScan, Time
from .odometry import Speed
from .tuning import MAX_BEAMS

HERE = RigidTransform(0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class Located:
    """What came of a scan.

    Attributes
    ----------
    stamp : Time
        Of the scan, of several the newest.
    answer : AssociationResult
    pose : RigidTransform or None
        map_from_base.
    covariance : (3, 3) or None
        Of `pose`: additive (x, y, theta) in the map frame.
    """

    stamp: Time
    answer: linefix.AssociationResult
    pose: RigidTransform | None
    covariance: NDArray[np.float64] | None


def seconds_of(message: LaserScan) -> float:
    """Return how long a scan took, 0 where the message does not say."""
    seconds = message.time_increment * len(message.ranges)
    return seconds if 0.0 < seconds < math.inf else 0.0


def motion_of(message: LaserScan, mount: Mount, speed: Speed | None) -> linefix.Motion | None:
    """Return how a scanner moved while it scanned, by how fast the robot did.

    None where nobody says how fast, or the message does not say how long the scan took.
    """
    if speed is None or not seconds_of(message):
        return None
    at = mount.base_from_laser
    # The turn of the robot takes the scanner along.
    vx, vy = speed.vx - speed.omega * at.y, speed.vy + speed.omega * at.x
    c, s = math.cos(at.theta), math.sin(at.theta)
    return linefix.Motion(message.time_increment, c * vx + s * vy, c * vy - s * vx, speed.omega)


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
        together = linefix.locate(index, linefix.assemble(views), deadline=deadline)
        return Located(stamp, together, together.pose, together.covariance)
    answer = linefix.locate(index, lasers[0], deadline=deadline)
    if answer.pose is None:
        return Located(stamp, answer, None, None)
    laser_from_base = looks[0].mount.base_from_laser.inverse()
    covariance = None if answer.covariance is None else answer.pose.carry(answer.covariance, laser_from_base)
    return Located(stamp, answer, answer.pose.compose(laser_from_base), covariance)
