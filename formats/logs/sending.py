"""Scans of logs as requests have them."""

from __future__ import annotations

import math
from typing import Any

from registration import IDENTITY
from vectorization import LaserScan

from .scan import LoggedScan

FARTHEST = 1e4  # m; where a log names no greatest range


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
    return {"views": [view], "stamp": one.stamp}


def _ranges(laser: LaserScan, most: float) -> list[float | None]:
    """Return ranges as JSON has them: null where nothing is known, and beyond the greatest where nothing came back."""
    return [None if math.isnan(r) else 2.0 * most if math.isinf(r) else r for r in laser.cleaned.tolist()]
