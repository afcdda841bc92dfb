"""The tree of frames of one robot, from ``/tf_static`` and ``/tf``: bounded, and checked transform by transform."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass

import numpy as np

from formats.logs.tracks import Track
from formats.logs.transforms import stamp_of
from registration import IDENTITY

from .messages import TFMessage, TransformStamped
from .transforms import Floats, FrameError, Mount, matrix_of_message, mount_of
from .tuning import MAX_FRAMES, MAX_TRANSFORMS, TRANSFORMS_KEPT

LONGEST_CHAIN = 64  # frames from a sensor to the root


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
        while chain[-1] in self._frames and len(chain) < LONGEST_CHAIN:
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
        frame.track.add(stamp_of(transform.header), matrix, static=static)
        self._frames.move_to_end(child)
        while len(self._frames) > MAX_FRAMES:
            del self._frames[next((name for name, one in self._frames.items() if not one.used), child)]
