"""Compiled final fit of segments: maximum likelihood lines, their extension past gaps, and their ends.

Nothing here validates: callers hand over finite arrays of the shapes that are named. Every kernel has a slow twin in
``tests/vectorization/reference.py``.

A line is a row of `LINE` doubles: outward unit normal (away from the sensor), its distance, the weighted mean and
second moment of the points' abscissae along the line (counted along ``(-n_y, n_x)`` from the foot of the normal), the
points' total weight, their number, their chi-square, and the abscissae of the two ends.
"""

import math

import numpy as np

from registration.compiling import kernel

from ._kernels import BREAK_PENALTY, SUMS, sums_cost

LINE = 10
NX, NY, P, MEAN, SPREAD, WEIGHT, COUNT, CHI2, BEGIN, END = range(LINE)

# Standard deviations within which a point is taken for the line's own.
POINT_GATE = 3.5

# Square of a step, in standard deviations, after which the next would be lost in rounding.
SETTLED = 1e-8

# Standard deviations of chi-square by which it may exceed its mean before the noise is taken for larger than given.
WIDENING = 3.0

# Cosine of incidence below which a ray says too little of where it meets the line.
LEAST_COSINE = 0.03

# Points and steps between rays that may lie between two pieces of one line, and metres that it may be extended over.
SKIPPED = 4
SKIPPED_STEPS = 6.5
LONGEST_STEP = 1.5

# Root mean square distance (m) between one line and two below which the break is no feature: plaster, and a range
# finder's bias that changes with range and incidence, bend straight walls by as much.
FLATNESS = 5e-3

# Sine of the angle between two lines above which they are not tried for being one.
NEAR_PARALLEL = 0.2


@kernel
def bridge(pieces, sums, x, y, ux, uy, increment, longest, min_points, variance, floor):
    """Join pieces of one line with a few points in front of it between them.

    Pieces of fewer than three points are left out. Returns ``(m, 2)`` first and one-past-last points and the
    ``(m, SUMS)`` sums of the points that are the pieces' own.
    """
    bounds = np.empty_like(pieces)
    totals = np.empty((len(pieces), SUMS))
    own = np.empty(SUMS)
    joint = np.empty(SUMS)
    count = 0
    for k in range(len(pieces)):
        a = pieces[k, 0]
        b = pieces[k, 1]
        if b - a < 3:
            continue
        own[:] = sums[b] - sums[a]
        if count > 0 and a - bounds[count - 1, 1] <= SKIPPED and max(b - a, totals[count - 1, 0]) >= min_points:
            z = bounds[count - 1, 1] - 1
            joint[:] = totals[count - 1] + own
            growth = math.inf
            if adjoin(x, y, ux, uy, z, a, increment, longest):
                apart = sums_cost(totals[count - 1], variance, floor) + sums_cost(own, variance, floor)
                growth = sums_cost(joint, variance, floor) - apart
            nx, ny, p = line_of(joint)
            if growth < BREAK_PENALTY and not seen_through(nx, ny, p, z + 1, a, x, y, ux, uy, variance, floor):
                bounds[count - 1, 1] = b
                totals[count - 1] = joint
                continue
        bounds[count, 0] = a
        bounds[count, 1] = b
        totals[count] = own
        count += 1
    return bounds[:count].copy(), totals[:count].copy()


@kernel
def adjoin(x, y, ux, uy, z, a, increment, longest):
    """Tell whether one wall may reach from point z to point a."""
    turn = math.atan2(abs(ux[z] * uy[a] - uy[z] * ux[a]), ux[z] * ux[a] + uy[z] * uy[a])
    near = math.hypot(x[a] - x[z], y[a] - y[z]) <= longest
    return near and a - z - 1 <= SKIPPED and turn <= SKIPPED_STEPS * increment + 1e-9


@kernel
def rejoin(x, y, ux, uy, lines, spans, increment, longest, variance, floor):
    """Make one of neighbouring lines, in place, that their points do not tell apart by their full likelihood.

    The running sums take the noise for the same all along a piece and sometimes break a wall for it. Returns how many
    lines are left.
    """
    own = np.empty(len(x), dtype=np.bool_)
    joint = np.empty(LINE)
    count = 0
    for k in range(len(lines)):
        lines[count] = lines[k]
        spans[count] = spans[k]
        count += 1
        if count < 2:
            continue
        one = lines[count - 2]
        other = lines[count - 1]
        sine = one[NX] * other[NY] - one[NY] * other[NX]
        cosine = one[NX] * other[NX] + one[NY] * other[NY]
        z = spans[count - 2, 1]
        a = spans[count - 1, 0]
        if abs(sine) > NEAR_PARALLEL or cosine < 0.0 or not adjoin(x, y, ux, uy, z, a, increment, longest):
            continue
        joint[:] = one if one[WEIGHT] * one[SPREAD] > other[WEIGHT] * other[SPREAD] else other
        first = spans[count - 2, 0]
        last = spans[count - 1, 1]
        for _ in range(3):
            # Started from one part's line, whose gate may miss the other's far points at first.
            fit_line(x, y, ux, uy, first, last + 1, variance, floor, joint, own)
        if seen_through(joint[NX], joint[NY], joint[P], z + 1, a, x, y, ux, uy, variance, floor):
            continue
        everyone = joint[COUNT] >= one[COUNT] + other[COUNT] - 1.0
        excess = joint[CHI2] - one[CHI2] - other[CHI2]
        if everyone and (excess < BREAK_PENALTY or excess < FLATNESS * FLATNESS * joint[WEIGHT]):
            lines[count - 2] = joint
            spans[count - 2, 1] = last
            count -= 1
    return count


