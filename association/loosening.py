"""A second look at an answer and its rivals, with walls taken to be off by more than the answer shows.

Where a building repeats itself and its map is centimetres off, a wall at the right place may lie beyond the gates, and
a twin fit better by luck: the error of the walls is estimated from the one that fits best, and of many twins one always
fits well. What a place misses so, by centimetres, is no evidence against it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from .context import SearchContext
from .explain import Answer
from .ranking import Ranked, scores_again
from .scan_lines import ScanLines
from .tuning import LOOSE_BEAMS, LOOSE_FACTOR, LOOSE_RIVALS, LOOSE_WALLS, MODEL_OFFSET, TWIN_TEMPERATURE


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
    wall_sigma = max(LOOSE_WALLS, LOOSE_FACTOR * answer.settled.wall_sigma)
    more = math.sqrt(wall_sigma**2 - MODEL_OFFSET**2)
    lines = ScanLines.of(context.scan, more, context.options, context.lines.given)
    loose = context.instead(context.scan, lines)
    explanations = (answer.best, *rivals[:LOOSE_RIVALS])
    best, *others = map(_worth, explanations, scores_again(loose, explanations))
    return 1.0 / (1.0 + sum(math.exp(min(0.0, other - best) / TWIN_TEMPERATURE) for other in others))


def _worth(one: Ranked, by_segments: float) -> float:
    """Return what it is worth if its segments score so much, nats, with what beams say of centimetres the less."""
    by_beams = one.score - one.by_segments
    return by_segments + by_beams + one.value - one.score - (1.0 - LOOSE_BEAMS) * by_beams
