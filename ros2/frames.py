"""The tree of frames of one robot, from ``/tf_static`` and ``/tf``: bounded, and checked transform by transform."""

from __future__ import annotations

import bisect
import math
from collections import OrderedDict, deque
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from formats.logs.sensors import tilt_of
from formats.logs.tuning import MOST_TILT
from registration import RigidTransform

from .messages import TFMessage, TransformStamped
from .text import MAX_NAME, quoted
from .tuning import (
    CLOCK_BACK_NS,
    LEVEL_TILT,
    MAX_COORDINATE,
    MAX_FRAMES,
    MAX_MOUNT,
    MAX_TRANSFORMS,
    QUATERNION_TOLERANCE,
    STALE_NS,
    TRANSFORMS_KEPT,
)

Floats = NDArray[np.float64]

NS = 1_000_000_000
LONGEST_CHAIN = 64  # frames from a sensor to the root


class FrameError(ValueError):
    """A transform or a chain of frames cannot be used; the message says which, why, and what to do."""


@dataclass(frozen=True, slots=True)
class Mount:
    """Where a laser is mounted on the robot.

    Attributes
    ----------
    base_from_laser : RigidTransform
        In the plane.
    flipped : bool
        Whether the laser is mounted upside down.
    tilt : float
        Radians between the scan plane and the horizontal plane of the base frame.
    """

    base_from_laser: RigidTransform
    flipped: bool = False
    tilt: float = 0.0

    @property
    def level(self) -> bool:
        """Whether the tilt is too small to be worth a word."""
        return self.tilt <= LEVEL_TILT


@dataclass(slots=True)
class _Frame:
    """A frame in its parent: one value where it is static, else the newest values over time."""

    parent: str
    static: bool
    stamps: deque[int] = field(default_factory=lambda: deque(maxlen=TRANSFORMS_KEPT))
    matrices: deque[Floats] = field(default_factory=lambda: deque(maxlen=TRANSFORMS_KEPT))
    used: bool = False

    def add(self, stamp: int, matrix: Floats) -> None:
        back = self.stamps[-1] - stamp if self.stamps else -1
        if not self.static and 0 < back <= CLOCK_BACK_NS:
            return  # out of order
        if self.static or back > CLOCK_BACK_NS:
            self.stamps.clear()
            self.matrices.clear()
        elif back == 0:
            self.stamps.pop()
            self.matrices.pop()
        self.stamps.append(stamp)
        self.matrices.append(matrix)

    def at(self, stamp: int | None) -> Floats | None:
        """Return parent_from_frame at a time; None: the newest. None is returned where the time is too far away."""
        if self.static or stamp is None:
            return self.matrices[-1]
        after = bisect.bisect_left(self.stamps, stamp)
        if after in (0, len(self.stamps)):
            end = min(after, len(self.stamps) - 1)
            return self.matrices[end] if abs(self.stamps[end] - stamp) <= STALE_NS else None
        begin, end_stamp = self.stamps[after - 1], self.stamps[after]
        return _between(self.matrices[after - 1], self.matrices[after], (stamp - begin) / (end_stamp - begin))


