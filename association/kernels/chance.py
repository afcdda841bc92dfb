"""Compiled bound on what chance scores; see `association.significance`."""

import math

import numpy as np

from registration.compiling import internal, kernel
from registration.layout import Floats, Records

from ..tuning import LEAST_CHANCE, MOST_CHANCE


@internal
@kernel
def chance_matches(
    scan: Records, lengths: Floats, beyond: Floats, agreeing: float, area: float, gates: Records
) -> Floats:
    """Return (n,) the probability that each scan segment lies on a wall at a random pose with agreeing directions.

    `lengths` (m,): of the walls, ascending; ``beyond[k]`` is the sum of those from k on, (m + 1,). `agreeing` is the
    chance that two points of walls have the same direction. `gates` (1,).
    """
    gate = gates[0]
    chances = np.empty(len(scan))
    for i in range(len(scan)):
        # The walls that are long enough: the first of them by bisection.
        least = gate.least_overlap * scan[i].length
        low = 0
        high = len(lengths)
        while low < high:
            middle = (low + high) // 2
            if lengths[middle] < least:
                low = middle + 1
            else:
                high = middle
        chances[i] = min(MOST_CHANCE, max(LEAST_CHANCE, 2.0 * gate.least_offset * agreeing * beyond[low] / area))
    return chances


@internal
@kernel
def log_tail(scan: Records, chances: Floats, score: float, exponents: Floats) -> float:
    """Return Chernoff's bound on the log of the probability that gains drawn with `chances` come to `score`.

    The least of it over the ascending `exponents`. It is convex in the exponent, so bisection by its slope finds the
    two exponents on either side of the minimum.
    """
    low = 0
    high = len(exponents)
    while low < high:
        middle = (low + high) // 2
        slope = -score
        for i in range(len(scan)):
            grown = chances[i] * math.exp(exponents[middle] * scan[i].gain)
            slope += scan[i].gain * grown / (1.0 - chances[i] + grown)
        if slope < 0.0:
            low = middle + 1
        else:
            high = middle
    least = math.inf
    for k in range(max(0, low - 1), min(low + 1, len(exponents))):
        total = -exponents[k] * score
        for i in range(len(scan)):
            total += math.log1p(chances[i] * math.expm1(exponents[k] * scan[i].gain))
        least = min(least, total)
    return least
