"""Compiled segmentation of ordered points: gaps, splits, merges and breaks moved to their best place.

Nothing here validates: callers hand over finite arrays of the shapes that are named. Every kernel has a slow twin in
``tests/vectorization/reference.py``.

The sums of consecutive points are kept as running totals, rows of `SUMS` doubles: count, x, y, xx, xy, yy, and the
three of the rays' directions, ``u_x u_x``, ``u_x u_y``, ``u_y u_y``. The difference of two rows is the sums of the
points between, so a line is fitted to any stretch in constant time. Where noise is the same in all directions the
rays' sums are those of the unit matrix, and the projection below is 1 for every point.
"""

import math

import numpy as np

from registration.compiling import kernel

SUMS = 9

# The farthest point's distance from the chord, in standard deviations, from which on a stretch is split there.
CHORD_GATE = 3.5

# What a further break must take off the chi-square: two parameters of a line and the choice of the break's place.
BREAK_PENALTY = 20.0

# How far, in points, a break is moved at most, and at how many places a break in an even stretch is tried.
BREAK_REACH = 8
BREAK_TRIALS = 24

# Angle between ray and wall below which consecutive points need not be taken for neighbours, and beams that may miss.
GRAZING = math.radians(10.0)
MISSING_STEPS = 4.5


@kernel
def running_sums(x, y, ux, uy):
    """Return the ``(n + 1, SUMS)`` running totals of the points."""
    n = len(x)
    sums = np.zeros((n + 1, SUMS))
    for i in range(n):
        isotropic = ux[i] == 0.0 and uy[i] == 0.0
        sums[i + 1, 0] = sums[i, 0] + 1.0
        sums[i + 1, 1] = sums[i, 1] + x[i]
        sums[i + 1, 2] = sums[i, 2] + y[i]
        sums[i + 1, 3] = sums[i, 3] + x[i] * x[i]
        sums[i + 1, 4] = sums[i, 4] + x[i] * y[i]
        sums[i + 1, 5] = sums[i, 5] + y[i] * y[i]
        sums[i + 1, 6] = sums[i, 6] + (1.0 if isotropic else ux[i] * ux[i])
        sums[i + 1, 7] = sums[i, 7] + ux[i] * uy[i]
        sums[i + 1, 8] = sums[i, 8] + (1.0 if isotropic else uy[i] * uy[i])
    return sums


@kernel
def sums_cost(total, variance, floor):
    """Return the chi-square of the total least squares line of sums.

    The noise normal to the line is ``variance (n.u)^2 + floor`` per point, averaged over the points.
    """
    return chi_square(
        total[0], total[1], total[2], total[3], total[4], total[5], total[6], total[7], total[8], variance, floor
    )


@kernel
def stretch_cost(sums, a, b, variance, floor):
    """Return the `sums_cost` of points a to b - 1, in constant time."""
    return chi_square(
        sums[b, 0] - sums[a, 0],
        sums[b, 1] - sums[a, 1],
        sums[b, 2] - sums[a, 2],
        sums[b, 3] - sums[a, 3],
        sums[b, 4] - sums[a, 4],
        sums[b, 5] - sums[a, 5],
        sums[b, 6] - sums[a, 6],
        sums[b, 7] - sums[a, 7],
        sums[b, 8] - sums[a, 8],
        variance,
        floor,
    )


@kernel
def chi_square(n, sx, sy, sxx, sxy, syy, uxx, uxy, uyy, variance, floor):
    """Return the `sums_cost` of single numbers."""
    if n < 3.0:
        return 0.0
    difference = sxx - syy - (sx * sx - sy * sy) / n
    cross = 2.0 * (sxy - sx * sy / n)
    root = math.sqrt(difference * difference + cross * cross)
    squares = max(0.0, 0.5 * (sxx + syy - (sx * sx + sy * sy) / n - root))
    projected = uxx + uyy
    if root > 0.0:
        # (n.u)^2 summed, from the doubled angle of the line's direction.
        projected -= (difference * (uxx - uyy) + 2.0 * cross * uxy) / root
    return n * squares / (0.5 * variance * max(projected, 0.0) + n * floor)


@kernel
def find_gaps(x, y, ux, uy, increment, sigma, default_gap, max_gap):
    """Return the first point of every stretch without a gap.

    Neighbouring rays, `increment` apart, may be as far from each other on a wall as where it is seen under `GRAZING`;
    an increment of 0 means points without rays, where `default_gap` decides. No gap is above `max_gap`.
    """
    n = len(x)
    starts = np.empty(n, dtype=np.int64)
    farthest = math.sin(min(0.5 * math.pi, MISSING_STEPS * increment))
    count = 0
    for i in range(n):
        gap = i == 0
        if not gap:
            dx = x[i] - x[i - 1]
            dy = y[i] - y[i - 1]
            limit = default_gap
            if increment > 0.0:
                sine = abs(ux[i - 1] * uy[i] - uy[i - 1] * ux[i])
                cosine = ux[i - 1] * ux[i] + uy[i - 1] * uy[i]
                if cosine <= 0.0 or sine > farthest:
                    limit = 0.0
                else:
                    r0 = ux[i - 1] * x[i - 1] + uy[i - 1] * y[i - 1]
                    r1 = ux[i] * x[i] + uy[i] * y[i]
                    # The wall's angle with the second ray, if it makes GRAZING with the first.
                    grazing = math.sin(GRAZING) * cosine - math.cos(GRAZING) * sine
                    limit = min(r0, r1) * sine / max(grazing, math.sin(0.5 * GRAZING)) + 4.0 * sigma
            limit = min(limit, max_gap)
            gap = dx * dx + dy * dy > limit * limit
        if gap:
            starts[count] = i
            count += 1
    return starts[:count]


