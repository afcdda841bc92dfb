"""Bound the score of chance; see `association.verdict.chance`."""

import math

import numpy as np

from compiled import kernel
from registration.layout import Floats, Records

from ...tables import WallLengths
from ..tuning import LEAST_CHANCE, LEAST_SIGNIFICANCE, MOST_CHANCE


@kernel
def chance_matches(scan: Records, walls: WallLengths, gates: Records) -> Floats:
    """Return (n,) the probability that each scan segment lies on a wall at a random pose with agreeing directions.

    `gates` (1,).
    """
    gate = gates[0]
    lengths = walls.ascending
    beyond = walls.beyond
    chances = np.empty(len(scan), np.float64)
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
        chances[i] = min(
            MOST_CHANCE, max(LEAST_CHANCE, 2.0 * gate.least_offset * walls.agreeing * beyond[low] / walls.area)
        )
    return chances


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


@kernel
def significance(scan: Records, walls: WallLengths, gates: Records, exponents: Floats, score: float) -> float:
    """Return a bound on the probability that some pose of the map scores that, nats: see `association.verdict.chance`.

    `gates` (1,), `exponents` (k,) of Chernoff's bound, ascending.
    """
    gate = gates[0]
    chances = chance_matches(scan, walls, gates)
    exponent = log_tail(scan, chances, score, exponents)
    places = walls.area / (2.0 * gate.least_offset) ** 2
    turns = 2.0 * math.pi / (2.0 * gate.least_angle)
    return min(1.0, max(LEAST_SIGNIFICANCE, math.exp(min(0.0, exponent + math.log(max(1.0, places * turns))))))
