"""Compiled models of the verdict: see `association.models`."""

from registration.compiling import inlined, kernel
from registration.layout import Floats

from ..tables import Odds


@inlined
def share_between(value: float, start: float, full: float) -> float:
    """Return how far a value is on the way from `start` to `full`, 0 to 1."""
    return min(1.0, max(0.0, (value - start) / (full - start)))


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
        one = share_between(features[pair.first], pair.start, pair.full)
        other = share_between(features[pair.second], pair.second_start, pair.second_full)
        by_pairs += pair.nats * (min(one, other) if pair.least else max(one, other))
    return by_curves + by_pairs
