"""Which frames of a bag are odometry: where a sensor was over time, and how fast it moved."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from registration import RigidTransform, wrap_angle
from vectorization import Motion

from ..report import Notes, shown
from .tracks import NS, Floats, Known, Track
from .transforms import Transforms, planar
from .trees import MOVING, ODOM
from .tuning import COMPARED_NS, DIFFERENT, JITTER, MOVED, SAMPLES

BASES = ("base_link", "base_footprint")


@dataclass(frozen=True, slots=True)
class Odometry:
    """Poses of a frame over time.

    Attributes
    ----------
    outer : str
        Frame that the poses are in.
    source : str
        ``tf``, or the topic of the Odometry messages.
    tracks : tuple of Track
        The transforms from the frame outwards, and the poses of the messages.
    """

    outer: str
    source: str
    tracks: tuple[Track, ...] = field(repr=False)
    _contradicted: tuple[tuple[int, int], ...] = ()  # stamps, begin and end

    @property
    def name(self) -> str:
        """The topic, or the frame of transforms: as an option chooses it."""
        return self.outer if self.source == MOVING else self.source

    @property
    def moving(self) -> tuple[Track, ...]:
        """The transforms that are not fixed; none where all poses are equal."""
        return tuple(one for one in self.tracks if one.moves)

    def known(self, stamp: int, received: int) -> Known | None:
        """Return outer_from_frame of something with a stamp and a time of reception, nanoseconds; None if unknown."""
        if any(begin <= stamp <= end for begin, end in self._contradicted):
            return None
        found = Known(np.eye(4))
        for track in self.tracks:
            step = track.known(stamp, received)
            if step is None:
                return None
            found = step.after(found)
        return replace(found, part=(*found.part, sum(end < stamp for _, end in self._contradicted)))

    def compared(self, other: Odometry, notes: Notes) -> Odometry:
        """Return this odometry without the times at which the motion by another source contradicts it."""
        times = list(self.moving[0].times(COMPARED_NS // 4)) if self.moving else []
        found, worst, told = list(self._contradicted), 0.0, ""
        for k, (end, received) in enumerate(times):
            begin, before = times[max(0, k - 4)]
            steps = [_step(one.known(begin, before), one.known(end, received)) for one in (self, other)]
            if not 0 < end - begin <= 2 * COMPARED_NS or steps[0] is None or steps[1] is None:
                continue
            apart, most = _size(steps[0].inverse().compose(steps[1])), max(_size(steps[0]), _size(steps[1]))
            if apart > JITTER + DIFFERENT * most:
                found.append((begin, end))
                if apart > worst:
                    worst, told = apart, f"{apart:.2f} (m or rad) within {(end - begin) / NS:.1f} s"
        if not told:
            return self
        notes.add_assumed(
            "odometry_contradicts",
            f"odometry of {shown(self.source)} and {shown(other.source)} contradict each other, by up to {told}, the "
            f"first from stamp {found[len(self._contradicted)][0] / NS:.3f} to {found[-1][1] / NS:.3f}; it is not used "
            f"there. Choose one with the option odometry (--odom {shown(self.name)} or --odom {shown(other.name)})",
            len(found) - len(self._contradicted),
        )
        return replace(self, _contradicted=_joined(found))

    def motion(self, increment: float, begin: int, end: int, mount: Floats, received: int) -> Motion | None:
        """Return how a sensor moved during a scan; None where its poses do not give it.

        Parameters
        ----------
        increment : float
            From beam to beam, seconds.
        begin, end : int
            Of the scan, nanoseconds.
        mount : (4, 4)
            frame_from_sensor.
        received : int
            When the scan was received.
        """
        # At the ends of the log: the speed just before the scan, or just after it.
        for first, last in ((begin, end), (2 * begin - end, begin), (end, 2 * end - begin)):
            a, b = self.known(first, received + first - begin), self.known(last, received + last - begin)
            if last > first and a is not None and b is not None and a.part == b.part:
                step, _ = planar(np.linalg.inv(a.matrix @ mount) @ b.matrix @ mount)
                return _motion(increment, step, (last - first) / NS)
        return None

    def note_doubts(self, notes: Notes) -> None:
        """Note where odometry contradicts itself, or begins again."""
        for track in self.moving:
            topics = " and ".join(shown(one) for one in sorted(track.topics))
            if track.jumps:
                notes.add_assumed(
                    "odometry_jumps",
                    f"impossible steps of odometry on {topics}, the first {track.jumps[0]}: two publishers, or a "
                    "reset. Odometry near them is not used",
                    len(track.jumps),
                )
            if track.part_count > 1:
                notes.add_assumed(
                    "odometry_parts",
                    f"the stamps of odometry on {topics} jump back; each of {track.part_count} parts has its own "
                    "odometry",
                )

    def note_gaps(self, notes: Notes) -> None:
        """Note for how long odometry is missing, where a scan has no pose."""
        for track in self.moving:
            if track.longest_gap:
                topics = " and ".join(shown(one) for one in sorted(track.topics))
                told = f"odometry on {topics} is missing for up to {track.longest_gap / NS:.1f} s"
                notes.add_assumed("odometry_gap", f"{told}; scans in gaps have no pose")


def _step(before: Known | None, after: Known | None) -> RigidTransform | None:
    if before is None or after is None or before.part != after.part or before.unknown_ns != after.unknown_ns:
        return None
    return planar(np.linalg.inv(before.matrix) @ after.matrix)[0]


def _size(step: RigidTransform) -> float:
    return max(math.hypot(step.x, step.y), abs(wrap_angle(step.theta)))


def _joined(times: list[tuple[int, int]]) -> tuple[tuple[int, int], ...]:
    joined: list[tuple[int, int]] = []
    for begin, end in sorted(times):
        if joined and begin <= joined[-1][1]:
            begin, end = joined[-1][0], max(end, joined.pop()[1])
        joined.append((begin, end))
    return tuple(joined)


def _motion(increment: float, step: RigidTransform, seconds: float) -> Motion:
    """Return the constant twist that makes a step: x, y = V(theta) v t, with V of the exponential map of SE(2)."""
    half = 0.5 * step.theta
    a = 1.0 if abs(half) < 1e-9 else half / math.tan(half)
    vx, vy = a * step.x + half * step.y, a * step.y - half * step.x
    return Motion(increment, vx / seconds, vy / seconds, step.theta / seconds)


def base_of(path: Sequence[str], bases: Sequence[str] = BASES) -> str | None:
    """Return the robot's own frame among frames; with a prefix, as ``robot1/base_link``, too."""
    return next((frame for base in bases for frame in path if base in (frame, frame.rpartition("/")[2])), None)


