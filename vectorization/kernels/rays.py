"""Preparation of ranges: their points in counter-clockwise order, and the noise that they show."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from compiled import kernel
from registration.layout import Floats, Records

from .. import tuning


@kernel
def gather(
    cleaned: Floats,
    cosines: Floats,
    sines: Floats,
    backward: bool,
    closed: bool,
    order: NDArray[np.int64],
    points: Records,
) -> int:
    """Write indices and points (n,) of the beams that have a range; return their number.

    Counter-clockwise, so from the last if the scan went `backward`. A `closed` scan is turned so that no wall lies
    across its seam: it begins at the farthest point, which is an end of its wall, as distance from a place grows along
    a line in both directions.
    """
    n = len(cleaned)
    count = 0
    start = 0
    farthest = 0.0
    for k in range(n):
        i = n - 1 - k if backward else k
        if math.isfinite(cleaned[i]):
            if closed and cleaned[i] > farthest:
                start = count
                farthest = cleaned[i]
            count += 1
    number = -start
    for k in range(n):
        i = n - 1 - k if backward else k
        if math.isfinite(cleaned[i]):
            place = number if number >= 0 else number + count
            number += 1
            order[place] = i
            point = points[place]
            point.range = cleaned[i]
            point.ray_x = cosines[i]
            point.ray_y = sines[i]
            point.x = cleaned[i] * cosines[i]
            point.y = cleaned[i] * sines[i]
    return count


@kernel
def misfits_and_quantum(points: Records, increment: float, as_read: Records, misfits: Floats) -> tuple[int, float]:
    """Write how far three neighbouring ranges are from a wall, in standard deviations of a range; return how many.

    On a wall ``1 / r = (n.u) / p`` is linear in the ray's direction, so for any three rays
    ``sin(c - b) / r_a + sin(b - a) / r_c = sin(c - a) / r_b`` whatever the wall; what is missing is noise. `misfits`
    (n,) has the unit of the ranges. Returns also the step that the ranges of all points `as_read` are multiples of,
    metres, 0 for none or one below a millimetre.
    """
    widest = tuning.TRIPLE_STEPS * increment
    count = 0
    for i in range(1, len(points) - 1):
        a = points[i - 1]
        b = points[i]
        c = points[i + 1]
        before = a.ray_x * b.ray_y - a.ray_y * b.ray_x
        after = b.ray_x * c.ray_y - b.ray_y * c.ray_x
        if 0.0 < before < widest and 0.0 < after < widest:
            both = a.ray_x * c.ray_y - a.ray_y * c.ray_x
            qa = after / a.range
            qb = both / b.range
            qc = before / c.range
            va = qa / a.range
            vb = qb / b.range
            vc = qc / c.range
            misfits[count] = abs(qa + qc - qb) / math.sqrt(va * va + vb * vb + vc * vc)
            count += 1
    step = 0
    for i in range(len(as_read)):
        units = as_read[i].range / tuning.QUANTUM_UNIT
        whole = round(units)
        exact = abs(units - whole) <= tuning.QUANTUM_SLACK
        while whole > 0:
            step, whole = whole, step % whole
        if not exact or step < tuning.LEAST_QUANTUM:
            step = 0
            break
    return count, step * tuning.QUANTUM_UNIT


@kernel
def select(values: Floats, k: int) -> None:
    """Put the k-th least of the values (n,) in its place, those before it being no greater, those behind it no less.

    By Hoare's FIND (1961); 0 <= k < n, none of the values nan. `np.partition` takes five times as long.
    """
    low = 0
    high = len(values) - 1
    while low < high:
        pivot = values[k]
        i = low
        j = high
        while i <= j:
            while values[i] < pivot:
                i += 1
            while pivot < values[j]:
                j -= 1
            if i <= j:
                values[i], values[j] = values[j], values[i]
                i += 1
                j -= 1
        if j < k:
            low = i
        if k < i:
            high = j
