"""Frames over time: where each frame was in its parents, and in the frames above these."""

from __future__ import annotations

import bisect
import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from registration import RigidTransform
from registration.limits import MAX_COORDINATE

from ..errors import MalformedFileError, TooLargeError
from ..limits import MAX_TRANSFORMS
from ..report import shown
from .tuning import REFIXED, STALE_NS, UNIT, WINDOW_NS

Floats = NDArray[np.float64]

MAX_FRAMES = 1000
LONGEST_CHAIN = 64  # frames from the sensor to the outermost
NS = 1_000_000_000
ROUNDING = 1e-6  # m and rad; by which values differ that are equal


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


@dataclass(slots=True)
class Track:
    """Values of one transform over time.

    Attributes
    ----------
    static : bool
        True: the last value holds at every time.
    refixed : bool
        True: static values differ.
    moves : bool
        True: values that are not static differ by more than rounding.
    """

    static: bool
    refixed: bool = False
    moves: bool = False
    _stamps: list[int] = field(default_factory=list)
    _matrices: list[Floats] = field(default_factory=list)
    _sorted: bool = True

    def __len__(self) -> int:
        return len(self._stamps)

    def add(self, stamp: int, matrix: Floats, *, static: bool) -> None:
        """Add a value; a static one replaces the static one before, and is left out where there are others."""
        if static and not self.static:
            return
        if self.static and not static:
            self._stamps.clear()
            self._matrices.clear()
        self.static = static
        if static:
            before = self._matrices[-1] if self._matrices else matrix
            self.refixed = self.refixed or not np.allclose(before, matrix, rtol=0.0, atol=REFIXED)
            self._stamps[:], self._matrices[:] = [stamp], [matrix]
            return
        self._sorted = self._sorted and (not self._stamps or stamp >= self._stamps[-1])
        self.moves = self.moves or (
            bool(self._matrices) and not bool(abs(matrix - self._matrices[0]).max() <= ROUNDING)
        )
        self._stamps.append(stamp)
        self._matrices.append(matrix)

    def at(self, stamp: int) -> Floats | None:
        """Return the value at a time, nanoseconds, between two values in proportion; None where it is not known."""
        if self.static:
            return self._matrices[-1]
        stamps = self.stamps
        after = bisect.bisect_left(stamps, stamp)
        if after in (0, len(stamps)):
            end = min(after, len(stamps) - 1)
            return self._matrices[end] if abs(stamps[end] - stamp) <= STALE_NS else None
        fraction = (stamp - stamps[after - 1]) / (stamps[after] - stamps[after - 1])
        return between(self._matrices[after - 1], self._matrices[after], fraction)

    @property
    def stamps(self) -> Sequence[int]:
        """Times of the values in order, nanoseconds."""
        if not self._sorted:
            order = sorted(range(len(self._stamps)), key=self._stamps.__getitem__)
            self._stamps = [self._stamps[k] for k in order]
            self._matrices = [self._matrices[k] for k in order]
            self._sorted = True
        return self._stamps

    def window(self, begin: int, end: int) -> tuple[int, int] | None:
        """Return two times in or around a scan between which the values give its speed; None where none do.

        Parameters
        ----------
        begin, end : int
            Of the scan, nanoseconds.
        """
        stamps = self.stamps
        first = max(0, bisect.bisect_right(stamps, begin) - 1)
        last = min(len(stamps) - 1, bisect.bisect_left(stamps, end))
        if first == last:
            first, last = max(0, first - 1), min(len(stamps) - 1, last + (first == 0))
        a, b = stamps[first], stamps[last]
        if not 0 < b - a <= WINDOW_NS + end - begin or a > end + WINDOW_NS or b < begin - WINDOW_NS:
            return None
        within = max(a, begin), min(b, end)
        return within if 2 * (within[1] - within[0]) >= end - begin else (a, b)


def between(a: Floats, b: Floats, fraction: float) -> Floats:
    """Interpolate two transforms that are near each other, (4, 4) each; the axes are made orthonormal again."""
    mixed = (1.0 - fraction) * a + fraction * b
    u, _, vt = np.linalg.svd(mixed[:3, :3])
    mixed[:3, :3] = u @ vt
    return mixed


class Transforms:
    """The frames of one tree, and where they are in one another. A frame may have several parents.

    Parameters
    ----------
    name : str
        Of the file or topic, for errors.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._parents: dict[str, dict[str, Track]] = {}
        self._count = 0

    def add(self, parent: str, child: str, stamp: int, matrix: Floats, *, static: bool) -> None:
        """Add one value.

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
                f"a frame has no name: expected two names, found {shown(parent)!r} and {shown(child)!r}",
                argument=self._name,
            )
        if parent == child:
            raise MalformedFileError(
                f"the frame {shown(child)!r} is its own parent: expected two different frames", argument=self._name
            )
        self._count += 1
        if self._count > MAX_TRANSFORMS or len(self._parents) > MAX_FRAMES:
            raise TooLargeError(
                f"expected at most {MAX_TRANSFORMS} transforms of {MAX_FRAMES} frames, found {self._count} of "
                f"{len(self._parents)} or more; record fewer topics",
                argument=self._name,
            )
        tracks = self._parents.setdefault(child, {})
        track = tracks.pop(parent) if parent in tracks else Track(static)
        track.add(stamp, matrix, static=static)
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

    def lookup(self, outer: str, inner: str, stamp: int) -> Floats | None:
        """Return outer_from_inner at a time; None where it is not known.

        Parameters
        ----------
        outer, inner : str
            Frames; the outer one has to be above the inner.
        stamp : int
            Nanoseconds.

        Returns
        -------
        (4, 4) or None
        """
        path = self.path(outer, inner)
        return None if path is None else self.along(path, stamp)

    def along(self, path: Sequence[str], stamp: int) -> Floats | None:
        """Return the transform from the first frame of a path to its last, (4, 4); None where it is not known then."""
        matrix = np.eye(4)
        for child, parent in pairwise(path):
            step = self._parents[child][parent].at(stamp)
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
