"""Rank bases, pairs of scan lines, by what a search of them costs and may gain."""

from __future__ import annotations

import math

import numpy as np

from compiled import kernel
from registration.layout import Floats, Records

from ...layout import Flags
from ...tables import Walls
from ..tuning import (
    COST_ANCHOR,
    COST_BASE,
    COST_HYPOTHESIS,
    COST_SLIDE,
    GAIN_POWER,
    HYPOTHESIS_SCALE,
    MIN_CROSSING_BASE,
    SHORT_LENGTH,
    SHORT_POWER,
    SINE_POWER,
    TELLING,
    UNTELLING,
)
from .proposals import end_slack


@kernel
def measure_slides(scan: Records, chains: Walls, slides: Floats, costs: Floats) -> None:
    """Write how far each of the first scan lines slides on the chains of each direction, metres, and what that costs.

    Parameters
    ----------
    scan : (n,) of `SCAN_LINE`
    chains : Walls
    slides : (count, bins)
        Written.
    costs : (count,)
        Written.
    """
    bin_starts = chains.bin_starts
    longest = chains.longest
    summed = chains.summed
    for i in range(len(costs)):
        need = scan[i].length - 2.0 * end_slack(scan[i].length)
        costs[i] = 0.0
        for b in range(len(bin_starts) - 1):
            low = bin_starts[b]
            high = bin_starts[b + 1]
            while low < high:  # the longest of a bin come first
                middle = (low + high) // 2
                if longest[middle] >= need:
                    low = middle + 1
                else:
                    high = middle
            fit = low - bin_starts[b]
            slides[i, b] = summed[low] - summed[bin_starts[b]] - fit * max(need, 0.0)
            costs[i] += COST_ANCHOR * fit + COST_SLIDE * slides[i, b]


@kernel
def rank_bases(
    scan: Records, most: int, chains: Walls, area: float, merits: Floats, telling: Flags, costs: Floats
) -> int:
    """Write the merits of the bases, pairs of the first scan lines that are not parallel; return how many there are.

    The merit of a base is the logarithm of the lesser gain, to a power, over the cost of its search: the chains that
    one line slides on, the metres of them, and the hypotheses that are expected on the way. A base is telling if it
    lays the other lines off by less than `TELLING`. Others have a lower merit, and are none beyond `most` lines.

    Parameters
    ----------
    scan : (n,) of `SCAN_LINE`
    most : int
    chains : Walls
    area : float
        Of the map, m^2.
    merits, telling : (count, count)
        Written above the diagonal, for the first `count` lines: -inf where there is no base.
    costs : (count,)
        Written: of sliding a line; of each base that of the lower cost slides.
    """
    count = len(costs)
    bins = len(chains.bin_starts) - 1
    slides = np.zeros((count, bins), np.float64)
    measure_slides(scan, chains, slides, costs)
    near = np.zeros((count, 2 * bins), np.float64)
    for i in range(count):
        for b in range(bins):
            after = b + 1 if b + 1 < bins else 0
            near[i, b] = slides[i, b - 1] + slides[i, b] + slides[i, after]
            near[i, b + bins] = near[i, b]
    total = 1e-9
    x = 0.0
    y = 0.0
    square = 0.0
    for i in range(len(scan)):
        total += scan[i].gain
        x += scan[i].gain * scan[i].x
        y += scan[i].gain * scan[i].y
    x /= total
    y /= total
    for i in range(len(scan)):
        square += scan[i].gain / total * ((scan[i].x - x) ** 2 + (scan[i].y - y) ** 2)
    number = 0
    for i in range(count):
        for j in range(count):
            merits[i, j] = -math.inf
        for j in range(i + 1, count):
            sine = scan[i].dx * scan[j].dy - scan[i].dy * scan[j].dx
            if abs(sine) < MIN_CROSSING_BASE:
                continue
            variance = scan[i].angle_variance * scan[j].angle_variance
            variance /= scan[i].angle_variance + scan[j].angle_variance
            off = square + (0.5 * (scan[i].x + scan[j].x) - x) ** 2 + (0.5 * (scan[i].y + scan[j].y) - y) ** 2
            telling[i, j] = variance * off <= TELLING * TELLING
            if not telling[i, j] and j >= most:
                continue
            shift = int(np.rint((scan[j].angle - scan[i].angle) * bins / (2.0 * math.pi))) % bins
            expected = 0.0
            for b in range(bins):
                expected += slides[i, b] * near[j, b + shift]
            shorter = min(scan[i].length, scan[j].length)
            expected *= HYPOTHESIS_SCALE / area * abs(sine) ** SINE_POWER * (shorter + SHORT_LENGTH) ** SHORT_POWER
            cost = COST_BASE + min(costs[i], costs[j]) + COST_HYPOTHESIS * expected
            merits[i, j] = GAIN_POWER * math.log(min(scan[i].gain, scan[j].gain)) - math.log(cost)
            if not telling[i, j]:
                merits[i, j] += math.log(UNTELLING)
            number += 1
    return number
