"""The frames of a bag over time: where the sensor was, from tf or from odometry."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from registration import RigidTransform

from ..errors import MalformedFileError, TooLargeError
from ..limits import MAX_TRANSFORMS

Floats = NDArray[np.float64]

MAX_FRAMES = 1000
LONGEST_CHAIN = 64  # frames from the sensor to the outermost
STALE_NS = 500_000_000  # a moving transform holds no longer than this before its first and after its last value
NS = 1_000_000_000


def stamp_of(header: Any) -> int:
    """Return the time of a message's header in nanoseconds."""
    return int(header.stamp.sec) * NS + int(header.stamp.nanosec)


def planar(matrix: Floats) -> tuple[RigidTransform, bool]:
    """Return what a transform of space does in the plane, and whether it turns the z axis down.

    Where it does, y has to become -y first.

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
    """Return the homogeneous matrix of a position and a quaternion of ROS.

    Raises
    ------
    ValueError
        When a number is not finite, or the quaternion is zero.
    """
    x, y, z, w = (float(getattr(orientation, k)) for k in "xyzw")
    length = math.sqrt(x * x + y * y + z * z + w * w)
    place = [float(getattr(position, k)) for k in "xyz"]
    if not (math.isfinite(length) and length > 1e-6 and all(map(math.isfinite, place))):
        raise ValueError("a pose that is none")
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
class _Track:
    """A frame in its parent, over time."""

    parent: str
    static: bool
    stamps: list[int] = field(default_factory=list)
    matrices: list[Floats] = field(default_factory=list)
    _sorted: bool = False

    def at(self, stamp: int) -> Floats | None:
        if self.static:
            return self.matrices[-1]
        if not self._sorted:
            order = sorted(range(len(self.stamps)), key=self.stamps.__getitem__)
            self.stamps = [self.stamps[k] for k in order]
            self.matrices = [self.matrices[k] for k in order]
            self._sorted = True
        after = int(np.searchsorted(self.stamps, stamp))
        if after == 0 or after == len(self.stamps):
            end = min(after, len(self.stamps) - 1)
            return self.matrices[end] if abs(self.stamps[end] - stamp) <= STALE_NS else None
        share = (stamp - self.stamps[after - 1]) / (self.stamps[after] - self.stamps[after - 1])
        return _between(self.matrices[after - 1], self.matrices[after], share)


def _between(a: Floats, b: Floats, share: float) -> Floats:
    """Return a transform between two near ones: places and axes in proportion, the axes made upright again."""
    mixed = (1.0 - share) * a + share * b
    u, _, vt = np.linalg.svd(mixed[:3, :3])
    mixed[:3, :3] = u @ vt
    return mixed


class Transforms:
    """All frames of a bag, and where they are in one another."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._tracks: dict[str, _Track] = {}
        self._count = 0

    def add(self, parent: str, child: str, stamp: int, matrix: Floats, *, static: bool) -> None:
        """Add one value.

        Raises
        ------
        TooLargeError
            When there are too many.
        MalformedFileError
            When a frame is its own parent.
        """
        parent, child = parent.strip("/"), child.strip("/")
        if parent == child:
            raise MalformedFileError("has a frame that is its own parent", argument=self._name)
        self._count += 1
        if self._count > MAX_TRANSFORMS or len(self._tracks) > MAX_FRAMES:
            raise TooLargeError(f"expected at most {MAX_TRANSFORMS} transforms", argument=self._name)
        track = self._tracks.get(child)
        if track is None or track.parent != parent:
            track = self._tracks[child] = _Track(parent, static)
        track.static = track.static and static
        if static:
            track.stamps[:], track.matrices[:] = [stamp], [matrix]
        else:
            track.stamps.append(stamp)
            track.matrices.append(matrix)

    def above(self, frame: str) -> list[str]:
        """Return the frames that a frame is in, from itself outwards."""
        chain = [frame.strip("/")]
        while chain[-1] in self._tracks and len(chain) < LONGEST_CHAIN:
            parent = self._tracks[chain[-1]].parent
            if parent in chain:
                break
            chain.append(parent)
        return chain

    def lookup(self, outer: str, inner: str, stamp: int) -> Floats | None:
        """Return outer_from_inner at a time; None where the log does not say.

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
        chain = self.above(inner)
        if outer.strip("/") not in chain:
            return None
        matrix = np.eye(4)
        for frame in chain[: chain.index(outer.strip("/"))]:
            step = self._tracks[frame].at(stamp)
            if step is None:
                return None
            matrix = step @ matrix
        return matrix
