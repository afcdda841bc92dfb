"""The compiled way from ordered points to segments: pieces, lines, extension, corners.

Nothing here validates: callers hand over finite arrays of the shapes that are named. Every kernel has a slow twin in
``tests/vectorization/reference.py``.
"""

import math

import numpy as np

from registration.compiling import kernel

from ._fit_kernels import (
    BEGIN,
    CHI2,
    COUNT,
    END,
    LEAST_COSINE,
    LINE,
    LONGEST_STEP,
    MEAN,
    NX,
    NY,
    POINT_GATE,
    SPREAD,
    WEIGHT,
    P,
    bridge,
    fit_line,
    line_of,
    rejoin,
)
from ._kernels import BREAK_REACH, MISSING_STEPS, find_gaps, merge, running_sums, settle_breaks, split

# A line is kept when its angle is known to this standard deviation (rad) and its chi-square per degree of freedom is
# at most this: a heap of points is no wall.
WORST_ANGLE = 0.12
WORST_FIT = 6.0

# Standard deviations within which the last point of a line is taken for its own: what lies beside a wall begins there.
END_GATE = 2.0

# Sine of the angle between two lines below which they have no corner, and how much farther than to the next beam an
# end may be moved to reach one, past so many points at most.
LEAST_CORNER = 0.15
CORNER_REACH = 1.6
CORNER_BEAMS = 3


@kernel
def trace(x, y, ux, uy, increment, closed, sigma, floor, default_gap, max_gap, min_points, min_length):
    """Return the ``(m, LINE)`` lines and the ``(m, 2)`` first and last points of the segments, in order.

    Points come counter-clockwise about the sensor at the origin, which the unit rays start from; rays of length 0 mean
    that noise has no direction. `increment` is the angle between neighbouring rays, 0 without rays. With `closed` the
    last point's neighbour is the first.
    """
    variance = sigma * sigma
    gaps = find_gaps(x, y, ux, uy, increment, sigma, default_gap, max_gap)
    sums = running_sums(x, y, ux, uy)
    pieces = split(x, y, ux, uy, sums, gaps, variance, floor)
    pieces = merge(pieces, sums, gaps, variance, floor)
    for _ in range(3):
        if not settle_breaks(pieces, sums, gaps, variance, floor):
            break
        pieces = merge(pieces, sums, gaps, variance, floor)
    longest = min(LONGEST_STEP if increment > 0.0 else default_gap, max_gap)
    bounds, totals = bridge(pieces, sums, x, y, ux, uy, increment, longest, min_points, variance, floor)
    lines, spans = fit_all(x, y, ux, uy, bounds, totals, variance, floor, min_points, increment, longest)
    keep = 0
    for k in range(rejoin(x, y, ux, uy, lines, spans, increment, longest, variance, floor)):
        if large_enough(lines[k], min_points, min_length) and acceptable(lines[k], increment > 0.0):
            lines[keep] = lines[k]
            spans[keep] = spans[k]
            keep += 1
    lines = lines[:keep]
    spans = spans[:keep]
    cut_corners(x, y, ux, uy, lines, spans, increment, closed, variance, floor)
    # At a corner a line may have lost points, or an end.
    still = np.empty(keep, dtype=np.bool_)
    for k in range(keep):
        still[k] = large_enough(lines[k], min_points, min_length)
    return lines[still], spans[still]


@kernel
def large_enough(line, min_points, min_length):
    """Tell whether a line is one that was asked for."""
    return line[COUNT] >= min_points and line[END] - line[BEGIN] >= min_length


@kernel
def acceptable(line, rays):
    """Tell whether a line is one: its angle known, its points on it."""
    return (
        line[WEIGHT] * line[SPREAD] * WORST_ANGLE * WORST_ANGLE >= 1.0
        and line[CHI2] <= WORST_FIT * max(1.0, line[COUNT] - 2.0)
        and not (rays and line[P] <= 0.0)
    )