def outer_frames(tree: Transforms, frame: str) -> list[str]:
    """Return the frames that poses may be in: ``odom`` where a frame is in one, else the outermost ones."""
    above = tree.above(frame)[1:]
    named = [one for one in above if one.rpartition("/")[2] == ODOM]
    return named or [one for one in above if not tree.parents(one)] or above[-1:]


def moves(tree: Transforms, path: Sequence[str], names: Sequence[str] = BASES) -> bool:
    """Tell whether a robot moves, by the frames from its sensor outwards: a mount that moves is no robot that does.

    The frame that has to move is the robot's own. If no frame has that name, a frame has to change its position in
    its parent: a rotating sensor does not.
    """
    bases = [k for k, frame in enumerate(path) if frame in names or frame.rpartition("/")[2] in names]
    if bases:
        return _moves(tree, path[bases[-1] :], turning=True)
    return any(_moves(tree, path[k : k + 2], turning=False) for k in range(len(path) - 1))


def _moves(tree: Transforms, path: Sequence[str], *, turning: bool) -> bool:
    stamps = sorted({stamp for track in tree.tracks(path) if track.moves for stamp in track.stamps})
    places = (tree.along(path, stamp) for stamp in stamps[:: max(1, len(stamps) // SAMPLES)])
    poses = [planar(place)[0] for place in places if place is not None]
    return any(
        math.hypot(pose.x - poses[0].x, pose.y - poses[0].y) > MOVED
        or (turning and abs(wrap_angle(pose.theta - poses[0].theta)) > MOVED)
        for pose in poses
    )
