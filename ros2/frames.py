"""Transforms of space, checked; and the tree of frames of one robot, from ``/tf_static`` and ``/tf``: bounded."""

from __future__ import annotations

import math
from collections import OrderedDict
from dataclasses import dataclass
from typing import Any

import numpy as np

from formats.logs import transforms
from formats.logs.sensors import tilt_of
from formats.logs.tracks import Track
from formats.logs.tuning import MOST_TILT
from registration import IDENTITY, RigidTransform
from registration.layout import Floats

from .messages import TFMessage, TransformStamped, nanoseconds
from .options import MAX_NAME, quoted
from .tuning import MAX_FRAMES, MAX_MOUNT, MAX_TRANSFORMS, TRANSFORMS_KEPT


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
    tilt = tilt_of(matrix)
    if tilt > MOST_TILT:
        raise FrameError(
            f"the scan plane of {quoted(laser)} is tilted by {math.degrees(tilt):.0f} degrees in {quoted(base)}, "
            f"expected at most {math.degrees(MOST_TILT):.0f} degrees; use the frame whose z axis is the axis of "
            "rotation of the laser, not an optical frame"
        )
    return Mount(*transforms.planar(matrix), tilt)


def planar(matrix: Floats) -> RigidTransform:
    """Return what a transform of space, (4, 4), does in the plane."""
    return transforms.planar(matrix)[0]


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


@dataclass(slots=True)
class _Frame:
    """A frame in its parent."""

    parent: str
    track: Track
    used: bool = False


class Frames:
    """The newest transform of each frame to its parent.

    When more than `MAX_FRAMES` frames are known, the one that was published longest ago is dropped; frames that
    connect a laser with the base stay.
    """

    def __init__(self) -> None:
        self._frames: OrderedDict[str, _Frame] = OrderedDict()

    def take(self, message: TFMessage, *, static: bool, prefix: str = "") -> list[str]:
        """Add the transforms of a message, one by one; only those of frames that begin with a prefix.

        Returns
        -------
        list of str
            Why others of its transforms are not used.
        """
        problems: list[str] = []
        for transform in message.transforms[:MAX_TRANSFORMS]:
            if not transform.child_frame_id.strip("/").startswith(prefix):
                continue  # of another robot
            try:
                self._add(transform, static=static)
            except FrameError as error:
                problems.append(str(error))
        if len(message.transforms) > MAX_TRANSFORMS:
            problems.append(
                f"found {len(message.transforms)} transforms in one message, expected at most {MAX_TRANSFORMS}"
            )
        return problems

    def lookup(self, outer: str, inner: str, stamp: int | None) -> Floats | None:
        """Return outer_from_inner at a time.

        Parameters
        ----------
        outer, inner : str
            Frames; `outer` has to be an ancestor of `inner`.
        stamp : int or None
            Nanoseconds; None: the newest.

        Returns
        -------
        (4, 4) or None
            None where a transform is missing, or is too old.
        """
        chain = self._ancestors(inner)
        if outer not in chain:
            return None
        matrix = np.eye(4)
        for name in chain[: chain.index(outer)]:
            frame = self._frames[name]
            frame.used = True
            step = frame.track.newest[1] if stamp is None else frame.track.at(stamp)
            if step is None:
                return None
            matrix = step @ matrix
        return matrix

    def between(self, outer: str, inner: str) -> Floats | None:
        """Return outer_from_inner by the newest transforms, whichever of the two is above the other."""
        matrix = self.lookup(outer, inner, None)
        if matrix is not None:
            return matrix
        back = self.lookup(inner, outer, None)
        return None if back is None else np.asarray(np.linalg.inv(back), dtype=np.float64)

    def newest(self, outer: str, inner: str) -> tuple[int, Floats] | None:
        """Return the newest time at which outer_from_inner moves, nanoseconds, and it; None where it does not."""
        chain = self._ancestors(inner)
        moving = [self._frames[one].track for one in chain[:-1] if not self._frames[one].track.static]
        if outer not in chain or not moving:
            return None
        stamp = min(track.newest[0] for track in moving)
        matrix = self.lookup(outer, inner, stamp)
        return None if matrix is None else (stamp, matrix)

    def mount(self, base: str, laser: str, stamp: int | None) -> Mount | None:
        """Return where a laser is mounted; None where the frames do not connect it with the base.

        Raises
        ------
        FrameError
            When the laser is too far away, or its scan plane is not horizontal.
        """
        base, laser = base.strip("/"), laser.strip("/")
        if laser == base:
            return Mount(IDENTITY)
        matrix = self.lookup(base, laser, stamp)
        return None if matrix is None else mount_of(matrix, base, laser)

    def _ancestors(self, frame: str) -> list[str]:
        chain = [frame]
        while chain[-1] in self._frames and len(chain) < transforms.LONGEST_CHAIN:
            parent = self._frames[chain[-1]].parent
            if parent in chain:
                break
            chain.append(parent)
        return chain

    def _add(self, transform: TransformStamped, *, static: bool) -> None:
        matrix = matrix_of_message(transform)
        parent, child = transform.header.frame_id.strip("/"), transform.child_frame_id.strip("/")
        frame = self._frames.get(child)
        if frame is None or frame.parent != parent or frame.track.static != static:
            track = Track(static, most=TRANSFORMS_KEPT)
            frame = self._frames[child] = _Frame(parent, track, used=frame is not None and frame.used)
        frame.track.add(nanoseconds(transform.header.stamp), matrix, static=static)
        self._frames.move_to_end(child)
        while len(self._frames) > MAX_FRAMES:
            del self._frames[next((name for name, one in self._frames.items() if not one.used), child)]
