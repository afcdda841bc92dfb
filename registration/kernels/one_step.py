"""Sums of the paper's estimator in double-double arithmetic: an array of two ONE_STEP_SUMS, values and errors.

After any number of additions and removals they are the sums of what remains; what is lost is 2^-104 of the largest
number that ever stood there.
"""

from __future__ import annotations

import math

from compiled import kernel

from ..layout import Record, Records


@kernel
def accumulated(value: float, error: float, high: float, low: float) -> tuple[float, float]:
    """Return value and error of a sum after ``high + low`` was added to it."""
    total = value + high
    back = total - value
    lost = (value - (total - back)) + (high - back) + (error + low)
    result = total + lost
    return result, lost - (result - total)


@kernel
def one_step_add(
    sums: Records, line: Record, seen: Record, gap: float, alpha_ref: float, weight: float, sign: float
) -> None:
    """Add (`sign` 1) or remove (-1) one pair.

    Parameters
    ----------
    sums : (2,) ONE_STEP_SUMS
        Changed in place.
    line, seen : records with the fields `dx` and `dy`
        Directions of the map and the scan segment.
    gap : float
        ``r`` about the reference, metres.
    alpha_ref : float
        Angle of the reference, radians.
    weight, sign : float
    """
    # The scan direction turned by alpha_ref, and the angle from there to the map's.
    c = math.cos(alpha_ref)
    s = math.sin(alpha_ref)
    ex = c * seen.dx - s * seen.dy
    ey = s * seen.dx + c * seen.dy
    vx = line.dx
    vy = line.dy
    a = math.atan2(ex * vy - ey * vx, ex * vx + ey * vy)
    half = math.sin(0.5 * a)
    w = sign * weight
    value = sums[0]
    error = sums[1]
    value.w, error.w = accumulated(value.w, error.w, w, 0.0)
    value.x2, error.x2 = accumulated(value.x2, error.x2, w * vx * vx, 0.0)
    value.y2, error.y2 = accumulated(value.y2, error.y2, w * vy * vy, 0.0)
    value.xy, error.xy = accumulated(value.xy, error.xy, w * vx * vy, 0.0)
    value.px, error.px = accumulated(value.px, error.px, -w * gap * vy, 0.0)
    value.py, error.py = accumulated(value.py, error.py, w * gap * vx, 0.0)
    value.gap2, error.gap2 = accumulated(value.gap2, error.gap2, w * gap * gap, 0.0)
    value.angle, error.angle = accumulated(value.angle, error.angle, w * a, 0.0)
    value.angle2, error.angle2 = accumulated(value.angle2, error.angle2, w * a * a, 0.0)
    value.versine, error.versine = accumulated(value.versine, error.versine, 2.0 * w * half * half, 0.0)
    value.sine, error.sine = accumulated(value.sine, error.sine, w * math.sin(a), 0.0)
    value.count, error.count = accumulated(value.count, error.count, sign, 0.0)
