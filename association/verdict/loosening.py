"""A second look at an answer and its rivals, with walls taken to be off by more than the answer shows.

Where a building repeats itself and its map is centimetres off, a wall at the right place may lie beyond the gates, and
a twin fit better by luck: the error of the walls is estimated from the one that fits best, and of many twins one always
fits well. What a place misses so, by centimetres, is no evidence against it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from registration.layout import Floats

from ..consensus.ranking import Ranked, match_again
from ..context import SearchContext
from ..explanations import Answer
from ..scan.scan_lines import ScanLines
from ..tuning import LOOSE_BEAMS, LOOSE_FACTOR, LOOSE_RIVALS, LOOSE_WALLS, MODEL_OFFSET, TWIN_TEMPERATURE


def loose_twin_share(context: SearchContext, answer: Answer, rivals: Sequence[Ranked]) -> float:
    """Return the chance of the best explanation among its nearest rivals where walls may be off by more, up to 1.

    1 where the caller knows by how much they are.

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    if context.index.sigma is not None or not rivals:
        return 1.0
    lines = ScanLines.of(context.scan, _loose_sigma(answer.settled.wall_sigma), context.options, context.lines.given)
    explanations = (answer.best, *rivals[:LOOSE_RIVALS])
    again = match_again(context.instead(context.scan, lines), explanations)
    return _share_of_first(explanations, again["score"])


def _loose_sigma(wall_sigma: float) -> float:
    """Return the standard deviation of a wall's offset beyond `MODEL_OFFSET`, metres, for an estimate of its whole."""
    loose = max(LOOSE_WALLS, LOOSE_FACTOR * wall_sigma)
    return math.sqrt(loose * loose - MODEL_OFFSET * MODEL_OFFSET)


def _share_of_first(explanations: Sequence[Ranked], scores: Floats) -> float:
    """Return the probability of the first explanation among all, from what their segments score now, (k,) nats.

    The prior counts in full; the beams' part, which depends on centimetres, counts by `LOOSE_BEAMS`.
    """
    prior_and_beams = [one.value - one.score + LOOSE_BEAMS * (one.score - one.by_segments) for one in explanations]
    values = scores + np.array(prior_and_beams)
    rivals = np.exp(np.minimum(0.0, values[1:] - values[0]) / TWIN_TEMPERATURE)
    return 1.0 / (1.0 + float(rivals.sum()))
