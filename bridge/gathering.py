"""Scans of several scanners that belong together."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field

from .locating import Look, Mounts, seconds_of
from .messages import LaserScan
from .odometry import Heard, nanoseconds


@dataclass(slots=True)
class Gathering:
    """Keeps the newest scan of each topic until those of all have come, or it has waited long enough for them.

    Attributes
    ----------
    topics : int
        How many.
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
    scans: Sequence[LaserScan], mounts: Mounts, odometry: Heard, *, motion: bool = True
) -> tuple[list[Look], list[str]]:
    """Return scans with where they were taken, as seen from the robot at the time of the first.

    With `motion` they come with how fast the robot moved meanwhile, as far as odometry says it.

    Returns
    -------
    list of Look
    list of str
        Why others are not among them.
    """
    looks: list[Look] = []
    missing: list[str] = []
    for scan in scans:
        frame, now = scan.header.frame_id, (looks[0].message if looks else scan).header.stamp
        mount, step = mounts.of(frame), odometry.step(now, scan.header.stamp)
        if mount is None:
            missing.append(f"/tf_static does not say where {frame} is in {mounts.base}")
        elif step is None:
            missing.append(f"no odometry says how the robot moved since the scan of {frame}")
        else:
            middle = nanoseconds(scan.header.stamp) + round(0.5e9 * seconds_of(scan))
            looks.append(Look(scan, mount, step, odometry.speed(middle) if motion else None))
    return looks, missing
