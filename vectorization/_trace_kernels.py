# mypy: disable-error-code="no-untyped-def"
"""The compiled way from ordered points to segments: pieces, lines, extension, corners.

Nothing here validates: callers hand over finite arrays of the shapes that are named. Every kernel has a slow twin in
``tests/vectorization/reference.py``.
"""

import math

import numpy as np
from numba import njit

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
)
from ._kernels import MISSING_STEPS, find_gaps, merge, running_sums, settle_breaks, split

# A line is kept when its angle is known to this standard deviation (rad) and its chi-square per degree of freedom is
# at most this: a heap of points is no wall.
WORST_ANGLE = 0.12
WORST_FIT = 6.0

# Sine of the angle between two lines below which they have no corner, and how much farther than to the next beam an
# end may be moved to reach one.
LEAST_CORNER = 0.15
CORNER_REACH = 1.6


@njit(cache=True, nogil=True)
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
    for k in range(len(lines)):
        if acceptable(lines[k], increment > 0.0, min_points, min_length):
            lines[keep] = lines[k]
            spans[keep] = spans[k]
            keep += 1
    lines = lines[:keep]
    spans = spans[:keep]
    cut_corners(x, y, ux, uy, lines, spans, increment, closed, sigma)
    return lines, spans


@njit(cache=True, nogil=True)
def acceptable(line, rays, min_points, min_length):
    """Tell whether a line is one: enough points, long enough, its angle known, its points on it."""
    count = line[COUNT]
    return (
        count >= min_points
        and line[END] - line[BEGIN] >= min_length
        and line[WEIGHT] * line[SPREAD] * WORST_ANGLE * WORST_ANGLE >= 1.0
        and line[CHI2] <= WORST_FIT * max(1.0, count - 2.0)
        and not (rays and line[P] <= 0.0)
    )


@njit(cache=True, nogil=True)
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
        while low < high and not own[low]:
            low += 1
        while high > low and not own[high]:
            high -= 1
        taken[low : high + 1] = True
        spans[count, 0] = low
        spans[count, 1] = high
        count += 1
    return lines[:count].copy(), spans[:count].copy()


@njit(cache=True, nogil=True)
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


@njit(cache=True, nogil=True)
def cut_corners(x, y, ux, uy, lines, spans, increment, closed, sigma):
    """Move the ends of neighbouring lines to their intersection where it lies between their nearest points' rays."""
    m = len(lines)
    n = len(x)
    for k in range(m if closed and m > 1 else m - 1):
        one = lines[k]
        other = lines[(k + 1) % m]
        i = spans[k, 1]
        j = spans[(k + 1) % m, 0]
        if (j - i) % n > 3:
            continue
        sine = one[NX] * other[NY] - one[NY] * other[NX]
        if abs(sine) < LEAST_CORNER:
            continue
        cx = (one[P] * other[NY] - other[P] * one[NY]) / sine
        cy = (other[P] * one[NX] - one[P] * other[NX]) / sine
        here = one[NX] * cy - one[NY] * cx
        there = other[NX] * cy - other[NY] * cx
        # Points of one wall within the gate of the other lie that far beyond the corner.
        slack = POINT_GATE * sigma / abs(sine)
        beams = (j - i) % n
        if abs(here - last_abscissa(one, i, x, y)) > beams * corner_reach(one, i, x, y, ux, uy, increment) + slack:
            continue
        if abs(there - last_abscissa(other, j, x, y)) > beams * corner_reach(other, j, x, y, ux, uy, increment) + slack:
            continue
        nearer_end(one, here)
        nearer_end(other, there)


@njit(cache=True, nogil=True)
def last_abscissa(line, i, x, y):
    """Return the end of the line that point i is nearest to."""
    t = line[NX] * y[i] - line[NY] * x[i]
    return line[BEGIN] if abs(t - line[BEGIN]) < abs(t - line[END]) else line[END]


@njit(cache=True, nogil=True)
def nearer_end(line, t):
    """Move the nearer of the line's ends to the abscissa t."""
    if abs(t - line[BEGIN]) < abs(t - line[END]):
        line[BEGIN] = t
    else:
        line[END] = t


@njit(cache=True, nogil=True)
def corner_reach(line, i, x, y, ux, uy, increment):
    """Return how far the end at point i may be moved: about as far as to the next ray, or a point's spacing."""
    if increment <= 0.0:
        return CORNER_REACH * (line[END] - line[BEGIN]) / (line[COUNT] - 1.0)
    cosine = max(LEAST_COSINE, line[NX] * ux[i] + line[NY] * uy[i])
    return CORNER_REACH * increment * math.hypot(x[i], y[i]) / cosine