@kernel
def farthest_point(x, y, ux, uy, a, b, variance, floor):
    """Return the point between a and b - 1 farthest from their chord in standard deviations, and their square."""
    dx = x[b - 1] - x[a]
    dy = y[b - 1] - y[a]
    length = math.sqrt(dx * dx + dy * dy)
    best = a
    worst = 0.0
    least = 1.0
    if length <= 0.0:
        return best, worst
    nx = -dy / length
    ny = dx / length
    for i in range(a + 1, b - 1):
        off = nx * (x[i] - x[a]) + ny * (y[i] - y[a])
        cosine = nx * ux[i] + ny * uy[i]
        if ux[i] == 0.0 and uy[i] == 0.0:
            cosine = 1.0
        v = variance * cosine * cosine + floor
        # off^2 / v above worst / least, without the division.
        if off * off * least > worst * v:
            worst = off * off
            least = v
            best = i
    return best, worst / least


@kernel
def best_break(sums, a, b, low, high, stride, variance, floor):
    """Return the break k in low..high that fits lines through a..k-1 and k..b-1 best, and their chi-square."""
    best = -1
    least = math.inf
    for k in range(low, high + 1, stride):
        cost = stretch_cost(sums, a, k, variance, floor) + stretch_cost(sums, k, b, variance, floor)
        if cost < least:
            least = cost
            best = k
    return best, least


@kernel
def split(x, y, ux, uy, sums, starts, variance, floor):
    """Split every stretch until each piece is straight; return the ``(m, 2)`` first and one-past-last points."""
    n = len(x)
    pieces = np.empty((n, 2), dtype=np.int64)
    stack = np.empty((2 * n + 2, 2), dtype=np.int64)
    count = 0
    for s in range(len(starts)):
        stack[0, 0] = starts[s]
        stack[0, 1] = starts[s + 1] if s + 1 < len(starts) else n
        top = 1
        while top > 0:
            top -= 1
            a = stack[top, 0]
            b = stack[top, 1]
            k = -1
            if b - a > 2:
                far, square = farthest_point(x, y, ux, uy, a, b, variance, floor)
                if square > CHORD_GATE * CHORD_GATE:
                    k = far
                elif b - a >= 8:
                    stride = max(1, (b - a) // BREAK_TRIALS)
                    place, cost = best_break(sums, a, b, a + 3, b - 3, stride, variance, floor)
                    if stretch_cost(sums, a, b, variance, floor) - cost > BREAK_PENALTY:
                        k = place
            if k < 0:
                pieces[count, 0] = a
                pieces[count, 1] = b
                count += 1
            else:
                # The left one on top, so that pieces come out in order.
                stack[top, 0] = k
                stack[top, 1] = b
                stack[top + 1, 0] = a
                stack[top + 1, 1] = k
                top += 2
    return pieces[:count]


@kernel
def merge(pieces, sums, gaps, variance, floor):
    """Join adjoining pieces, the cheapest joint first, as long as it costs less than `BREAK_PENALTY`.

    Pieces come in order, and those of one stretch without a gap adjoin: `gaps` are the first points of the stretches.
    Returns the pieces that are left.
    """
    left = np.empty_like(pieces)
    count = 0
    joint = np.empty(len(pieces))
    a = 0
    for g in range(len(gaps)):
        end = gaps[g + 1] if g + 1 < len(gaps) else len(sums) - 1
        first = count
        while a < len(pieces) and pieces[a, 0] < end:
            left[count] = pieces[a]
            count += 1
            a += 1
        for k in range(first, count - 1):
            joint[k] = joint_cost(left, k, sums, variance, floor)
        while count - first > 1:
            k = first
            for j in range(first + 1, count - 1):
                if joint[j] < joint[k]:
                    k = j
            if joint[k] >= BREAK_PENALTY:
                break
            left[k, 1] = left[k + 1, 1]
            count -= 1
            for j in range(k + 1, count):
                left[j] = left[j + 1]
                joint[j] = joint[j + 1]
            if k < count - 1:
                joint[k] = joint_cost(left, k, sums, variance, floor)
            if k > first:
                joint[k - 1] = joint_cost(left, k - 1, sums, variance, floor)
    return left[:count].copy()


@kernel
def joint_cost(pieces, k, sums, variance, floor):
    """Return what the chi-square grows by when pieces k and k + 1 share one line."""
    a = pieces[k, 0]
    b = pieces[k, 1]
    c = pieces[k + 1, 1]
    apart = stretch_cost(sums, a, b, variance, floor) + stretch_cost(sums, b, c, variance, floor)
    return stretch_cost(sums, a, c, variance, floor) - apart


@kernel
def settle_breaks(pieces, sums, gaps, variance, floor):
    """Move every break between adjoining pieces, in place, to where they fit best; return whether any moved."""
    moved = False
    g = 0
    for k in range(len(pieces) - 1):
        a = pieces[k, 0]
        b = pieces[k, 1]
        c = pieces[k + 1, 1]
        while g < len(gaps) and gaps[g] < b:
            g += 1
        if (g < len(gaps) and gaps[g] == b) or b - a < 2 or c - b < 2:
            continue
        low = max(a + 2, b - BREAK_REACH)
        high = min(c - 2, b + BREAK_REACH)
        place, _ = best_break(sums, a, c, low, high, 1, variance, floor)
        if place >= 0 and place != b:
            pieces[k, 1] = place
            pieces[k + 1, 0] = place
            moved = True
    return moved
