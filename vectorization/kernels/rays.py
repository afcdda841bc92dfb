"""Preparation of ranges: what is known of each beam, in which order, and what noise they show."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from compiled import kernel
from registration.layout import Floats, Records, X, Y

from ..layout import POINT
from ..tuning import (
    LEAST_QUANTUM,
    LEAST_TRIPLES,
    MEDIAN_CHI,
    QUANTUM_SLACK,
    QUANTUM_UNIT,
    TRIPLE_STEPS,
    TRUSTED,
    TRUSTED_MEAN_SQUARE,
    WINDOW,
)
from .ordering import select


@kernel
def clean(ranges: Floats, range_min: float, range_max: float) -> Floats:
    """Return the ranges with beams without return at inf and beams of which nothing is known at nan."""
    cleaned = ranges.copy()
    for i in range(len(ranges)):
        if ranges[i] > range_max:
            cleaned[i] = math.inf
        elif ranges[i] < range_min or ranges[i] <= 0.0:
            cleaned[i] = math.nan
    return cleaned


@kernel
def gather(
    cleaned: Floats, cosines: Floats, sines: Floats, backward: bool, closed: bool
) -> tuple[NDArray[np.int64], Records]:
    """Return indices and points of the beams that have a range.

    Counter-clockwise, so from the last if the scan went `backward`. A `closed` scan is turned so that no wall lies
    across its seam: it begins at the farthest point, which is an end of its wall, as distance from a place grows along
    a line in both directions.
    """
    n = len(cleaned)
    order = np.empty(n, np.int64)
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
    points = np.empty(count, POINT)
    for k in range(count):
        i = order[k]
        point = points[k]
        point.range = cleaned[i]
        point.ray_x = cosines[i]
        point.ray_y = sines[i]
        point.x = cleaned[i] * cosines[i]
        point.y = cleaned[i] * sines[i]
    return order, points


@kernel
def place(places: Floats, ranges: Floats) -> Records:
    """Return the points at `places` (n, 2) about the sensor; one whose range is 0 has no ray."""
    points = np.zeros(len(places), POINT)
    for i in range(len(places)):
        point = points[i]
        point.x = places[i, X]
        point.y = places[i, Y]
        if ranges[i] > 0.0:
            point.ray_x = places[i, X] / ranges[i]
            point.ray_y = places[i, Y] / ranges[i]
            point.range = ranges[i]
    return points


@kernel
def quantum(points: Records) -> float:
    """Return the step that all ranges are multiples of, metres, 0 for none or one below a millimetre."""
    step = 0
    for i in range(len(points)):
        units = points[i].range / QUANTUM_UNIT
        whole = round(units)
        if abs(units - whole) > QUANTUM_SLACK:
            return 0.0
        while whole > 0:
            step, whole = whole, step % whole
        if step < LEAST_QUANTUM:
            return 0.0
    return step * QUANTUM_UNIT


@kernel
def ray_noise(points: Records, increment: float) -> float:
    """Return the standard deviation of the ranges, or 0 where there are too few neighbours to tell.

    On a wall ``1 / r = (n.u) / p`` is linear in the ray's direction, so for any three rays
    ``sin(c - b) / r_a + sin(b - a) / r_c = sin(c - a) / r_b`` whatever the wall; what is missing is noise.
    """
    n = len(points)
    z = np.empty(max(0, n - 2), np.float64)
    widest = TRIPLE_STEPS * increment
    count = 0
    for i in range(1, n - 1):
        a = points[i - 1]
        b = points[i]
        c = points[i + 1]
        before = a.ray_x * b.ray_y - a.ray_y * b.ray_x
        after = b.ray_x * c.ray_y - b.ray_y * c.ray_x
        if not (0.0 < before < widest and 0.0 < after < widest):
            continue
        both = a.ray_x * c.ray_y - a.ray_y * c.ray_x
        qa = after / a.range
        qb = both / b.range
        qc = before / c.range
        va = qa / a.range
        vb = qb / b.range
        vc = qc / c.range
        z[count] = abs(qa + qc - qb) / math.sqrt(va * va + vb * vb + vc * vc)
        count += 1
    if count < LEAST_TRIPLES:
        return 0.0
    k = int(TRUSTED * count)
    select(z[:count], k)
    squares = 0.0
    for i in range(k):
        squares += z[i] * z[i]
    return math.sqrt(squares / (k * TRUSTED_MEAN_SQUARE))


@kernel
def window_noise(points: Records) -> float:
    """Return the standard deviation of points normal to the walls, from small windows, or 0 where there are too few."""
    windows = len(points) - WINDOW + 1
    if windows < LEAST_TRIPLES:
        return 0.0
    squares = np.empty(windows, np.float64)
    for a in range(windows):
        mx = 0.0
        my = 0.0
        for i in range(a, a + WINDOW):
            mx += points[i].x
            my += points[i].y
        mx /= WINDOW
        my /= WINDOW
        cxx = 0.0
        cxy = 0.0
        cyy = 0.0
        for i in range(a, a + WINDOW):
            dx = points[i].x - mx
            dy = points[i].y - my
            cxx += dx * dx
            cxy += dx * dy
            cyy += dy * dy
        root = math.hypot(cxx - cyy, 2.0 * cxy)
        squares[a] = max(0.0, 0.5 * (cxx + cyy - root)) / (WINDOW - 2)
    k = windows // 2
    select(squares, k)
    return math.sqrt(squares[k] / MEDIAN_CHI)