class Frames:
    """The newest transform of each frame to its parent.

    When more than `MAX_FRAMES` frames are known, the one that was published longest ago is dropped; frames that
    connect a laser with the base stay.
    """

    def __init__(self) -> None:
        self._frames: OrderedDict[str, _Frame] = OrderedDict()

    def take(self, message: TFMessage, *, static: bool, prefix: str = "") -> list[str]:
        """Add the transforms of a message, each by itself; only those of frames that begin with a prefix.

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
            step = frame.at(stamp)
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

    def mount(self, base: str, laser: str, stamp: int | None) -> Mount | None:
        """Return where a laser is mounted; None where the frames do not connect it with the base.

        Raises
        ------
        FrameError
            When the laser is too far away, or its scan plane is not horizontal.
        """
        base, laser = base.strip("/"), laser.strip("/")
        if laser == base:
            return Mount(RigidTransform(0.0, 0.0, 0.0))
        matrix = self.lookup(base, laser, stamp)
        return None if matrix is None else mount_of(matrix, base, laser)

    def _ancestors(self, frame: str) -> list[str]:
        chain = [frame]
        while chain[-1] in self._frames and len(chain) < LONGEST_CHAIN:
            parent = self._frames[chain[-1]].parent
            if parent in chain:
                break
            chain.append(parent)
        return chain

    def _add(self, transform: TransformStamped, *, static: bool) -> None:
        matrix = _checked(transform)
        parent, child = transform.header.frame_id.strip("/"), transform.child_frame_id.strip("/")
        frame = self._frames.get(child)
        if frame is None or frame.parent != parent or frame.static != static:
            used = frame is not None and frame.used
            frame = self._frames[child] = _Frame(parent, static, used=used)
        frame.add(int(transform.header.stamp.sec) * NS + int(transform.header.stamp.nanosec), matrix)
        self._frames.move_to_end(child)
        while len(self._frames) > MAX_FRAMES:
            del self._frames[next((name for name, one in self._frames.items() if not one.used), child)]


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
    heading = math.atan2(matrix[1, 0], matrix[0, 0])
    return RigidTransform(float(matrix[0, 3]), float(matrix[1, 3]), heading), bool(matrix[2, 2] < 0.0), tilt_of(matrix)


def matrix_of(x: float, y: float, z: float, quaternion: tuple[float, float, float, float]) -> Floats:
    """Return the homogeneous matrix of a translation (m) and a quaternion (x, y, z, w).

    Raises
    ------
    FrameError
        When a number is not finite or too large, or the quaternion does not have length 1.
    """
    if not all(abs(one) <= MAX_COORDINATE for one in (x, y, z)):
        raise FrameError(
            f"found the translation ({x:.4g}, {y:.4g}, {z:.4g}), expected metres, at most {MAX_COORDINATE:g} m"
        )
    length = math.hypot(*quaternion) if all(map(math.isfinite, quaternion)) else math.nan
    if not abs(length - 1.0) <= QUATERNION_TOLERANCE:
        found = ", ".join(f"{one:.4g}" for one in quaternion)
        raise FrameError(f"found the quaternion ({found}), expected one of length 1")
    a, b, c, w = (one / length for one in quaternion)
    matrix = np.eye(4)
    matrix[:3, :3] = [
        [1 - 2 * (b * b + c * c), 2 * (a * b - c * w), 2 * (a * c + b * w)],
        [2 * (a * b + c * w), 1 - 2 * (a * a + c * c), 2 * (b * c - a * w)],
        [2 * (a * c - b * w), 2 * (b * c + a * w), 1 - 2 * (a * a + b * b)],
    ]
    matrix[:3, 3] = x, y, z
    return matrix


def _checked(transform: TransformStamped) -> Floats:
    parent, child = transform.header.frame_id.strip("/"), transform.child_frame_id.strip("/")
    named = f"the transform from {quoted(child)} to {quoted(parent)}"
    if not parent or not child:
        raise FrameError(f"{named} has an empty frame, expected two names")
    if max(len(parent), len(child)) > MAX_NAME:
        raise FrameError(
            f"{named} has a name of {max(len(parent), len(child))} characters, expected at most {MAX_NAME}"
        )
    if parent == child:
        raise FrameError(f"{named} makes the frame its own parent, expected two different frames")
    place, turn = transform.transform.translation, transform.transform.rotation
    try:
        return matrix_of(place.x, place.y, place.z, (turn.x, turn.y, turn.z, turn.w))
    except FrameError as error:
        raise FrameError(f"{named} is not used: {error}") from None


def _between(a: Floats, b: Floats, fraction: float) -> Floats:
    """Interpolate two transforms that are near each other; the axes are made orthonormal again."""
    mixed = (1.0 - fraction) * a + fraction * b
    u, _, vt = np.linalg.svd(mixed[:3, :3])
    mixed[:3, :3] = u @ vt
    return mixed
