"""A scan as a log has it and as requests have it, what one may say of a log, and the stamps and parts of its scans."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

from registration import IDENTITY, RigidTransform, wrap_angle
from vectorization import LaserScan

from ..errors import MalformedFileError, naming
from ..report import ImportReport, Notes
from .tracks import jump_between
from .tuning import PART_NS

UNUSABLE = ("broken_scan", "broken_line", "broken_laserscan", "long_laserscan", "upright_frame")
"""Codes of the notes that count scans which cannot be used."""

T = TypeVar("T")
FARTHEST = 1e4  # m; where a log names no greatest range
SECONDS = 1e-9  # of a nanosecond


@dataclass(frozen=True, slots=True)
class LogOptions:
    """What to take of a log.

    Attributes
    ----------
    topic : str or None
        Of the scans; None: the one with most of them. In a CARMEN log the kind of line, such as ``FLASER``; None: the
        first kind.
    odometry : str or None
        Source of the poses: a topic of Odometry messages, or the name of a frame of the transforms. Other sources are
        not compared with it. None: ``odom`` where the log has it, else the outermost frame that moves, else the
        likeliest topic.
    tf_namespace : str or None
        Of a bag of several robots, the namespace of the transforms, such as ``/robot1``; None: that of the scans.
    mount : RigidTransform or None
        base_from_sensor; None: as the log says.
    base : str or None
        The robot's own frame in a bag, with or without its prefix; None: ``base_link``, else ``base_footprint``.
    """

    topic: str | None = None
    odometry: str | None = None
    tf_namespace: str | None = None
    mount: RigidTransform | None = None
    base: str | None = None


@dataclass(frozen=True, slots=True, eq=False)
class LoggedScan:
    """One scan.

    Attributes
    ----------
    stamp_ns : int
        Of the first beam, nanoseconds since the log's epoch.
    topic, frame_id : str
    laser : LaserScan
        In the sensor's frame; seen from below where `flipped`. Its `motion` is that of the sensor during the scan, by
        odometry; None: not known, or the log does not state the time from beam to beam.
    time_increment : float
        From beam to beam, seconds; 0: not known.
    pose : RigidTransform or None
        pose_frame_from_sensor at that time by odometry; None: not known.
    pose_frame : str
    mount : RigidTransform or None
        base_from_sensor; None: not known.
    base_frame : str
        The robot's own frame, which `mount` is in.
    flipped : bool
        True if the sensor is mounted upside down: y becomes -y in its data before `pose` or `mount` apply.
    part : int
        Poses of scans of different parts are not comparable: the clock was set back, or odometry jumped in between.
    unknown_s : float
        Seconds up to this scan in which odometry is not known. The uncertainty of the motion between two scans of a
        part grows with the difference.
    round : int
        The number of times that the clock of the scans was set back before.
    """

    stamp_ns: int
    topic: str
    frame_id: str
    laser: LaserScan = field(repr=False)
    time_increment: float = 0.0
    pose: RigidTransform | None = None
    pose_frame: str = ""
    mount: RigidTransform | None = None
    flipped: bool = False
    base_frame: str = ""
    part: int = 0
    unknown_s: float = 0.0
    round: int = 0

    @property
    def stamp(self) -> float:
        """Seconds since the log's epoch."""
        return self.stamp_ns * SECONDS

    @property
    def located_frame(self) -> str:
        """The frame whose pose is located: that of the robot, or of the sensor where its mount is not known."""
        return self.frame_id or "laser" if self.mount is None else self.base_frame or "base_link"


@dataclass(slots=True, eq=False)
class Log:
    """The scans of a log. Each iteration reads the file again, so a long log is never in memory as a whole.

    Attributes
    ----------
    format, name : str
    count : int or None
        Number of scan messages, if the log has it.
    """

    format: str
    name: str
    _scans: Callable[[Notes], Iterator[LoggedScan]]
    count: int | None = None
    _notes: Notes = field(default_factory=Notes)

    def __iter__(self) -> Iterator[LoggedScan]:
        self._notes = Notes()
        with naming(self.name):
            yield from self._scans(self._notes)

    @property
    def report(self) -> ImportReport:
        """Notes of the last iteration so far."""
        return self._notes.report(self.format, (self.name,))


