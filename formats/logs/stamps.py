"""The stamps of a log's scans: those that are 0, that repeat, or that jump back; the parts that a log has for them."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from registration import wrap_angle

from ..report import Notes
from .scan import LoggedScan
from .tracks import jump_between
from .tuning import PART_NS

NS = 1e-9


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
        if self._last is not None and stamp == self._last:
            self.notes.add_assumed("stamp_repeated", "scans with the stamp of the scan before", 1)
        elif self._last is not None and stamp < self._last:
            self._farthest_back = max(self._farthest_back, (self._last - stamp) * NS)
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