@kernel
def fit_all(x, y, ux, uy, bounds, totals, variance, floor, min_points, increment, longest):
    """Fit every piece of at least `min_points` and extend it over the points around that no such piece has."""
    n = len(x)
    taken = np.zeros(n, dtype=np.bool_)
    own = np.zeros(n, dtype=np.bool_)
    lines = np.empty((len(bounds), LINE))
    spans = np.empty((len(bounds), 2), dtype=np.int64)
    for k in range(len(bounds)):
        if totals[k, 0] >= min_points:
            taken[bounds[k, 0] : bounds[k, 1]] = True
    count = 0
    for k in range(len(bounds)):
        if totals[k, 0] < min_points:
            continue
        line = lines[count]
        line[NX], line[NY], line[P] = line_of(totals[k])
        line[MEAN] = (line[NX] * totals[k, 2] - line[NY] * totals[k, 1]) / totals[k, 0]
        a = bounds[k, 0]
        b = bounds[k, 1]
        if not fit_line(x, y, ux, uy, a, b, variance, floor, line, own):
            continue
        low = extend(x, y, ux, uy, a, -1, taken, line, increment, longest, variance, floor)
        high = extend(x, y, ux, uy, b - 1, 1, taken, line, increment, longest, variance, floor)
        if (low < a or high > b - 1) and not fit_line(x, y, ux, uy, low, high + 1, variance, floor, line, own):
            continue
        first = low
        last = high
        while low < high and strays(x, y, ux, uy, low, line, variance, floor):
            low += 1
        while high > low and strays(x, y, ux, uy, high, line, variance, floor):
            high -= 1
        if (low > first or high < last) and not fit_line(x, y, ux, uy, low, high + 1, variance, floor, line, own):
            continue
        taken[low : high + 1] = True
        spans[count, 0] = low
        spans[count, 1] = high
        count += 1
    return lines[:count].copy(), spans[:count].copy()


@kernel
def strays(x, y, ux, uy, i, line, variance, floor):
    """Tell whether point i, the last of its line, is better taken for one of what lies beside the wall."""
    e = line[NX] * x[i] + line[NY] * y[i] - line[P]
    cosine = 1.0
    if ux[i] != 0.0 or uy[i] != 0.0:
        cosine = line[NX] * ux[i] + line[NY] * uy[i]
    return e * e > END_GATE * END_GATE * (variance * cosine * cosine + floor)


@kernel
def extend(x, y, ux, uy, start, direction, taken, line, increment, longest, variance, floor):
    """Return the last point, from `start` on in `direction`, that still lies on the line; one misfit may intervene."""
    last = start
    misfits = 0
    i = start + direction
    while 0 <= i < len(x) and not taken[i] and misfits <= 1:
        e = line[NX] * x[i] + line[NY] * y[i] - line[P]
        t = line[NX] * y[i] - line[NY] * x[i]
        cosine = 1.0
        if increment > 0.0:
            cosine = line[NX] * ux[i] + line[NY] * uy[i]
            turn = math.atan2(abs(ux[last] * uy[i] - uy[last] * ux[i]), ux[last] * ux[i] + uy[last] * uy[i])
            if turn > MISSING_STEPS * increment:
                break
        if math.hypot(x[i] - x[last], y[i] - y[last]) > longest:
            break
        lever = t - line[MEAN]
        known = (1.0 + lever * lever / line[SPREAD]) / line[WEIGHT]
        v = variance * cosine * cosine + floor + known
        if e * e <= POINT_GATE * POINT_GATE * v and cosine > LEAST_COSINE and known < 4.0 * (variance + floor):
            last = i
            misfits = 0
        else:
            misfits += 1
        i += direction
    return last


@kernel
def cut_corners(x, y, ux, uy, lines, spans, increment, closed, variance, floor):
    """Move the ends of neighbouring lines to their intersection where it lies between their nearest points' rays.

    The points next to it go to the line on their side of the corner, and both are fitted anew.
    """
    m = len(lines)
    for k in range(m - 1):
        for _ in range(2):
            found, cx, cy = corner(x, y, ux, uy, lines, spans, k, k + 1, increment, variance)
            if not found or not share(x, y, ux, uy, lines, spans, k, cx, cy, variance, floor):
                break
    if closed and m > 1:
        found, cx, cy = corner(x, y, ux, uy, lines, spans, m - 1, 0, increment, variance)
        if found:
            leave_seam(x, y, ux, uy, lines, spans, cx, cy, variance, floor)
    for k in range(m if closed and m > 1 else m - 1):
        one = lines[k]
        other = lines[(k + 1) % m]
        found, cx, cy = corner(x, y, ux, uy, lines, spans, k, (k + 1) % m, increment, variance)
        if found:
            nearer_end(one, one[NX] * cy - one[NY] * cx)
            nearer_end(other, other[NX] * cy - other[NY] * cx)


