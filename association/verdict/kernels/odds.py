"""Evaluate the verdict's models; see `association.verdict.models`."""

import math

import numpy as np

from compiled import kernel
from registration.layout import Floats, Records

from ...tables import Odds


@kernel
def log_odds(odds: Odds, features: Floats) -> float:
    """Return the logarithm of the odds: a sum of curves, then of pairs; `features` (n,) of an answer."""
    curves = odds.curves
    bends = odds.bends
    pairs = odds.pairs
    by_curves = 0.0
    for c in range(len(curves)):
        curve = curves[c]
        value = features[curve.feature]
        bent = 0.0
        for k in range(curve.begin, curve.end):
            if value > bends[k].start:
                bent += bends[k].more * (value - bends[k].start)
        by_curves += curve.slope * value + bent
    by_pairs = 0.0
    for p in range(len(pairs)):
        pair = pairs[p]
        one = fraction_between(features[pair.first], pair.start, pair.full)
        other = fraction_between(features[pair.second], pair.second_start, pair.second_full)
        by_pairs += pair.nats * (min(one, other) if pair.least else max(one, other))
    return by_curves + by_pairs


@kernel
def logistic(logit: float) -> float:
    """Return a probability from the logarithm of its odds."""
    return 1.0 / (1.0 + math.exp(-max(-500.0, logit)))


@kernel
def probability(odds: Odds, features: Records, more: float) -> float:
    """Return the probability by a model of features, (1,) of `FEATURES`, and by `more` nats in its log odds."""
    return logistic(log_odds(odds, features.view(np.float64)) + more)


@kernel
def fraction_between(value: float, start: float, full: float) -> float:
    """Return how far a value is on the way from `start` to `full`, 0 to 1."""
    return min(1.0, max(0.0, (value - start) / (full - start)))
