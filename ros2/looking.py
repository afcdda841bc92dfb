"""A message and the mount of its scanner to the input of the search; errors of either are noted."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

import linefix
from formats.logs.lasers import laser_of
from formats.logs.sensors import time_increment_of
from formats.report import Notes
from linefix.ranges import motion_warning
from registration import IDENTITY, RigidTransform

from .messages import LaserScan, Time
from .names import quoted
from .odometry import OdometryHistory, Speed, nanoseconds
from .transforms import FrameError, Mount


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """A scan, and from where it was taken; a `linefix.MountedScan`.

    Attributes
    ----------
    stamp : Time
        Of the first beam.
    frame : str
        Of the laser.
    laser : LaserScan
        In the frame of the laser, upside down where it is `flipped`; with its motion where that is known.
    time_increment : float
        From beam to beam, seconds; 0: all beams are of one moment.
    mount : RigidTransform
        base_from_laser.
    flipped : bool
    base_from_then : RigidTransform
        The robot's pose at that time, in the frame of its base at the requested time.
    notes : mapping of str to str
        By code, what is wrong with the scan.
    """

    stamp: Time
    frame: str
    laser: linefix.LaserScan
    time_increment: float
    mount: RigidTransform
    flipped: bool = False
    base_from_then: RigidTransform = IDENTITY
    notes: Mapping[str, str] = field(default_factory=dict)

    @property
    def view(self) -> linefix.View:
        """The scan as the search takes it, in the frame of the robot."""
        return linefix.view_of(self, self.base_from_then)


def look_of(
    message: LaserScan, mount: Mount, odometry: OdometryHistory, base_from_then: RigidTransform, *, motion: bool
) -> Look:
    """Return a message as a scan.

    Parameters
    ----------
    message : LaserScan
    mount : Mount
    odometry : OdometryHistory
        Has the speed of the robot during the scan, or not.
    base_from_then : RigidTransform
        As of `Look`.
    motion : bool
        False: all beams are taken to be of one moment.

    Raises
    ------
    InputError
        When it is no scan, or the scanner turned nearly as fast as it scans.
    FrameError
        When no range is valid.
    """
    if not message.ranges:
        raise FrameError(
            f"no valid range in the scan of {quoted(message.header.frame_id)}: found no ranges; check the driver"
        )
    notes = Notes()
    laser, increment = laser_of(message, notes), time_increment_of(message, notes) if motion else 0.0
    if np.isnan(laser.cleaned).all():
        raise FrameError(
            f"no valid range in the scan of {quoted(message.header.frame_id)}: none of {len(laser.ranges)} ranges is a "
            f"number of at least {laser.range_min:g} m (range_min); check that the laser is on and not covered"
        )
    middle = nanoseconds(message.header.stamp) + round(0.5e9 * increment * len(laser.ranges))
    speed = odometry.speed(middle) if increment else None
    laser = laser if speed is None else replace(laser, motion=motion_of(increment, mount, speed))
    header, place = message.header, mount.base_from_laser
    look = Look(header.stamp, header.frame_id, laser, increment, place, mount.flipped, base_from_then)
    problems = {note.code: note.message for note in notes.assumed.values()}
    if not mount.level:
        problems["tilted"] = (
            f"the scan plane is tilted by {math.degrees(mount.tilt):.0f} degrees, "
            "expected a horizontal plane; ranges are used without correction"
        )
    moving = motion_warning(look)
    if moving is not None:
        problems[moving.code] = moving.message
    return replace(look, notes=problems)


def motion_of(time_increment: float, mount: Mount, speed: Speed) -> linefix.Motion:
    """Return the motion of a scanner in its own frame, from the speed of the robot; upside down, left is right."""
    carried, side = speed.carried(mount.base_from_laser), -1.0 if mount.flipped else 1.0
    return linefix.Motion(time_increment, carried.vx, side * carried.vy, side * carried.omega)
