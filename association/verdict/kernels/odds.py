"""Evaluate the verdict's models and some of its features; see `association.verdict.models`."""

import math

import numpy as np

from compiled import kernel
from registration.layout import Floats, Records

from ...tables import Odds
from ...tuning import MAX_GAP, MOST_NULL, NULL_SHARE, NULL_SHARES, SYMMETRIC, UNLIKE_SYMMETRY

ROUNDING = 1e-9  # of a chance


@kernel
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
def logistic(logit: float) -> float:
    """Return a chance from the logarithm of its odds."""
    return 1.0 / (1.0 + math.exp(-max(-500.0, logit)))


@kernel
def chance(odds: Odds, features: Records) -> float:
    """Return the chance that a model sees in features, (1,) of `FEATURES`."""
    return logistic(log_odds(odds, features.view(np.float64)))


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


@kernel
def take_null(score: float, null: float, symmetry: float, features: Records) -> None:
    """Write what an answer and the mirrored scan score into the features of the answer, (1,) of `FEATURES`."""
    out = features[0]
    out.null, out.null_gap, out.null_better = null_features(score, null, symmetry)


@kernel
def allowed_null(cautious: Odds, features: Records, score: float, bar: float) -> float:
    """Return which of `NULL_SHARES` of the score the mirrored scan may reach, and the chance is over `bar` still; or 0.

    Wherever the map is not symmetric about the place. The more it reaches the less the chance. `features` (1,) are
    those of the answer; what they say of the null is changed.
    """
    numbers = features.view(np.float64)
    least = bar + ROUNDING
    if least >= 1.0:
        return 0.0
    least = math.log(least / (1.0 - least))
    allowed = 0.0
    for share in NULL_SHARES:
        take_null(score, share * score, 0.0, features)
        if log_odds(cautious, numbers) < least:
            break
        allowed = share
    return allowed
