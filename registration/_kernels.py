"""Compiled sums and solvers over flat float64 arrays.

Nothing here validates: callers hand over finite arrays of the shapes that are named. Every kernel has a slow twin in
``tests/reference.py``.

The joint sums are one array of `JOINT_SIZE` doubles: the upper triangle of the 5 x 5 matrix ``Q`` of
``cost = x' Q x`` with ``x = [cos, sin, t_x, t_y, 1]``, row by row, then the two sums of Wahba's angle, then the number
of pairs. Adding or removing a pair or a whole set is plain addition, so a consensus set changes in constant time
whatever its size.
"""

import math

import numpy as np

from ._pair_kernels import CENTROID_X, CENTROID_Y, DX, DY, MAP_DX, MAP_DY, MAP_X, MAP_Y, SPREAD
from .compiling import kernel

JOINT_SIZE = 18

# Places of the upper triangle of Q, rows and columns in the order cos, sin, t_x, t_y, 1.
CC, CS, CX, CY, C1, SS, SX, SY, S1, XX, XY, X1, YY, Y1, ONE, WAHBA_COS, WAHBA_SIN, COUNT = range(JOINT_SIZE)

# Below this ratio of the smaller to the larger eigenvalue of the translation block, rounding alone decides the slide.
PARALLEL_RATIO = 1e-12

MAX_STEPS = 16
MAX_STEP = 0.3  # rad


@kernel
def joint_add(sums, nx, ny, p, mx, my, dx, dy, spread, weight, sign):
    """Add (`sign` 1) or remove (-1) one pair: map line ``(nx, ny, p)``, scan centroid, direction, second moment."""
    f0 = nx * mx + ny * my
    f1 = ny * mx - nx * my
    g0 = nx * dx + ny * dy
    g1 = ny * dx - nx * dy
    w = sign * weight
    ws = w * spread
    sums[0] += w * f0 * f0 + ws * g0 * g0
    sums[1] += w * f0 * f1 + ws * g0 * g1
    sums[2] += w * f0 * nx
    sums[3] += w * f0 * ny
    sums[4] -= w * f0 * p
    sums[5] += w * f1 * f1 + ws * g1 * g1
    sums[6] += w * f1 * nx
    sums[7] += w * f1 * ny
    sums[8] -= w * f1 * p
    sums[9] += w * nx * nx
    sums[10] += w * nx * ny
    sums[11] -= w * nx * p
    sums[12] += w * ny * ny
    sums[13] -= w * ny * p
    sums[14] += w * p * p
    # cos and sin of angle(d_map) - angle(d_scan), with the map's direction (ny, -nx); weighted by the information
    # that the pair has of the angle.
    sums[15] += ws * g1
    sums[16] -= ws * g0
    sums[17] += sign


@kernel
def joint_solve(sums, theta0, use_wahba):
    """Minimise ``x' Q x`` over the rigid transforms.

    Returns ``(theta, t_x, t_y, cost, observable)``. The search for theta starts at Wahba's angle (or at `theta0`),
    since Q cannot tell a direction from its opposite, and takes Newton steps on the unit circle. Where all lines are
    parallel `observable` is False and the translation is the shortest of those that fit.
    """
    a = sums[9]
    b = sums[10]
    d = sums[12]
    theta = math.atan2(sums[16], sums[15]) if use_wahba else theta0
    half_trace = 0.5 * (a + d)
    root = math.sqrt(0.25 * (a - d) * (a - d) + b * b)
    big = half_trace + root
    det = a * d - b * b
    observable = big > 0.0 and det > PARALLEL_RATIO * big * big
    if observable:
        i00 = d / det
        i01 = -b / det
        i11 = a / det
    elif big > 0.0:
        # Pseudo-inverse of rank one along the eigenvector of the larger eigenvalue.
        angle = 0.5 * math.atan2(2.0 * b, a - d)
        ex = math.cos(angle)
        ey = math.sin(angle)
        i00 = ex * ex / big
        i01 = ex * ey / big
        i11 = ey * ey / big
    else:
        i00 = 0.0
        i01 = 0.0
        i11 = 0.0
    # Schur complement on (cos, sin, 1).
    xc = sums[2]
    yc = sums[3]
    xs = sums[6]
    ys = sums[7]
    x1 = sums[11]
    y1 = sums[13]
    kxc = i00 * xc + i01 * yc
    kyc = i01 * xc + i11 * yc
    kxs = i00 * xs + i01 * ys
    kys = i01 * xs + i11 * ys
    kx1 = i00 * x1 + i01 * y1
    ky1 = i01 * x1 + i11 * y1
    mcc = sums[0] - (xc * kxc + yc * kyc)
    mcs = sums[1] - (xc * kxs + yc * kys)
    mc1 = sums[4] - (xc * kx1 + yc * ky1)
    mss = sums[5] - (xs * kxs + ys * kys)
    ms1 = sums[8] - (xs * kx1 + ys * ky1)
    m11 = sums[14] - (x1 * kx1 + y1 * ky1)
    c = math.cos(theta)
    s = math.sin(theta)
    for _ in range(MAX_STEPS):
        uc = mcc * c + mcs * s + mc1
        us = mcs * c + mss * s + ms1
        slope = c * us - s * uc
        curve = s * s * mcc - 2.0 * s * c * mcs + c * c * mss - c * uc - s * us
        if curve > 0.0:
            step = min(MAX_STEP, max(-MAX_STEP, -slope / curve))
        elif slope == 0.0:
            break
        else:
            # Near a maximum Newton would climb: walk down until the curve turns.
            step = -math.copysign(MAX_STEP, slope)
        theta += step
        c = math.cos(theta)
        s = math.sin(theta)
        if abs(step) < 1e-13:
            break
    theta = math.atan2(s, c)
    tx = -(kxc * c + kxs * s + kx1)
    ty = -(kyc * c + kys * s + ky1)
    cost = mcc * c * c + 2.0 * mcs * c * s + mss * s * s + 2.0 * (mc1 * c + ms1 * s) + m11
    return theta, tx, ty, max(cost, 0.0), observable


