"""The scanners of a bag: how each is mounted, and where odometry has it at a time."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from registration import RigidTransform
from vectorization import Motion
from vectorization.laser import LONGEST_SCAN, USUAL_SCAN

from ..errors import IncompleteFileError, UprightFrameError
from ..report import Notes, shown
from .odometry import BASES, Odometry, base_of, moves, outer_frames
from .scan import LogOptions
from .tracks import NS, Floats
from .transforms import Transforms, planar
from .trees import MOVING, BagFrames, OdometryTopic
from .tuning import FASTEST, MOST_TILT, SAID_TILT

NAMELESS = "'', the empty frame_id of the scans: set it in the driver"


def tilt_of(matrix: Floats) -> float:
    """Return how far the x-y plane of a frame is from horizontal, radians from 0 to pi/2; upside down is 0.

    Parameters
    ----------
    matrix : (4, 4)
        Homogeneous: upright_from_frame.
    """
    return math.acos(min(1.0, abs(float(matrix[2, 2]))))


def mounted(matrix: Floats, frame: str, base: str) -> tuple[RigidTransform, bool]:
    """Return where a scanner sits in the plane, base_from_sensor, and whether it is upside down.

    Parameters
    ----------
    matrix : (4, 4)
        base_from_sensor, homogeneous; metres.
    frame, base : str
        Names for the error.

    Raises
    ------
    UprightFrameError
        When its scan plane is more than 20 degrees from horizontal.
    """
    tilt = tilt_of(matrix)
    if tilt > MOST_TILT:
        raise UprightFrameError(
            f"the scan plane is {math.degrees(tilt):.1f} degrees from horizontal in {shown(base)}; expected at most "
            f"{math.degrees(MOST_TILT):.0f}. Publish the scan in a frame whose z axis points up or down (of a camera "
            f"not the optical frame), or state the mount as x, y, theta",
            argument=shown(frame),
        )
    return planar(matrix)


@dataclass(frozen=True, slots=True)
class Place:
    """The pose and the mount of a scanner at a time.

    Attributes
    ----------
    pose : RigidTransform or None
        odometry_from_sensor.
    mount : RigidTransform or None
        base_from_sensor.
    flipped : bool
    tilt : float
        Of the scan plane, radians; 0 where it is not known.
    part : tuple of int
        Of odometry, as of `Known`.
    unknown_ns : int
        As of `Known`.
    """

    pose: RigidTransform | None
    mount: RigidTransform | None
    flipped: bool = False
    tilt: float = 0.0
    part: tuple[int, ...] = ()
    unknown_ns: int = 0


@dataclass(frozen=True, slots=True)
class Sensor:
    """A scanner.

    Attributes
    ----------
    frame, base : str
        Its own and the robot's; the latter is empty where it is not known.
    odometry : Odometry or None
        Of the scanner; of the robot where the mount is `given`.
    given : (4, 4) or None
        base_from_sensor as the caller says; goes before what the bag says.
    """

    frame: str
    base: str
    odometry: Odometry | None
    given: Floats | None
    _tree: Transforms
    _mounting: tuple[str, ...]  # the frames from its own to `base`, else to the outermost

    def place(self, stamp: int, received: int) -> Place:
        """Return where it was at the stamp of a scan that was received at a time, both in nanoseconds.

        Raises
        ------
        UprightFrameError
            When its scan plane is not horizontal, and no mount is given.
        """
        by_log = self._tree.along(self._mounting, stamp, received) if len(self._mounting) > 1 or self.base else None
        known = None if self.odometry is None else self.odometry.known(stamp, received)
        outer, since = (None, ()) if known is None else (known.matrix, (known.part, known.unknown_ns))
        if self.given is not None:
            flipped = by_log is not None and tilt_of(by_log) <= MOST_TILT and planar(by_log)[1]
            pose = None if outer is None else planar(outer @ self.given)[0]
            return Place(pose, planar(self.given)[0], flipped, 0.0, *since)
        pose = None if outer is None else planar(outer)[0]
        upright = outer if by_log is None else by_log
        if upright is None:
            return Place(None, None)
        above = self.odometry.outer if self.odometry is not None and by_log is None else self._mounting[-1]
        mount, flipped = mounted(upright, self.frame, above)
        return Place(pose, mount if self.base and by_log is not None else None, flipped, tilt_of(upright), *since)

    def clock_offset(self, stamp: int, received: int) -> float:
        """Return how many seconds longer after its stamp a scan was received than odometry was; 0 without odometry."""
        moving = () if self.odometry is None else self.odometry.moving
        return max(((received - stamp - one.latency(stamp, received)) / NS for one in moving), key=abs, default=0.0)

    def motion(self, increment: float, beams: int, begin: int, received: int, notes: Notes) -> Motion | None:
        """Return how the sensor moved during a scan; None where that is not known.

        Parameters
        ----------
        increment : float
            From beam to beam, seconds; 0: not known.
        beams : int
        begin, received : int
            Times of the first beam, and of the scan's reception, nanoseconds.
        notes : Notes
        """
        if not increment:
            return None
        mount = np.eye(4) if self.given is None else self.given
        end = begin + round(increment * beams * NS)
        motion = None if self.odometry is None else self.odometry.motion(increment, begin, end, mount, received)
        if motion is None or not max(math.hypot(motion.vx, motion.vy), abs(motion.omega)) <= FASTEST:
            notes.add_assumed("motion", "scans with a time_increment, but without the motion of the sensor", 1)
            return None
        return motion


def time_increment_of(message: Any, notes: Notes) -> float:
    """Return the time from beam to beam of a LaserScan, seconds; 0 where it is not stated.

    One that makes a scan too long is in another unit, and the whole scan takes its `scan_time`.
    """
    increment, beams, scan_time = float(message.time_increment), len(message.ranges), float(message.scan_time)
    seconds = increment * beams
    if not 0.0 < seconds < math.inf:
        return 0.0
    if seconds <= LONGEST_SCAN:
        return increment
    taken = scan_time if 0.0 < scan_time <= LONGEST_SCAN else USUAL_SCAN
    notes.add_assumed(
        "time_increment",
        f"according to time_increment a scan takes {seconds:.3g} s, expected at most {LONGEST_SCAN:.1f} s; "
        f"{taken:.3g} s are assumed",
        1,
    )
    return taken / beams


class Sensors:
    """The scanners of a bag, by the frames of their scans."""

    def __init__(self, frames: BagFrames, options: LogOptions, notes: Notes) -> None:
        self._frames, self._options, self._notes = frames, options, notes
        self._known: dict[tuple[str, str], Sensor] = {}
        self._bases = (options.base.strip("/"),) if options.base else BASES

    def of(self, topic: str, frame: str) -> Sensor:
        """Return the scanner that a scan comes from; raises `IncompleteFileError` when its transforms are not clear."""
        key = (topic, frame)
        if key not in self._known:
            self._known[key] = self._made(topic, frame.strip("/"))
        return self._known[key]

    def _made(self, topic: str, frame: str) -> Sensor:
        namespace, tree = self._frames.tree(topic, frame, self._options.tf_namespace, self._notes)
        above = tree.above(frame)
        base = base_of(above, self._bases) or ""
        if self._options.base and not base:
            raise IncompleteFileError(
                f"no transform from {shown(frame) or NAMELESS} to the base frame {shown(self._options.base)}: expected "
                f"one of {', '.join(map(shown, above))}; correct the option base (--base)"
            )
        mounting = tuple(tree.path(base or above[-1], frame) or (frame,))
        mount = self._options.mount
        if mount is None:
            return Sensor(frame, base, self._odometry(topic, namespace, tree, frame), None, tree, mounting)
        children = [*tree.frames(), *(one.child for one in self._frames.odometry)]
        base = base or base_of(children, self._bases) or self._bases[0]
        given = np.eye(4)
        c, s = math.cos(mount.theta), math.sin(mount.theta)
        given[:2, :2], given[:2, 3] = [[c, -s], [s, c]], [mount.x, mount.y]
        return Sensor(frame, base, self._odometry(topic, namespace, tree, base), given, tree, mounting)

    def _odometry(self, topic: str, namespace: str, tree: Transforms, frame: str) -> Odometry | None:
        """Return the odometry of a frame: frames that move, else Odometry messages; None where there is none."""
        if self._options.odometry is not None:
            return self._doubted(self._chosen(self._options.odometry, tree, frame))
        paths = [tree.path(outer, frame) or [frame] for outer in outer_frames(tree, frame)]
        moving = next((path for path in paths if moves(tree, path, self._bases)), None)
        above = tree.above(frame)
        base = base_of(above, self._bases)
        fitting = self._frames.odometry_of(topic, namespace, above, base)
        others = [self._of_messages(tree, frame, one) for one in fitting]
        if moving is not None:
            return self._doubted(Odometry(moving[-1], MOVING, tree.tracks(moving)), others)
        if not fitting:
            self._note_missing(frame, paths)
            return None
        found, *others = others
        if others:
            unused = ", ".join(shown(one.source) for one in others)
            self._notes.add_assumed("odometry", f"odometry is that of {shown(found.source)}; not used: {unused}")
        if not found.moving:
            self._notes.add_assumed("odometry_stands", f"the robot never moves according to {shown(found.source)}")
        return self._doubted(found, others)

    def _of_messages(self, tree: Transforms, frame: str, topic: OdometryTopic) -> Odometry:
        child = topic.child or base_of(tree.above(frame), self._bases) or frame
        return Odometry(topic.outer, topic.topic, (*tree.tracks(tree.path(child, frame) or [frame]), topic.track))

    def _chosen(self, source: str, tree: Transforms, frame: str) -> Odometry:
        """Return the odometry of a topic, or in a frame."""
        topics = {one.topic: one for one in self._frames.odometry}
        if source in topics:
            return self._of_messages(tree, frame, topics[source])
        path = tree.path(source.strip("/"), frame)
        if path is None or len(path) < 2:
            there = ", ".join(map(shown, (*topics, *tree.above(frame)[1:]))) or "none"
            raise IncompleteFileError(
                f"no odometry from {shown(source)}: expected a topic of Odometry messages or a frame above "
                f"{shown(frame)}, found {there}; correct the option odometry (--odom)"
            )
        return Odometry(path[-1], MOVING, tree.tracks(path))

    def _doubted(self, found: Odometry, others: Sequence[Odometry] = ()) -> Odometry:
        for other in others:
            found = found.compared(other, self._notes)
        found.note_doubts(self._notes)
        return found

    def _note_missing(self, frame: str, paths: list[list[str]]) -> None:
        base = base_of((*paths, [])[0], self._bases) or frame
        self._notes.add_assumed(
            "no_odometry",
            f"no odometry was found: {shown(base) or NAMELESS} moves in no frame above it, and there is no Odometry "
            "message of this robot; transforms need stamps other than 0",
        )


def note_tilt(sensor: Sensor, place: Place, notes: Notes) -> None:
    """Say that a scan plane is not quite horizontal."""
    if place.tilt > SAID_TILT:
        more = 100.0 * (1.0 / math.cos(place.tilt) - 1.0)
        notes.add_assumed(
            "tilted",
            f"the scan plane of {shown(sensor.frame)} is {math.degrees(place.tilt):.1f} degrees from horizontal and is "
            f"assumed to be horizontal; distances are up to {more:.1f} % too long",
        )
