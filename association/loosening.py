"""A second look at an answer and its rivals, with walls taken to be off by more than the answer's are.

Where a building repeats itself and its map is centimetres off, a wall at the right place may lie beyond the gates, and
a twin fit better by luck: the error of the walls is estimated from the one that fits best. What a place misses so, by
centimetres, is no evidence against it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from .context import SearchContext
from .explain import Answer
from .ranking import Ranked, score_again
from .scan_lines import ScanLines
from .tuning import LOOSE_FACTOR, LOOSE_RIVALS, LOOSE_WALLS, MODEL_OFFSET, TWIN_TEMPERATURE


def loose_twin_share(context: SearchContext, answer: Answer, rivals: Sequence[Ranked]) -> float:
    """Return the chance of the best explanation among its nearest rivals where walls may be off by more, up to 1.

    1 where they are off by no more than the score supposes, or where the caller knows by how much they are.

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    wall_sigma = answer.settled.wall_sigma
    if context.index.sigma is not None or wall_sigma < LOOSE_WALLS or not rivals:
        return 1.0
    more = math.sqrt((LOOSE_FACTOR * wall_sigma) ** 2 - MODEL_OFFSET**2)
    loose = replace(context, lines=ScanLines.of(context.scan, more, context.options))
    best, *others = score_again(loose, (answer.best, *rivals[:LOOSE_RIVALS]))
    return 1.0 / (1.0 + sum(math.exp(min(0.0, one.value - best.value) / TWIN_TEMPERATURE) for one in others))
