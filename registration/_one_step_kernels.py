"""Compiled sums of the paper's estimator over flat float64 arrays; nothing here validates.

The sums are compensated, (2, `ONE_STEP_SIZE`), rows value and error, and taken about a reference transform ``T_ref``,
``alpha_ref``: with ``r = p_map - p_scan - n_map . T_ref`` and ``a = wrap(alpha - alpha_ref)``. With ``v = d_map`` and
``P = r n_map`` they are, in this order, ``sum w`` times: 1, ``v_x^2``, ``v_y^2``, ``v_x v_y``, ``P_x``, ``P_y``,
``r^2``, ``a``, ``a^2``, ``1 - cos a``, ``sin a``; and last the number of pairs.
"""

import math

import numpy as np

from ._kernels import PARALLEL_RATIO, accumulate
from ._pair_kernels import DX, DY, MAP_DX, MAP_DY, MAP_X, MAP_Y, X, Y
from .compiling import kernel

ONE_STEP_SIZE = 12

SW, SX2, SY2, SXY, SPX, SPY, SC, SA, SA2, SVERSINE, SSINE, SCOUNT = range(ONE_STEP_SIZE)


@kernel
def one_step_add(sums, vx, vy, gap, dx, dy, alpha_ref, weight, sign):
    """Add (`sign` 1) or remove (-1) one pair: map direction v, ``gap`` r, scan direction d."""
    # The scan direction turned by alpha_ref, and the angle from there to the map's.
    c = math.cos(alpha_ref)
    s = math.sin(alpha_ref)
    ex = c * dx - s * dy
    ey = s * dx + c * dy
    a = math.atan2(ex * vy - ey * vx, ex * vx + ey * vy)
    half = math.sin(0.5 * a)
    w = sign * weight
    accumulate(sums, SW, w, 0.0)
    accumulate(sums, SX2, w * vx * vx, 0.0)
    accumulate(sums, SY2, w * vy * vy, 0.0)
    accumulate(sums, SXY, w * vx * vy, 0.0)
    accumulate(sums, SPX, -w * gap * vy, 0.0)
    accumulate(sums, SPY, w * gap * vx, 0.0)
    accumulate(sums, SC, w * gap * gap, 0.0)
    accumulate(sums, SA, w * a, 0.0)
    accumulate(sums, SA2, w * a * a, 0.0)
    accumulate(sums, SVERSINE, 2.0 * w * half * half, 0.0)
    accumulate(sums, SSINE, w * math.sin(a), 0.0)
    accumulate(sums, SCOUNT, sign, 0.0)


@kernel
def one_step_sums(rows, x, y, alpha_ref, weights):
    """Return the compensated sums of pairs about a reference; see `_pair_kernels` for `rows`."""
    sums = np.zeros((2, ONE_STEP_SIZE))
    for i in range(len(rows)):
        if weights[i] > 0.0:
            vx = rows[i, MAP_DX]
            vy = rows[i, MAP_DY]
            # Eq. (1), sign corrected: p_S - p_D; the printed p_D - p_S returns exactly -T.
            p_map = vx * (rows[i, MAP_Y] - y) - vy * (rows[i, MAP_X] - x)
            p_scan = rows[i, DX] * rows[i, Y] - rows[i, DY] * rows[i, X]
            one_step_add(sums, vx, vy, p_map - p_scan, rows[i, DX], rows[i, DY], alpha_ref, weights[i], 1.0)
    return sums


@kernel
def one_step_solve(values, use_wahba):
    """Return ``(a, t_x, t_y, observable)`` relative to the reference transform, from the row of values.

    Eqs. (5) to (9) or (10) to (15), with the two minus signs of Eq. (8)'s D1 and D2 turned to plus. Where all lines are
    parallel `observable` is False and the translation is the shortest of those that fit.
    """
    if use_wahba:
        angle = math.atan2(values[SSINE], values[SW] - values[SVERSINE])
    else:
        angle = values[SA] / values[SW] if values[SW] > 0.0 else 0.0
    sx2 = values[SX2]
    sy2 = values[SY2]
    sxy = values[SXY]
    px = values[SPX]
    py = values[SPY]
    det = sx2 * sy2 - sxy * sxy
    big = 0.5 * (sx2 + sy2) + math.sqrt(0.25 * (sx2 - sy2) * (sx2 - sy2) + sxy * sxy)
    if big > 0.0 and det > PARALLEL_RATIO * big * big:
        return angle, (px * sx2 + sxy * py) / det, (py * sy2 + sxy * px) / det, True
    if big > 0.0:
        # Along the normal that all share, the eigenvector of [[S_y2, -S_xy], [-S_xy, S_x2]].
        normal = 0.5 * math.atan2(-2.0 * sxy, sy2 - sx2)
        nx = math.cos(normal)
        ny = math.sin(normal)
        length = (px * nx + py * ny) / big
        return angle, length * nx, length * ny, False
    return angle, 0.0, 0.0, False


@kernel
def one_step_moved(sums, dx, dy, turn):
    """Return the sums about a reference that is moved by ``(dx, dy)`` and turned by `turn`."""
    v = sums[0]
    out = sums.copy()
    # Translations: r' = r - n . delta, with sum w n n' = [[S_y2, -S_xy], [-S_xy, S_x2]].
    hx = v[SY2] * dx - v[SXY] * dy
    hy = v[SX2] * dy - v[SXY] * dx
    accumulate(out, SPX, -hx, 0.0)
    accumulate(out, SPY, -hy, 0.0)
    accumulate(out, SC, dx * (hx - 2.0 * v[SPX]) + dy * (hy - 2.0 * v[SPY]), 0.0)
    # Angles: a' = a - turn.
    c = math.cos(turn)
    s = math.sin(turn)
    half = math.sin(0.5 * turn)
    accumulate(out, SA, -turn * v[SW], 0.0)
    accumulate(out, SA2, turn * (turn * v[SW] - 2.0 * v[SA]), 0.0)
    out[0, SVERSINE] = v[SVERSINE] * c + 2.0 * half * half * v[SW] - v[SSINE] * s
    out[0, SSINE] = v[SSINE] * c - (v[SW] - v[SVERSINE]) * s
    out[1, SVERSINE] = 0.0
    out[1, SSINE] = 0.0
    return out


@kernel
def one_step_costs(sums, dx, dy, turn):
    """Return the costs at the reference moved by ``(dx, dy)`` and turned by `turn`, each at least 0.

    Of the translation, ``sum w r^2``; of the rotation by Mitsuta, ``sum w a^2``, and by Wahba, ``2 sum w (1 - cos a)``.
    """
    moved = one_step_moved(sums, dx, dy, turn)
    return max(0.0, moved[0, SC]), max(0.0, moved[0, SA2]), max(0.0, 2.0 * moved[0, SVERSINE])
