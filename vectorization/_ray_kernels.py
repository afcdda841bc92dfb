"""Compiled preparation of ranges: what is known of each beam, in which order, and what noise they show.

Nothing here validates: callers hand over finite arrays of the shapes that are named. Every kernel has a slow twin in
``tests/vectorization/reference.py``.
"""

import math

import numpy as np

from registration.compiling import kernel

# Share of the triples of points that are trusted to lie on straight walls, and the mean square of that lower share of a
# Gaussian's |z|. A mean, for quantised ranges make a quantile jump.
TRUSTED = 0.5
TRUSTED_MEAN_SQUARE = 0.14262

# Points in a window where noise has no direction, and the median of chi-square of its five degrees of freedom over 5.
WINDOW = 7
MEDIAN_CHI = 0.8703

LEAST_TRIPLES = 10

# Ranges are quantised when all are multiples of a step of so many of these units (m).
QUANTUM_UNIT = 1e-4
LEAST_QUANTUM = 10


@kernel
def clean(ranges, range_min, range_max):
    """Return the ranges with beams without return at inf and beams of which nothing is known at nan."""
    cleaned = ranges.copy()
    for i in range(len(ranges)):
        if ranges[i] > range_max:
            cleaned[i] = math.inf
        elif ranges[i] < range_min or ranges[i] <= 0.0:
            cleaned[i] = math.nan
    return cleaned


@kernel
def gather(cleaned, cosines, sines, backward, closed):
    """Return indices, ranges, the rays' two components and the points' of the beams that have a range.

    Counter-clockwise, so from the last if the scan went `backward`. A `closed` scan is turned so that no wall lies
    across its seam: it begins at the farthest point, which is an end of its wall, as distance from a place grows along
    a line in both directions.
    """
    n = len(cleaned)
    order = np.empty(n, dtype=np.int64)
    count = 0
    farthest = 0
    for k in range(n):
        i = n - 1 - k if backward else k
        if math.isfinite(cleaned[i]):
            order[count] = i
            if cleaned[i] > cleaned[order[farthest]]:
                farthest = count
            count += 1
    if closed:
        order = np.concatenate((order[farthest:count], order[:farthest]))
    order = order[:count]
    r = np.empty(count)
    rays = np.empty((2, count))
    points = np.empty((2, count))
    for k in range(count):
        i = order[k]
        r[k] = cleaned[i]
        rays[0, k] = cosines[i]
        rays[1, k] = sines[i]
        points[0, k] = r[k] * cosines[i]
        points[1, k] = r[k] * sines[i]
    return order, r, rays, points


@kernel
def quantum(ranges):
    """Return the step that all ranges are multiples of, metres, 0 for none or one below a millimetre."""
    step = 0
    for i in range(len(ranges)):
        units = ranges[i] / QUANTUM_UNIT
        whole = round(units)
        if abs(units - whole) > 0.1:
            return 0.0
        while whole > 0:
            step, whole = whole, step % whole
        if step < LEAST_QUANTUM:
            return 0.0
    return step * QUANTUM_UNIT


@kernel
def ray_noise(ranges, ux, uy, increment):
    """Return the standard deviation of the ranges, or 0 where there are too few neighbours to tell.

    On a wall ``1 / r = (n.u) / p`` is linear in the ray's direction, so for any three rays
    ``sin(c - b) / r_a + sin(b - a) / r_c = sin(c - a) / r_b`` whatever the wall; what is missing is noise.
    """
    n = len(ranges)
    z = np.empty(max(0, n - 2))
    count = 0
    for i in range(1, n - 1):
        before = ux[i - 1] * uy[i] - uy[i - 1] * ux[i]
        after = ux[i] * uy[i + 1] - uy[i] * ux[i + 1]
        if not (0.0 < before < 1.6 * increment and 0.0 < after < 1.6 * increment):
            continue
        both = ux[i - 1] * uy[i + 1] - uy[i - 1] * ux[i + 1]
        qa = after / ranges[i - 1]
        qb = both / ranges[i]
        qc = before / ranges[i + 1]
        va = qa / ranges[i - 1]
        vb = qb / ranges[i]
        vc = qc / ranges[i + 1]
        z[count] = abs(qa + qc - qb) / math.sqrt(va * va + vb * vb + vc * vc)
        count += 1
    if count < LEAST_TRIPLES:
        return 0.0
    k = int(TRUSTED * count)
    least = np.partition(z[:count], k)
    squares = 0.0
    for i in range(k):
        squares += least[i] * least[i]
    return math.sqrt(squares / (k * TRUSTED_MEAN_SQUARE))


@kernel
def window_noise(x, y):
    """Return the standard deviation of points normal to the walls, from small windows, or 0 where there are too few."""
    n = len(x)
    windows = n - WINDOW + 1
    if windows < LEAST_TRIPLES:
        return 0.0
    squares = np.empty(windows)
    for a in range(windows):
        mx = np.mean(x[a : a + WINDOW])
        my = np.mean(y[a : a + WINDOW])
        cxx = 0.0
        cxy = 0.0
        cyy = 0.0
        for i in range(a, a + WINDOW):
            cxx += (x[i] - mx) * (x[i] - mx)
            cxy += (x[i] - mx) * (y[i] - my)
            cyy += (y[i] - my) * (y[i] - my)
        root = math.hypot(cxx - cyy, 2.0 * cxy)
        squares[a] = max(0.0, 0.5 * (cxx + cyy - root)) / (WINDOW - 2)
    k = windows // 2
    return math.sqrt(np.partition(squares, k)[k] / MEDIAN_CHI)
