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
from .ranking import Ranked, score_again
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
    loose = context.instead(context.scan, ScanLines.of(context.scan, more, context.options))
    best, *others = score_again(loose, (answer.best, *rivals[:LOOSE_RIVALS]))
    return 1.0 / (1.0 + sum(math.exp(min(0.0, _gap(best, one)) / TWIN_TEMPERATURE) for one in others))


def _gap(best: Ranked, other: Ranked) -> float:
    """Return how much more the other is worth, nats, with what beams say of centimetres the less."""
    by_beams = (other.score - other.by_segments) - (best.score - best.by_segments)
    return other.value - best.value - (1.0 - LOOSE_BEAMS) * by_beams
