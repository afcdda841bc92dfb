"""Twins of the kernels of what chance scores."""

from __future__ import annotations

import math

import numpy as np

from association.verdict.tuning import LEAST_CHANCE, MOST_CHANCE
from registration.layout import Floats, Records


def chance_matches(scan: Records, wall_lengths: Floats, agreeing: float, area: float, gates: Records) -> Floats:
    """Add up the walls that are long enough, for one segment after the other."""
    gate = gates[0]
    usable = [wall_lengths[wall_lengths >= gate["least_overlap"] * length].sum() for length in scan["length"]]
    chances = [2.0 * gate["least_offset"] * agreeing * length / area for length in usable]
    return np.array([min(MOST_CHANCE, max(LEAST_CHANCE, chance)) for chance in chances])


def log_tail(scan: Records, chances: Floats, score: float, exponents: Floats) -> float:
    """Return Chernoff's bound at the best of the exponents."""
    moments = [np.prod(1.0 - chances + chances * np.exp(t * scan["gain"])) for t in exponents]
    return min(math.log(m) - float(t) * score for t, m in zip(exponents, moments, strict=True))
