"""Compiled models of the verdict, and some of what they go by: see `association.models` and `association.features`."""

from registration.compiling import inlined, kernel
from registration.layout import Floats, Records

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


@kernel
def left_unmatched(scan: Records, matches: Records) -> tuple[float, float]:
    """Return the length of the longest scan line that is not matched, and of all of them together, metres."""
    longest = 0.0
    together = 0.0
    for i in range(len(scan)):
        if matches[i].wall < 0:
            longest = max(longest, scan[i].length)
            together += scan[i].length
    return longest, together


@kernel
def most_by_one_wall(hinges: Records) -> tuple[float, float]:
    """Return by how much a pose would move at most without one wall, and its greatest deviation then, m; 0 of none."""
    moves = 0.0
    deviation = 0.0
    for k in range(len(hinges)):
        moves = max(moves, hinges[k].moves)
        deviation = max(deviation, hinges[k].deviation)
    return moves, deviation
