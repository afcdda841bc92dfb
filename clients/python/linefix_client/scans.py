"""Ranges as JSON has them: without NaN and infinity."""

from __future__ import annotations

import math
from collections.abc import Iterable

from . import schema

BEYOND = 1.0  # m above range_max: nothing came back
FARTHEST = 1e9  # m, what the service takes


def laser(
    ranges: Iterable[float],
    angle_min: float,
    angle_increment: float,
    range_min: float = 0.0,
    range_max: float | None = None,
) -> schema.Laser:
    """Return a scan as the service takes it.

    Parameters
    ----------
    ranges : iterable of float
        Metres; inf where nothing came back, nan or -inf where nothing is known, as REP-117 has them.
    angle_min, angle_increment : float
        Radians, counter-clockwise; of the first beam, and from beam to beam.
    range_min, range_max : float
        Metres. Without `range_max` a beam from which nothing came back says nothing.
    """
    known = range_max is not None and math.isfinite(range_max)
    nothing = min(range_max + BEYOND, FARTHEST) if known and range_max is not None else None
    told: schema.Laser = {
        "angle_min": float(angle_min),
        "angle_increment": float(angle_increment),
        "ranges": [float(r) if math.isfinite(r) else nothing if r > 0.0 else None for r in ranges],
        "range_min": float(range_min),
    }
    if known:
        told["range_max"] = range_max
    return told
