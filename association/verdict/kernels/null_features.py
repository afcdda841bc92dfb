"""Features of the null score: the mirrored scan's score over that of the answer."""

import math

from compiled import kernel
from registration.layout import Records

from ..tuning import MAX_GAP, MOST_NULL, NULL_FRACTION, SYMMETRIC, UNLIKE_SYMMETRY


@kernel
def null_features(score: float, null: float, symmetry: float) -> tuple[float, float, float]:
    """Return the features ``null``, ``null_gap`` and ``null_better`` of an answer."""
    ratio = min(MOST_NULL, null / score) if score > 0.0 else MOST_NULL
    symmetric = min(1.0, max(0.0, (symmetry - UNLIKE_SYMMETRY) / (SYMMETRIC - UNLIKE_SYMMETRY)))
    excess = max(0.0, ratio - NULL_FRACTION) * (1.0 - symmetric)
    gap = (1.0 - NULL_FRACTION - excess) * score
    return NULL_FRACTION + excess, root_gap(gap), max(0.0, ratio - 1.0)


@kernel
def root_gap(gap: float) -> float:
    """Return the root of a gap, nats, with its sign, up to that of `MAX_GAP`."""
    return math.copysign(math.sqrt(min(abs(gap), MAX_GAP)), gap)


@kernel
def write_null_features(score: float, null: float, symmetry: float, features: Records) -> None:
    """Write the scores of an answer and of the mirrored scan into the features of the answer, (1,) of `FEATURES`."""
    out = features[0]
    out.null, out.null_gap, out.null_better = null_features(score, null, symmetry)
