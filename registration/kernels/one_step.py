"""Sums and solutions of the paper's estimator.

The sums are compensated, an array of two ONE_STEP_SUMS, values and errors, about a reference transform.
"""

from __future__ import annotations

import math

import numpy as np

from compiled import kernel

from ..layout import ONE_STEP_SUMS, Floats, Record, Records
from .compensated import accumulated
from .matrices import PARALLEL_RATIO
from .records import keep_alive


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


@kernel
def gap_at(line: Record, seen: Record, x: float, y: float) -> float:
    """Return ``r`` of a pair about a translation, metres.

    Eq. (1), sign corrected: p_S - p_D; the printed p_D - p_S returns exactly -T.
    """
    return line.dx * (line.y - y) - line.dy * (line.x - x) - (seen.dx * seen.y - seen.dy * seen.x)


@kernel
def translation_cost(pairs: Records, weights: Floats, x: float, y: float) -> float:
    """Return the paper's cost of a translation, ``sum w r^2``, from the pairs; those of weight 0 do not count.

    Sums about a translation that is far away lose the digits of what cancels: parallel lines fit far along them, too.
    """
    total = 0.0
    error = 0.0
    for i in range(len(pairs)):
        if weights[i] > 0.0:
            gap = gap_at(pairs[i].map, pairs[i].scan, x, y)
            total, error = accumulated(total, error, weights[i] * gap * gap, 0.0)
    return total + error


@kernel
def one_step_sums(pairs: Records, x: float, y: float, alpha_ref: float, weights: Floats) -> Records:
    """Return the compensated sums of pairs about a reference; those of weight 0 do not count."""
    sums = np.zeros(2, ONE_STEP_SUMS)
    for i in range(len(pairs)):
        if weights[i] > 0.0:
            line = pairs[i].map
            seen = pairs[i].scan
            one_step_add(sums, line, seen, gap_at(line, seen, x, y), alpha_ref, weights[i], 1.0)
    return sums


@kernel
def one_step_solve(values: Record, use_wahba: bool) -> tuple[float, float, float, bool]:
    """Return ``(a, t_x, t_y, observable)`` relative to the reference transform.

    Eqs. (5) to (9) or (10) to (15), with the two minus signs of Eq. (8)'s D1 and D2 turned to plus. If all lines are
    parallel `observable` is False and the translation is the shortest of those that fit.
    """
    v = values
    mean = v.angle / v.w if v.w > 0.0 else 0.0
    angle = math.atan2(v.sine, v.w - v.versine) if use_wahba else mean
    det = v.x2 * v.y2 - v.xy * v.xy
    big = 0.5 * (v.x2 + v.y2) + math.sqrt(0.25 * (v.x2 - v.y2) * (v.x2 - v.y2) + v.xy * v.xy)
    if big > 0.0 and det > PARALLEL_RATIO * big * big:
        return angle, (v.px * v.x2 + v.xy * v.py) / det, (v.py * v.y2 + v.xy * v.px) / det, True
    if big > 0.0:
        # Along the normal that all share, the eigenvector of [[S_y2, -S_xy], [-S_xy, S_x2]].
        normal = 0.5 * math.atan2(-2.0 * v.xy, v.y2 - v.x2)
        nx = math.cos(normal)
        ny = math.sin(normal)
        length = (v.px * nx + v.py * ny) / big
        return angle, length * nx, length * ny, False
    return angle, 0.0, 0.0, False


@kernel
def determinant_and_reliability(values: Record) -> tuple[float, float]:
    """Return Eq. (8)'s D, not below 0, and Eq. (28) from 0 to 1, ``2 sqrt(D) / S_w``."""
    v = values
    determinant = max(0.0, v.x2 * v.y2 - v.xy * v.xy)
    return determinant, min(1.0, 2.0 * math.sqrt(determinant) / v.w) if v.w > 0.0 else 0.0


@kernel
def wahba_angle(pairs: Records, weights: Floats) -> float:
    """Return Wahba's rotation of pairs, Eq. (15), radians; those of weight 0 do not count."""
    sums = one_step_sums(pairs, 0.0, 0.0, 0.0, weights)
    angle = one_step_solve(sums[0], True)[0]
    keep_alive(sums)
    return angle


@kernel
def one_step_moved(sums: Records, dx: float, dy: float, turn: float) -> Records:
    """Return the sums about a reference that is moved by ``(dx, dy)`` and turned by `turn`."""
    out = sums.copy()
    v = sums[0]
    value = out[0]
    error = out[1]
    # Translations: r' = r - n . delta, with sum w n n' = [[S_y2, -S_xy], [-S_xy, S_x2]].
    hx = v.y2 * dx - v.xy * dy
    hy = v.x2 * dy - v.xy * dx
    value.px, error.px = accumulated(value.px, error.px, -hx, 0.0)
    value.py, error.py = accumulated(value.py, error.py, -hy, 0.0)
    change = dx * (hx - 2.0 * v.px) + dy * (hy - 2.0 * v.py)
    value.gap2, error.gap2 = accumulated(value.gap2, error.gap2, change, 0.0)
    # Angles: a' = a - turn.
    c = math.cos(turn)
    s = math.sin(turn)
    half = math.sin(0.5 * turn)
    value.angle, error.angle = accumulated(value.angle, error.angle, -turn * v.w, 0.0)
    change = turn * (turn * v.w - 2.0 * v.angle)
    value.angle2, error.angle2 = accumulated(value.angle2, error.angle2, change, 0.0)
    value.versine = v.versine * c + 2.0 * half * half * v.w - v.sine * s
    value.sine = v.sine * c - (v.w - v.versine) * s
    error.versine = 0.0
    error.sine = 0.0
    return out


@kernel
def one_step_costs(sums: Records, dx: float, dy: float, turn: float) -> tuple[float, float, float]:
    """Return the costs at the reference moved by ``(dx, dy)`` and turned by `turn`, each at least 0.

    Of the translation, ``sum w r^2``; of the rotation by Mitsuta, ``sum w a^2``, and by Wahba, ``2 sum w (1 - cos a)``.
    """
    moved = one_step_moved(sums, dx, dy, turn)
    value = moved[0]
    costs = (max(0.0, value.gap2), max(0.0, value.angle2), max(0.0, 2.0 * value.versine))
    keep_alive(moved)
    return costs