@kernel
def seen_through(nx, ny, p, a, b, x, y, ux, uy, variance, floor):
    """Tell whether a point from a to b - 1 lies behind the line, as seen from the sensor."""
    for i in range(a, b):
        cosine = nx * ux[i] + ny * uy[i]
        off = nx * x[i] + ny * y[i] - p
        if off * cosine > 0.0 and off * off > POINT_GATE * POINT_GATE * (variance * cosine * cosine + floor):
            return True
    return False


@kernel
def line_of(total):
    """Return unit normal and distance (not negative) of the total least squares line of sums."""
    n = total[0]
    mx = total[1] / n
    my = total[2] / n
    cxx = total[3] - n * mx * mx
    cxy = total[4] - n * mx * my
    cyy = total[5] - n * my * my
    angle = 0.5 * math.atan2(2.0 * cxy, cxx - cyy)
    nx = -math.sin(angle)
    ny = math.cos(angle)
    p = nx * mx + ny * my
    if p < 0.0:
        return -nx, -ny, -p
    return nx, ny, p


@kernel
def fit_line(x, y, ux, uy, a, b, variance, floor, line, own):
    """Move `line` to the maximum likelihood one of the points a to b - 1 that lie within the gate.

    Range noise acts along the ray: with the wall at distance p, minimise ``sum (r - p / (n.u))^2 / v`` by Gauss-Newton,
    whose abscissae are where the rays meet the line. Points without ray count with their distance from the line.
    Marks the points used in `own`; returns whether there are any two apart.
    """
    scale = 2.0
    for turn in range(5):
        gate = POINT_GATE * POINT_GATE * scale
        count, w, t_mean, e_mean, tt, te, chi2 = weigh(x, y, ux, uy, a, b, variance, floor, line, own, gate)
        if count < 2 or not tt > 0.0:
            return False
        line[MEAN] += t_mean
        line[SPREAD] = tt / w
        line[WEIGHT] = w
        line[COUNT] = count
        line[CHI2] = chi2
        if turn == 0:
            scale = max(1.0, chi2 / max(1, count - 2))
        slope = te / tt
        offset = line[P] + e_mean
        # Turn about the mean: the normal by -slope, the mean point moves along the normal alone.
        c = 1.0 / math.sqrt(1.0 + slope * slope)
        s = slope * c
        nx = c * line[NX] + s * line[NY]
        ny = c * line[NY] - s * line[NX]
        p = c * offset - s * line[MEAN]
        line[MEAN] = c * line[MEAN] + s * offset
        line[NX] = nx
        line[NY] = ny
        line[P] = p
        if turn > 1 and slope * slope * tt + e_mean * e_mean * w < SETTLED:
            break
    return True


@kernel
def weigh(x, y, ux, uy, a, b, variance, floor, line, own, gate):
    """Sum up the points a to b - 1 whose squared distance from the line is within `gate` variances; set its ends.

    Returns their number, weight, the means of abscissa (from the line's mean) and distance, the weighted squares and
    products about these means, and the chi-square.
    """
    w_sum = 0.0
    t_sum = 0.0
    e_sum = 0.0
    tt = 0.0
    te = 0.0
    ee = 0.0
    count = 0
    line[BEGIN] = math.inf
    line[END] = -math.inf
    for i in range(a, b):
        e = line[NX] * x[i] + line[NY] * y[i] - line[P]
        t = line[NX] * y[i] - line[NY] * x[i]
        cosine = 1.0
        if ux[i] != 0.0 or uy[i] != 0.0:
            cosine = line[NX] * ux[i] + line[NY] * uy[i]
            if cosine > LEAST_COSINE:
                t = line[P] * (line[NX] * uy[i] - line[NY] * ux[i]) / cosine
        v = variance * cosine * cosine + floor
        own[i] = e * e <= gate * v
        if own[i]:
            line[BEGIN] = min(line[BEGIN], t)
            line[END] = max(line[END], t)
            w = 1.0 / v
            t -= line[MEAN]
            w_sum += w
            t_sum += w * t
            e_sum += w * e
            tt += w * t * t
            te += w * t * e
            ee += w * e * e
            count += 1
    if count == 0:
        return 0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    t_mean = t_sum / w_sum
    e_mean = e_sum / w_sum
    return count, w_sum, t_mean, e_mean, tt - t_sum * t_mean, te - t_sum * e_mean, ee


@kernel
def describe(lines, x, y):
    """Return what is told of each line, moved to the place (x, y) of the sensor: endpoints, sigma, centroid and rms.

    Sigma is such that count / sigma^2 is the weight, and widened where the points lie worse than chance lets them.
    """
    m = len(lines)
    endpoints = np.empty((m, 4))
    sigmas = np.empty(m)
    centroids = np.empty((m, 2))
    rms = np.empty(m)
    for k in range(m):
        line = lines[k]
        footx = x + line[P] * line[NX]
        footy = y + line[P] * line[NY]
        endpoints[k, 0] = footx - line[BEGIN] * line[NY]
        endpoints[k, 1] = footy + line[BEGIN] * line[NX]
        endpoints[k, 2] = footx - line[END] * line[NY]
        endpoints[k, 3] = footy + line[END] * line[NX]
        centroids[k, 0] = footx - line[MEAN] * line[NY]
        centroids[k, 1] = footy + line[MEAN] * line[NX]
        dof = max(1.0, line[COUNT] - 2.0)
        sigmas[k] = math.sqrt(line[COUNT] / line[WEIGHT])
        if line[CHI2] > dof + WIDENING * math.sqrt(2.0 * dof):
            sigmas[k] *= math.sqrt(line[CHI2] / dof)
        rms[k] = math.sqrt(line[CHI2] / line[WEIGHT])
    return endpoints, sigmas, centroids, rms
