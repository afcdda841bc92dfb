"""One scan to the pose of the robot."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import linefix
from formats.logs.transforms import Transforms, matrix_of, planar
from registration import RigidTransform

from .messages import LaserScan, TFMessage, Time


@dataclass(frozen=True, slots=True)
class Mount:
    """Where a scanner sits: base_from_laser, and whether it is upside down."""

    base_from_laser: RigidTransform
    flipped: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Located:
    """What came of a scan.

    Attributes
    ----------
    stamp : Time
        Of the scan.
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


class Mounts:
    """Where scanners sit on the robot, by what ``/tf_static`` says.

    Parameters
    ----------
    base : str
        The robot's own frame.
    """

    def __init__(self, base: str) -> None:
        self._base = base.strip("/")
        self._frames = Transforms("tf_static")

    def hear(self, message: TFMessage) -> None:
        """Take what was said; the last word on a frame holds.

        Raises
        ------
        ValueError
            When it is no transform.
        """
        for one in message.transforms:
            matrix = matrix_of(one.transform.translation, one.transform.rotation)
            self._frames.add(one.header.frame_id, one.child_frame_id, 0, matrix, static=True)

    def of(self, frame: str) -> Mount | None:
        """Return where a scanner sits; None where nobody has said so yet."""
        if frame.strip("/") == self._base:
            return Mount(RigidTransform(0.0, 0.0, 0.0))
        matrix = self._frames.lookup(self._base, frame, 0)
        return None if matrix is None else Mount(*planar(matrix))


def laser_of(message: LaserScan, *, flipped: bool) -> linefix.LaserScan:
    """Return a message as a scan; one that is mounted upside down turns the other way.

    Raises
    ------
    InputError
        When it is no scan.
    """
    sign = -1.0 if flipped else 1.0
    return linefix.LaserScan(
        sign * message.angle_min,
        sign * message.angle_increment,
        np.asarray(message.ranges, dtype=np.float64),
        message.range_min,
        message.range_max,
    )


def locate(index: linefix.MapIndex, message: LaserScan, mount: Mount) -> Located:
    """Find where the robot is by one scan.

    Raises
    ------
    InputError
        When the message is no scan.
    """
    answer = linefix.locate(index, laser_of(message, flipped=mount.flipped))
    stamp = message.header.stamp
    if answer.pose is None:
        return Located(stamp, answer, None, None)
    laser_from_base = mount.base_from_laser.inverse()
    covariance = None if answer.covariance is None else answer.pose.carry(answer.covariance, laser_from_base)
    return Located(stamp, answer, answer.pose.compose(laser_from_base), covariance)
