"""Transforms of space: checked, and what they are in the plane."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from formats.logs import transforms
from formats.logs.sensors import tilt_of
from formats.logs.tuning import MOST_TILT
from registration import RigidTransform

from .messages import TransformStamped
from .options import MAX_NAME, quoted
from .tuning import MAX_MOUNT

Floats = NDArray[np.float64]


class FrameError(ValueError):
    """A transform or a chain of frames cannot be used; the message names it, the reason and the remedy."""


@dataclass(frozen=True, slots=True)
class Mount:
    """The mount of a laser on the robot.

    Attributes
    ----------
    base_from_laser : RigidTransform
        In the plane.
    flipped : bool
        True when the laser is mounted upside down.
    tilt : float
        Radians between the scan plane and the horizontal plane of the base frame.
    """

    base_from_laser: RigidTransform
    flipped: bool = False
    tilt: float = 0.0


def mount_of(matrix: Floats, base: str, laser: str) -> Mount:
    """Return the mount in the plane that a transform of space gives.

    Parameters
    ----------
    matrix : (4, 4)
        base_from_laser.
    base, laser : str
        Names of the frames, for the message.

    Raises
    ------
    FrameError
        When the laser is farther than `MAX_MOUNT` away, or its scan plane is tilted by more than `MOST_TILT`.
    """
    away = float(np.linalg.norm(matrix[:3, 3]))
    if not away <= MAX_MOUNT:
        raise FrameError(
            f"{quoted(laser)} is {away:.4g} m away from {quoted(base)}, expected at most {MAX_MOUNT:g} m; "
            "correct the transform, it is in metres"
        )
    pose, flipped, tilt = planar(matrix)
    if tilt > MOST_TILT:
        raise FrameError(
            f"the scan plane of {quoted(laser)} is tilted by {math.degrees(tilt):.0f} degrees in {quoted(base)}, "
            f"expected at most {math.degrees(MOST_TILT):.0f} degrees; use the frame whose z axis is the axis of "
            "rotation of the laser, not an optical frame"
        )
    return Mount(pose, flipped, tilt)


def planar(matrix: Floats) -> tuple[RigidTransform, bool, float]:
    """Return a transform of space in the plane, whether it turns the z axis down, and its tilt.

    Parameters
    ----------
    matrix : (4, 4)
        Homogeneous; metres.

    Returns
    -------
    RigidTransform
    bool
    float
        Radians between the planes x, y of both frames, 0 to pi / 2.
    """
    return *transforms.planar(matrix), tilt_of(matrix)


def matrix_of(position: Any, orientation: Any) -> Floats:
    """Return the homogeneous matrix of a position and a quaternion of a message.

    Raises
    ------
    FrameError
        When a number is not finite or too large, or the quaternion does not have length 1.
    """
    try:
        return transforms.matrix_of(position, orientation)
    except ValueError as error:
        raise FrameError(f"{error}; correct the publisher") from None


def matrix_in_space(pose: RigidTransform) -> Floats:
    """Return a pose in the plane as a homogeneous matrix, (4, 4)."""
    c, s = math.cos(pose.theta), math.sin(pose.theta)
    return np.array([[c, -s, 0.0, pose.x], [s, c, 0.0, pose.y], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]])


def matrix_of_message(transform: TransformStamped) -> Floats:
    """Return the homogeneous matrix of a message, parent_from_child.

    Raises
    ------
    FrameError
        When its frames have no names or the same one, or it is no transform.
    """
    parent, child = transform.header.frame_id.strip("/"), transform.child_frame_id.strip("/")
    named = f"the transform from {quoted(child)} to {quoted(parent)}"
    if not parent or not child:
        raise FrameError(f"{named} has an empty frame, expected two names; correct the publisher")
    if max(len(parent), len(child)) > MAX_NAME:
        raise FrameError(
            f"{named} has a name of {max(len(parent), len(child))} characters, expected at most {MAX_NAME}; shorten it"
        )
    if parent == child:
        raise FrameError(
            f"{named} makes the frame its own parent, expected two different frames; correct the publisher"
        )
    try:
        return matrix_of(transform.transform.translation, transform.transform.rotation)
    except FrameError as error:
        raise FrameError(f"{named} is not used: {error}") from None
