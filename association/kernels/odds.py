"""Compiled models of the verdict, and some of what they go by: see `association.models` and `association.features`."""

import math

from registration.compiling import inlined, internal, kernel
from registration.layout import Floats, Records

from ..tables import Odds
from ..tuning import MAX_GAP, MOST_NULL, NULL_SHARE, NULL_SHARES, SYMMETRIC, UNLIKE_SYMMETRY


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


@internal
@kernel
def three_log_odds(
    usual: Odds, cautious: Odds, features: Floats, place: int, value: float
) -> tuple[float, float, float]:
    """Return the logarithms of the odds by both models, and by the second one with another value at one place."""
    right = log_odds(usual, features)
    careful = log_odds(cautious, features)
    own = features[place]
    features[place] = value
    other = log_odds(cautious, features)
    features[place] = own
    return right, careful, other


@kernel
def null_features(score: float, null: float, symmetry: float) -> tuple[float, float, float]:
    """Return the features ``null``, ``null_gap`` and ``null_better``, of what an answer and the mirrored scan score."""
    share = min(MOST_NULL, null / score) if score > 0.0 else MOST_NULL
    symmetric = min(1.0, max(0.0, (symmetry - UNLIKE_SYMMETRY) / (SYMMETRIC - UNLIKE_SYMMETRY)))
    excess = max(0.0, share - NULL_SHARE) * (1.0 - symmetric)
    gap = (1.0 - NULL_SHARE - excess) * score
    return NULL_SHARE + excess, root_gap(gap), max(0.0, share - 1.0)


@kernel
def root_gap(gap: float) -> float:
    """Return the root of a gap, nats, with its sign, up to that of `MAX_GAP`."""
    return math.copysign(math.sqrt(min(abs(gap), MAX_GAP)), gap)


@internal
@kernel
def allowed_null(cautious: Odds, features: Floats, first: int, score: float, least: float) -> float:
    """Return which of `NULL_SHARES` of the score the mirrored scan may reach, and the log odds are `least` still; or 0.

    Wherever the map is not symmetric about the place. The more it reaches the less the odds. `features` (n,) are those
    of the answer; of these ``null`` and the two after it, at `first`, are changed.
    """
    allowed = 0.0
    for share in NULL_SHARES:
        features[first], features[first + 1], features[first + 2] = null_features(score, share * score, 0.0)
        if log_odds(cautious, features) < least:
            break
        allowed = share
    return allowed


@internal
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


@internal
@kernel
def most_by_one_wall(hinges: Records) -> tuple[float, float]:
    """Return by how much a pose would move at most without one wall, and its greatest deviation then, m; 0 of none."""
    moves = 0.0
    deviation = 0.0
    for k in range(len(hinges)):
        moves = max(moves, hinges[k].moves)
        deviation = max(deviation, hinges[k].deviation)
    return moves, deviation
