"""A LaserScan message to a scan: fields that contradict each other or say nothing.

REP 117 and the comments of the message define the fields. Drivers leave some of them at 0.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from registration.limits import MAX_LENGTH
from vectorization import InvalidScanError, LaserScan, require_angle_max

from ..report import Notes

USUAL_OFF = 1.5  # beams between angle_max and the last beam, of which nothing is said
Message = Any  # sensor_msgs/LaserScan, whatever library it comes from


def laser_of(message: Message, notes: Notes) -> LaserScan:
    """Return the scan of a message.

    A `range_max` that is no distance above `range_min` says nothing of how far the laser sees: infinite ranges are then
    taken as unknown, not as free space.

    Parameters
    ----------
    message : object
        With the fields of ``sensor_msgs/LaserScan``.
    notes : Notes
        Takes the fields that were not believed.

    Raises
    ------
    InvalidScanError
        When there are no ranges, or the angles contradict each other.
    """
    ranges = np.asarray(message.ranges, dtype=np.float64)
    if not len(ranges):
        raise InvalidScanError("expected at least one range, found none", argument="ranges")
    first, last, step = (float(getattr(message, f"angle_{name}")) for name in ("min", "max", "increment"))
    off = require_angle_max(first, last, step, len(ranges))
    if off > USUAL_OFF * abs(step):
        notes.add_assumed(
            "angle_max",
            f"scans whose angle_max is {math.degrees(off):.2g} degrees ({off / abs(step):.3g} beams) from the last "
            "beam; angle_increment and the number of ranges are used",
            1,
        )
    low, high = _limits(float(message.range_min), float(message.range_max), notes)
    # Drivers report the greatest range itself where nothing came back, and AMCL takes it so.
    ranges = np.where(ranges == high, math.nan if high == math.inf else math.inf, ranges)
    scan = LaserScan(first, step, ranges, low, high)
    note_far(scan, notes)
    return scan


def note_far(scan: LaserScan, notes: Notes) -> None:
    """Note a scan whose ranges are all too near or too far, as those in another unit are."""
    if (beyond := scan.beyond_limits) is not None:
        notes.add_assumed("no_range_within", f"scans without any range {beyond}", 1)


def _limits(low: float, high: float, notes: Notes) -> tuple[float, float]:
    """Return the limits of valid ranges, metres; 0 and infinity where a field is not set."""
    if not 0.0 <= low < MAX_LENGTH:
        notes.add_assumed("range_min", f"scans whose range_min is {low:g} m, expected at least 0 m; 0 m is assumed", 1)
        low = 0.0
    if low < high <= MAX_LENGTH:
        return low, high
    if 0.0 < high <= low:  # which of the two is wrong is not known
        told = f"scans whose range_max is {high:g} m and range_min {low:g} m; both are ignored"
        low = 0.0
    else:
        told = f"scans whose range_max is {high:g} m, which is not a possible range of the laser"
    notes.add_assumed("range_max", f"{told}; infinite ranges count as unknown, not as free space", 1)
    return low, math.inf