@kernel
def joint_cost(sums, theta, tx, ty):
    """Return ``x' Q x`` at any transform."""
    x = (math.cos(theta), math.sin(theta), tx, ty, 1.0)
    total = 0.0
    k = 0
    for i in range(5):
        total += sums[k] * x[i] * x[i]
        k += 1
        for j in range(i + 1, 5):
            total += 2.0 * sums[k] * x[i] * x[j]
            k += 1
    return max(total, 0.0)


@kernel
def joint_information(sums, theta, out):
    """Write the 3 x 3 information matrix of additive (t_x, t_y, theta) in the map frame to `out`."""
    c = math.cos(theta)
    s = math.sin(theta)
    out[0, 0] = sums[9]
    out[0, 1] = sums[10]
    out[1, 0] = sums[10]
    out[1, 1] = sums[12]
    out[0, 2] = c * sums[6] - s * sums[2]
    out[2, 0] = out[0, 2]
    out[1, 2] = c * sums[7] - s * sums[3]
    out[2, 1] = out[1, 2]
    out[2, 2] = s * s * sums[0] - 2.0 * s * c * sums[1] + c * c * sums[5]


@kernel
def accumulate(sums, k, high, low):
    """Add ``high + low`` to entry k of compensated sums, rows value and error, in double-double arithmetic.

    What is lost is 2^-104 of the largest number that ever stood there.
    """
    old = sums[0, k]
    total = old + high
    back = total - old
    error = (old - (total - back)) + (high - back) + (sums[1, k] + low)
    value = total + error
    sums[1, k] = error - (value - total)
    sums[0, k] = value


@kernel
def compensated_add(sums, other, sign):
    """Add (`sign` 1) or remove (-1) whole compensated sums, both (2, k)."""
    for k in range(sums.shape[1]):
        accumulate(sums, k, sign * other[0, k], sign * other[1, k])


@kernel
def joint_add_compensated(sums, nx, ny, p, mx, my, dx, dy, spread, weight, sign):
    """Do as `joint_add` on (2, `JOINT_SIZE`) compensated sums."""
    terms = np.zeros(JOINT_SIZE)
    joint_add(terms, nx, ny, p, mx, my, dx, dy, spread, weight, 1.0)
    for k in range(JOINT_SIZE):
        accumulate(sums, k, sign * terms[k], 0.0)


@kernel
def joint_sums_compensated(rows, weights):
    """Return the compensated joint sums of pairs, (2, `JOINT_SIZE`); see `_pair_kernels` for `rows`."""
    sums = np.zeros((2, JOINT_SIZE))
    for i in range(len(rows)):
        if weights[i] > 0.0:
            nx = -rows[i, MAP_DY]
            ny = rows[i, MAP_DX]
            joint_add_compensated(
                sums, nx, ny, nx * rows[i, MAP_X] + ny * rows[i, MAP_Y], rows[i, CENTROID_X], rows[i, CENTROID_Y],
                rows[i, DX], rows[i, DY], rows[i, SPREAD], weights[i], 1.0,
            )  # fmt: skip
    return sums