def thinned(found: Iterable[T], most: int) -> tuple[list[T], int]:
    """Return at most so many of the scans of a log, evenly over all of it, and how many it has.

    A multiple of `most` is in memory.
    """
    kept: list[T] = []
    step, total = 1, 0
    for one in found:
        if total % step == 0:
            kept.append(one)
        total += 1
        if len(kept) > 4 * most:
            kept, step = kept[::2], 2 * step
    count = min(most, len(kept))
    return [kept[k * len(kept) // count] for k in range(count)], total


@dataclass(slots=True)
class Stamps:
    """Takes the stamps of scans in the order of the log, and notes what is wrong with them."""

    notes: Notes
    _last: int | None = None
    _rounds: int = 0  # the times that the clock was set back
    _before: LoggedScan | None = None  # the last scan with a pose
    _key: tuple[int, ...] = ()  # of its odometry
    _farthest_back: float = 0.0  # s

    def of(self, stamp: int, received: int | None = None) -> int:
        """Return the stamp to use for the next scan, nanoseconds.

        Parameters
        ----------
        stamp : int
            As the message has it; 0 where its sender has set none.
        received : int, optional
            When the recorder received it.
        """
        if stamp == 0 and received:
            said = "scans without a stamp, which have the time at which the recorder received them"
            self.notes.add_assumed("stamp_received", said, 1)
            stamp = received
        if self._last is not None and stamp < self._last:
            self._farthest_back = max(self._farthest_back, (self._last - stamp) * SECONDS)
            said = f"scans with a stamp before that of the scan before, by up to {self._farthest_back:.3f} s"
            self.notes.add_assumed("stamp_back", said, 1)
            self._rounds += stamp < self._last - PART_NS
        self._last = stamp
        return stamp

    def placed(self, scan: LoggedScan, odometry: tuple[int, ...] = ()) -> LoggedScan:
        """Return a scan with the numbers of its part and its round; `odometry` is the part of its odometry."""
        before, key = self._before, (self._rounds, *odometry)
        part = 0 if before is None else before.part
        if before is not None and before.pose is not None and scan.pose is not None:
            step = before.pose.inverse().compose(scan.pose)
            jump = jump_between(before.stamp_ns, scan.stamp_ns, math.hypot(step.x, step.y), wrap_angle(step.theta))
            part += key != self._key or jump is not None
        scan = replace(scan, part=part, round=self._rounds)
        if scan.pose is not None:
            self._before, self._key = scan, key
        return scan


def none_usable(notes: Notes, reason: str) -> MalformedFileError:
    """Return the error of a log of whose scans none can be used.

    Parameters
    ----------
    notes : Notes
        With what was left out.
    reason : str
        Why the first scan cannot be used; empty where none could be decoded.
    """
    count = sum(notes.dropped[code].count for code in UNUSABLE if code in notes.dropped)
    why = f"; the first of them: {reason}" if reason else ", because none can be decoded"
    return MalformedFileError(f"none of its {count} scans can be used{why}")


def scan_json(one: LoggedScan) -> dict[str, Any]:
    """Return the `scan` of a request: one view, with the mount, and the motion where it is known."""
    laser, mount = one.laser, one.mount or IDENTITY
    most = laser.range_max if math.isfinite(laser.range_max) else FARTHEST
    view: dict[str, Any] = {
        "laser": {
            "angle_min": laser.angle_min,
            "angle_increment": laser.angle_increment,
            "ranges": _ranges(laser, most),
            "range_max": most,
            "time_increment": one.time_increment,
        },
        "pose": {"x": mount.x, "y": mount.y, "theta": mount.theta},
        "flipped": one.flipped,
    }
    if laser.motion is not None:
        view["twist"] = {"vx": laser.motion.vx, "vy": laser.motion.vy, "omega": laser.motion.omega}
    return {"views": [view], "stamp": one.stamp, "frame_id": one.located_frame}


def _ranges(laser: LaserScan, most: float) -> list[float | None]:
    """Return ranges as JSON has them: null where nothing is known, and beyond the greatest where nothing came back."""
    return [None if math.isnan(r) else 2.0 * most if math.isinf(r) else r for r in laser.cleaned.tolist()]
