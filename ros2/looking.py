"""Messages and the mounts of their scanners to the input of the search; and the scans that belong together."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

import linefix
from formats.logs.lasers import laser_of
from formats.logs.sensors import time_increment_of
from formats.logs.tuning import SAID_TILT
from formats.report import Notes
from linefix.ranges import motion_warning
from registration import IDENTITY, InputError, RigidTransform

from .frames import FrameError, Frames, Mount
from .messages import LaserScan, Time, nanoseconds
from .odometry import OdometryHistory, Speed
from .options import MAX_NAME, NodeOptions, quoted


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """A scan, and from where it was taken; a `linefix.MountedScan`.

    Attributes
    ----------
    stamp : Time
        Of the first beam.
    frame : str
        Of the laser.
    laser : LaserScan
        In the frame of the laser, upside down where it is `flipped`; with its motion where that is known.
    time_increment : float
        From beam to beam, seconds; 0: all beams are of one moment.
    mount : RigidTransform
        base_from_laser.
    flipped : bool
    base_from_then : RigidTransform
        The robot's pose at that time, in the frame of its base at the requested time.
    notes : mapping of str to str
        By code, what is wrong with the scan.
    """

    stamp: Time
    frame: str
    laser: linefix.LaserScan
    time_increment: float
    mount: RigidTransform
    flipped: bool = False
    base_from_then: RigidTransform = IDENTITY
    notes: Mapping[str, str] = field(default_factory=dict)

    @property
    def view(self) -> linefix.View:
        """The scan as the search takes it, in the frame of the robot."""
        return linefix.view_of(self, self.base_from_then)


def look_of(
    message: LaserScan, mount: Mount, odometry: OdometryHistory, base_from_then: RigidTransform, *, motion: bool
) -> Look:
    """Return a message as a scan.

    Parameters
    ----------
    message : LaserScan
    mount : Mount
    odometry : OdometryHistory
        Has the speed of the robot during the scan, or not.
    base_from_then : RigidTransform
        As of `Look`.
    motion : bool
        False: all beams are taken to be of one moment.

    Raises
    ------
    InputError
        When it is no scan, or the scanner turned nearly as fast as it scans.
    FrameError
        When no range is valid.
    """
    notes = Notes()
    laser, increment = laser_of(message, notes), time_increment_of(message, notes) if motion else 0.0
    if np.isnan(laser.cleaned).all():
        raise FrameError(
            f"no valid range in the scan of {quoted(message.header.frame_id)}: none of {len(laser.ranges)} ranges is a "
            f"number of at least {laser.range_min:g} m (range_min); check that the laser is on and not covered"
        )
    middle = nanoseconds(message.header.stamp) + round(0.5e9 * increment * len(laser.ranges))
    speed = odometry.speed(middle) if increment else None
    laser = laser if speed is None else replace(laser, motion=motion_of(increment, mount, speed))
    header, place = message.header, mount.base_from_laser
    look = Look(header.stamp, header.frame_id, laser, increment, place, mount.flipped, base_from_then)
    problems = {note.code: note.message for note in notes.assumed.values()}
    if mount.tilt > SAID_TILT:
        problems["tilted"] = (
            f"the scan plane is tilted by {math.degrees(mount.tilt):.0f} degrees, "
            "expected a horizontal plane; ranges are used without correction"
        )
    moving = motion_warning(look)
    if moving is not None:
        problems[moving.code] = moving.message
    return replace(look, notes=problems)


def motion_of(time_increment: float, mount: Mount, speed: Speed) -> linefix.Motion:
    """Return the motion of a scanner in its own frame, from the speed of the robot; upside down, left is right."""
    carried, side = speed.carried(mount.base_from_laser), -1.0 if mount.flipped else 1.0
    return linefix.Motion(time_increment, carried.vx, side * carried.vy, side * carried.omega)


@dataclass(slots=True)
class Gathering:
    """Keeps the newest scan of each topic until those of all have come, or it has waited long enough for them.

    Attributes
    ----------
    topics : int
        Number of topics.
    seconds : float
        Scans that are taken no farther apart are answered together; as long it is waited for the others.
    """

    topics: int
    seconds: float
    _fresh: dict[int, LaserScan] = field(default_factory=dict)
    _since: float | None = None

    def take(self, topic: int, scan: LaserScan) -> None:
        """Take a scan; it replaces an older one of its topic that was not answered yet."""
        self._fresh[topic] = scan
        self._since = time.monotonic() if self._since is None else self._since

    @property
    def left(self) -> float | None:
        """Seconds that are still waited; None where there is nothing to wait for."""
        return None if self._since is None else max(0.0, self._since + self.seconds - time.monotonic())

    def ready(self) -> list[LaserScan]:
        """Return the scans to answer now, the newest first; none where others are still waited for."""
        if not self._fresh or (len(self._fresh) < self.topics and self.left):
            return []
        scans = sorted(self._fresh.values(), key=lambda one: nanoseconds(one.header.stamp), reverse=True)
        self._fresh.clear()
        self._since = None
        newest = nanoseconds(scans[0].header.stamp)
        return [one for one in scans if newest - nanoseconds(one.header.stamp) <= self.seconds * 1e9]


def looks_of(
    scans: Sequence[LaserScan],
    frames: Frames,
    options: NodeOptions,
    odometry: OdometryHistory,
    unprefixed: Callable[[str], str] = lambda _: "",
) -> tuple[list[Look], list[str]]:
    """Return scans with the poses that they were taken from, relative to the robot at the time of the first.

    Parameters
    ----------
    scans : sequence of LaserScan
        The newest first.
    frames : Frames
    options : NodeOptions
        The base frame, and whether scans are corrected for motion.
    odometry : OdometryHistory
    unprefixed : callable
        Returns the topic on which a frame comes without the prefix of the robot; empty if on none.

    Returns
    -------
    list of Look
    list of str
        Why others are not among them.
    """
    looks: list[Look] = []
    missing: list[str] = []
    for scan in scans:
        stamp, frame = scan.header.stamp, quoted(scan.header.frame_id)
        step = odometry.between(nanoseconds(looks[0].stamp if looks else stamp), nanoseconds(stamp))
        try:
            mount = _mount_of(scan, frames, options, unprefixed)
            if step is None:
                raise FrameError(f"no odometry between the newest scan and that of {frame}, which is left out")
            looks.append(look_of(scan, mount, odometry, step, motion=options.motion))
        except FrameError as error:
            missing.append(str(error))
        except InputError as error:
            missing.append(f"the scan of {frame} cannot be used: {error}")
    return looks, missing


def _mount_of(scan: LaserScan, frames: Frames, options: NodeOptions, unprefixed: Callable[[str], str]) -> Mount:
    name = scan.header.frame_id
    if not name.strip("/"):
        raise FrameError(
            "the scan has an empty frame_id, expected the frame of the laser; set it in the parameters of its driver"
        )
    if len(name) > MAX_NAME:
        raise FrameError(f"the frame_id of the scan has {len(name)} characters, expected at most {MAX_NAME}")
    frame = options.frame(name)
    base = options.base_of(frame)
    mount = frames.mount(base, frame, nanoseconds(scan.header.stamp))
    if mount is None:
        topic, remedy = unprefixed(frame), "publish it, or name the base frame with --base"
        if topic:
            rules = "-r tf:=/tf -r tf_static:=/tf_static"
            remedy = f"{topic} has it without the prefix {options.prefix}: if only this robot uses it, add {rules}"
        raise FrameError(
            f"no transform from {quoted(frame)} to {quoted(base)} on {options.topic('/tf_static')} or "
            f"{options.topic('/tf')}; {remedy}"
        )
    return mount