@kernel
def corner(x, y, ux, uy, lines, spans, k, following, increment, variance):
    """Return whether lines k and `following` meet between their nearest points, and where."""
    one = lines[k]
    other = lines[following]
    i = spans[k, 1]
    j = spans[following, 0]
    beams = (j - i) % len(x)
    sine = one[NX] * other[NY] - one[NY] * other[NX]
    if beams > CORNER_BEAMS or abs(sine) < LEAST_CORNER:
        return False, 0.0, 0.0
    cx = (one[P] * other[NY] - other[P] * one[NY]) / sine
    cy = (other[P] * one[NX] - one[P] * other[NX]) / sine
    here = abs(one[NX] * cy - one[NY] * cx - last_abscissa(one, i, x, y))
    there = abs(other[NX] * cy - other[NY] * cx - last_abscissa(other, j, x, y))
    # Points of one wall within the gate of the other lie that far beyond the corner.
    slack = POINT_GATE * math.sqrt(variance) / abs(sine)
    near = here <= beams * corner_reach(one, i, x, y, ux, uy, increment) + slack
    near = near and there <= beams * corner_reach(other, j, x, y, ux, uy, increment) + slack
    return near, cx, cy


@kernel
def share(x, y, ux, uy, lines, spans, k, cx, cy, variance, floor):
    """Give the points about a corner of lines k and k + 1 to their own side's line; return whether any changed."""
    a = spans[k, 0]
    b = spans[k + 1, 1]
    last = spans[k, 1]
    while last + 1 < b - 2 and last < spans[k, 1] + BREAK_REACH and before(x, y, ux, uy, lines, k, cx, cy, last + 1):
        last += 1
    while last > a + 2 and last > spans[k, 1] - BREAK_REACH and not before(x, y, ux, uy, lines, k, cx, cy, last):
        last -= 1
    if last == spans[k, 1] and last + 1 == spans[k + 1, 0]:
        return False
    own = np.empty(len(x), dtype=np.bool_)
    one = lines[k].copy()
    other = lines[k + 1].copy()
    fitted = fit_line(x, y, ux, uy, a, last + 1, variance, floor, one, own)
    if not fitted or not fit_line(x, y, ux, uy, last + 1, b + 1, variance, floor, other, own):
        return False
    if one[COUNT] < 3.0 or other[COUNT] < 3.0:
        return False
    lines[k] = one
    lines[k + 1] = other
    spans[k, 1] = last
    spans[k + 1, 0] = last + 1
    return True


@kernel
def leave_seam(x, y, ux, uy, lines, spans, cx, cy, variance, floor):
    """Take from the first and the last line of a closed scan the points beyond their corner, and fit what is left."""
    own = np.empty(len(x), dtype=np.bool_)
    last = len(lines) - 1
    a = spans[0, 0]
    b = spans[last, 1]
    while a < spans[0, 1] - 2 and a < spans[0, 0] + BREAK_REACH and before(x, y, ux, uy, lines, last, cx, cy, a):
        a += 1
    while (
        b > spans[last, 0] + 2 and b > spans[last, 1] - BREAK_REACH and not before(x, y, ux, uy, lines, last, cx, cy, b)
    ):
        b -= 1
    if a > spans[0, 0]:
        spans[0, 0] = a
        fit_line(x, y, ux, uy, a, spans[0, 1] + 1, variance, floor, lines[0], own)
    if b < spans[last, 1]:
        spans[last, 1] = b
        fit_line(x, y, ux, uy, spans[last, 0], b + 1, variance, floor, lines[last], own)


@kernel
def before(x, y, ux, uy, lines, k, cx, cy, i):
    """Tell whether point i is on line k's side of its corner with the next: by its ray, or by the nearer line."""
    if ux[i] != 0.0 or uy[i] != 0.0:
        return ux[i] * cy - uy[i] * cx >= 0.0
    here = abs(lines[k, NX] * x[i] + lines[k, NY] * y[i] - lines[k, P])
    return here <= abs(lines[k + 1, NX] * x[i] + lines[k + 1, NY] * y[i] - lines[k + 1, P])


@kernel
def last_abscissa(line, i, x, y):
    """Return the end of the line that point i is nearest to."""
    t = line[NX] * y[i] - line[NY] * x[i]
    return line[BEGIN] if abs(t - line[BEGIN]) < abs(t - line[END]) else line[END]


@kernel
def nearer_end(line, t):
    """Move the nearer of the line's ends to the abscissa t."""
    if abs(t - line[BEGIN]) < abs(t - line[END]):
        line[BEGIN] = t
    else:
        line[END] = t


@kernel
def corner_reach(line, i, x, y, ux, uy, increment):
    """Return how far the end at point i may be moved: about as far as to the next ray, or a point's spacing."""
    if increment <= 0.0:
        return CORNER_REACH * (line[END] - line[BEGIN]) / (line[COUNT] - 1.0)
    cosine = max(LEAST_COSINE, line[NX] * ux[i] + line[NY] * uy[i])
    return CORNER_REACH * increment * math.hypot(x[i], y[i]) / cosine
