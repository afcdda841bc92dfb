"""Sums and solutions of both estimators.

Those of the joint one are the upper triangle of the 5 x 5 matrix ``Q`` of ``cost = x' Q x`` with ``x = [cos, sin, t_x,
t_y, 1]``, the two sums of Wahba's angle and the number of pairs. Adding or removing a pair or a whole set is plain
addition, so a consensus set changes in constant time whatever its size.

Those of the paper's are an array of two ONE_STEP_SUMS in double-double arithmetic, values and errors. After any number
of additions and removals they are the sums of what remains; what is lost is 2^-104 of the largest number that ever
stood there.
"""

from __future__ import annotations

import math

from compiled import kernel

from ..layout import Record

MAX_DEVIATION = 0.5  # m; a translation less certain than this in some direction is not fixed
PARALLEL_RATIO = 1e-12  # of two eigenvalues: below it rounding alone decides the direction of the smaller one
MIN_PIVOT = 1e-12  # of the determinant to the product of the diagonal; a smaller one is singular

MAX_STEPS = 16
MAX_STEP = 0.3  # rad


@kernel
def joint_add(sums: Record, line: Record, seen: Record, weight: float, sign: float) -> None:
    """Add (`sign` 1) or remove (-1) one pair.

    Parameters
    ----------
    sums : JOINT_SUMS
        Changed in place.
    line : record with the fields of LINE
        Of the map.
    seen : record with the fields of SEEN
        Of the scan.
    weight : float
        1/m^2.
    sign : float
    """
    nx = -line.dy
    ny = line.dx
    p = line.offset
    f0 = nx * seen.centroid_x + ny * seen.centroid_y
    f1 = ny * seen.centroid_x - nx * seen.centroid_y
    g0 = nx * seen.dx + ny * seen.dy
    g1 = ny * seen.dx - nx * seen.dy
    w = sign * weight
    ws = w * seen.spread
    sums.cc += w * f0 * f0 + ws * g0 * g0
    sums.cs += w * f0 * f1 + ws * g0 * g1
    sums.cx += w * f0 * nx
    sums.cy += w * f0 * ny
    sums.c1 -= w * f0 * p
    sums.ss += w * f1 * f1 + ws * g1 * g1
    sums.sx += w * f1 * nx
    sums.sy += w * f1 * ny
    sums.s1 -= w * f1 * p
    sums.xx += w * nx * nx
    sums.xy += w * nx * ny
    sums.x1 -= w * nx * p
    sums.yy += w * ny * ny
    sums.y1 -= w * ny * p
    sums.one += w * p * p
    # cos and sin of angle(d_map) - angle(d_scan), with the map's direction (ny, -nx); weighted by the information
    # that the pair has of the angle.
    sums.wahba_cos += ws * g1
    sums.wahba_sin -= ws * g0
    sums.count += sign


@kernel
def joint_solve(sums: Record, start: float) -> tuple[float, float, float, float, bool]:
    """Minimise ``x' Q x`` over the rigid transforms.

    Returns ``(theta, t_x, t_y, cost, observable)``. The search for theta begins at `start`, since Q cannot tell a
    direction from its opposite, and takes Newton steps on the unit circle. If all lines are parallel `observable` is
    False and the translation is the shortest of those that fit.
    """
    a = sums.xx
    b = sums.xy
    d = sums.yy
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
    xc = sums.cx
    yc = sums.cy
    xs = sums.sx
    ys = sums.sy
    x1 = sums.x1
    y1 = sums.y1
    kxc = i00 * xc + i01 * yc
    kyc = i01 * xc + i11 * yc
    kxs = i00 * xs + i01 * ys
    kys = i01 * xs + i11 * ys
    kx1 = i00 * x1 + i01 * y1
    ky1 = i01 * x1 + i11 * y1
    mcc = sums.cc - (xc * kxc + yc * kyc)
    mcs = sums.cs - (xc * kxs + yc * kys)
    mc1 = sums.c1 - (xc * kx1 + yc * ky1)
    mss = sums.ss - (xs * kxs + ys * kys)
    ms1 = sums.s1 - (xs * kx1 + ys * ky1)
    m11 = sums.one - (x1 * kx1 + y1 * ky1)
    theta = start
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
def joint_cost(sums: Record, theta: float, tx: float, ty: float) -> float:
    """Return ``x' Q x`` at any transform."""
    c = math.cos(theta)
    s = math.sin(theta)
    total = sums.cc * c * c
    total += 2.0 * sums.cs * c * s
    total += 2.0 * sums.cx * c * tx
    total += 2.0 * sums.cy * c * ty
    total += 2.0 * sums.c1 * c
    total += sums.ss * s * s
    total += 2.0 * sums.sx * s * tx
    total += 2.0 * sums.sy * s * ty
    total += 2.0 * sums.s1 * s
    total += sums.xx * tx * tx
    total += 2.0 * sums.xy * tx * ty
    total += 2.0 * sums.x1 * tx
    total += sums.yy * ty * ty
    total += 2.0 * sums.y1 * ty
    total += sums.one
    return max(total, 0.0)


@kernel
def joint_information(sums: Record, theta: float, out: Record) -> None:
    """Write the information of additive (t_x, t_y, theta) in the map frame to `out`, a SYMMETRIC3."""
    c = math.cos(theta)
    s = math.sin(theta)
    out.xx = sums.xx
    out.xy = sums.xy
    out.yy = sums.yy
    out.xt = c * sums.sx - s * sums.cx
    out.yt = c * sums.sy - s * sums.cy
    out.tt = s * s * sums.cc - 2.0 * s * c * sums.cs + c * c * sums.ss


@kernel
def invert3(m: Record, out: Record) -> bool:
    """Write the inverse of a positive definite matrix to `out`, by cofactors; return False where it is singular."""
    a = m.yy * m.tt - m.yt * m.yt
    b = m.xt * m.yt - m.xy * m.tt
    d = m.xy * m.yt - m.xt * m.yy
    det = m.xx * a + m.xy * b + m.xt * d
    if not det > MIN_PIVOT * m.xx * m.yy * m.tt:
        return False
    # All are read before one is written: `out` may be `m`.
    yy = (m.xx * m.tt - m.xt * m.xt) / det
    yt = (m.xy * m.xt - m.xx * m.yt) / det
    tt = (m.xx * m.yy - m.xy * m.xy) / det
    out.xx = a / det
    out.xy = b / det
    out.xt = d / det
    out.yy = yy
    out.yt = yt
    out.tt = tt
    return True
