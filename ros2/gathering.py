"""Scans of several scanners that belong together."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field

from registration import InputError

from .frames import Frames
from .looking import Look, look_of
from .messages import LaserScan
from .names import MAX_NAME, quoted
from .odometry import OdometryHistory, nanoseconds
from .options import NodeOptions
from .transforms import FrameError, Mount


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
    scans: Sequence[LaserScan], frames: Frames, options: NodeOptions, odometry: OdometryHistory
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
        step = odometry.step(looks[0].stamp if looks else stamp, stamp)
        try:
            mount = _mount_of(scan, frames, options)
            if step is None:
                raise FrameError(f"no odometry between the newest scan and that of {frame}, which is left out")
            looks.append(look_of(scan, mount, odometry, step, motion=options.motion))
        except FrameError as error:
            missing.append(str(error))
        except InputError as error:
            missing.append(f"the scan of {frame} cannot be used: {error}")
    return looks, missing


def _mount_of(scan: LaserScan, frames: Frames, options: NodeOptions) -> Mount:
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
        raise FrameError(
            f"no transform from {quoted(frame)} to {quoted(base)} on {options.topic('/tf_static')} or "
            f"{options.topic('/tf')}; publish it, or name the base frame with --base"
        )
    return mount
