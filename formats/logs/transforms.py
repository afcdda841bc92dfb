"""Frames over time: where each frame was in its parents, and in the frames above these."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from registration import RigidTransform
from registration.limits import MAX_COORDINATE

from ..errors import MalformedFileError, TooLargeError
from ..limits import MAX_TRANSFORMS
from ..report import shown
from .tracks import NS, Floats, Track
from .tuning import UNIT

MAX_FRAMES = 1000
LONGEST_CHAIN = 64  # frames from the sensor to the outermost


def stamp_of(header: Any) -> int:
    """Return the time of a message's header in nanoseconds."""
    return int(header.stamp.sec) * NS + int(header.stamp.nanosec)


def planar(matrix: Floats) -> tuple[RigidTransform, bool]:
    """Return what a transform of space does in the plane, and whether it turns the z axis down.

    If it does, y has to become -y first.

    Parameters
    ----------
    matrix : (4, 4)
        Homogeneous; metres.
    """
    return (
        RigidTransform(float(matrix[0, 3]), float(matrix[1, 3]), math.atan2(matrix[1, 0], matrix[0, 0])),
        bool(matrix[2, 2] < 0.0),
    )


def matrix_of(position: Any, orientation: Any) -> Floats:
    """Return the homogeneous matrix of a position and a quaternion of ROS; one of nearly unit length is normalised.

    Raises
    ------
    ValueError
        When a number is not finite or beyond 1e9 m, or the length of the quaternion is not 1.
    """
    x, y, z, w = (float(getattr(orientation, k)) for k in "xyzw")
    length = math.hypot(x, y, z, w)
    place = [float(getattr(position, k)) for k in "xyz"]
    if not all(abs(value) <= MAX_COORDINATE for value in place):
        raise ValueError(f"expected a position of finite numbers up to {MAX_COORDINATE:g} m, found {place}")
    if not abs(length - 1.0) <= UNIT:
        raise ValueError(f"expected a quaternion of length 1, found {length:g}")
    x, y, z, w = x / length, y / length, z / length, w / length
    matrix = np.eye(4)
    matrix[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    matrix[:3, 3] = place
    return matrix


class Transforms:
    """The frames of one tree, and where they are in one another. A frame may have several parents."""

    def __init__(self) -> None:
        self._parents: dict[str, dict[str, Track]] = {}
        self._count = 0

    def add(
        self,
        parent: str,
        child: str,
        stamp: int,
        matrix: Floats,
        *,
        static: bool,
        received: int | None = None,
        topic: str = "",
    ) -> None:
        """Add one value, with when and where it was received.

        Raises
        ------
        TooLargeError
            When there are too many.
        MalformedFileError
            When a frame has no name, or is its own parent.
        """
        parent, child = parent.strip("/"), child.strip("/")
        if not parent or not child:
            raise MalformedFileError(
                f"a frame has no name: expected two names, found {shown(parent)!r} and {shown(child)!r}"
            )
        if parent == child:
            raise MalformedFileError(f"the frame {shown(child)!r} is its own parent: expected two different frames")
        self._count += 1
        if self._count > MAX_TRANSFORMS or len(self._parents) > MAX_FRAMES:
            raise TooLargeError(
                f"expected at most {MAX_TRANSFORMS} transforms of {MAX_FRAMES} frames, found {self._count} of "
                f"{len(self._parents)} or more; record fewer topics"
            )
        tracks = self._parents.setdefault(child, {})
        track = tracks.pop(parent) if parent in tracks else Track(static)
        track.add(stamp, matrix, static=static, received=received, topic=topic)
        tracks[parent] = track  # the last one that was added stands last

    def knows(self, frame: str) -> bool:
        """Tell whether a transform has been added that a frame is in, or that is in it."""
        name = frame.strip("/")
        return name in self._parents or any(name in tracks for tracks in self._parents.values())

    def frames(self) -> list[str]:
        """Return the frames that have a parent."""
        return list(self._parents)

    def parents(self, frame: str) -> list[str]:
        """Return the parents of a frame: those with most values first, of equal ones the last one that was added."""
        tracks = self._parents.get(frame.strip("/"), {})
        last_first = list(tracks)[::-1]
        return sorted(last_first, key=lambda parent: -len(tracks[parent]))

    def track(self, parent: str, child: str) -> Track:
        """Return the values of a transform; raises `KeyError` where there are none."""
        return self._parents[child][parent]

    def above(self, frame: str) -> list[str]:
        """Return the frames that a frame is in, from itself outwards, the nearest first."""
        return list(self._outwards(frame))

    def path(self, outer: str, inner: str) -> list[str] | None:
        """Return the frames from `inner` out to `outer`, by the fewest steps; None where no way leads there."""
        came_from = self._outwards(inner)
        frame: str | None = outer.strip("/")
        if frame not in came_from:
            return None
        back = []
        while frame is not None:
            back.append(frame)
            frame = came_from[frame]
        return back[::-1]

    def tracks(self, path: Sequence[str]) -> tuple[Track, ...]:
        """Return the values of the transforms along a path, the innermost first."""
        return tuple(self.track(parent, child) for child, parent in pairwise(path))

    def along(self, path: Sequence[str], stamp: int, received: int | None = None) -> Floats | None:
        """Return the transform from the first frame of a path to its last, (4, 4); None where it is not known then."""
        matrix = np.eye(4)
        for track in self.tracks(path):
            step = track.at(stamp, received)
            if step is None:
                return None
            matrix = step @ matrix
        return matrix

    def _outwards(self, frame: str) -> dict[str, str | None]:
        """Return each frame above one, and the frame below from which it is reached first; nearest first."""
        begin = frame.strip("/")
        came_from: dict[str, str | None] = {begin: None}
        steps = {begin: 0}
        left = deque([begin])
        while left:
            below = left.popleft()
            for parent in self.parents(below) if steps[below] < LONGEST_CHAIN else ():
                if parent not in came_from:
                    came_from[parent], steps[parent] = below, steps[below] + 1
                    left.append(parent)
        return came_from
