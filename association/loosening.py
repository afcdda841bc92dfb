"""A second look at an answer and its rivals, with walls taken to be off by more than the answer shows.

Where a building repeats itself and its map is centimetres off, a wall at the right place may lie beyond the gates, and
a twin fit better by luck: the error of the walls is estimated from the one that fits best, and of many twins one always
fits well. What a place misses so, by centimetres, is no evidence against it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from registration.compiling import way_in

from .context import SearchContext
from .explanations import Answer
from .kernels import loosening as kernels
from .layout import MERIT
from .ranking import Ranked, match_again
from .scan_lines import ScanLines
from .tuning import LOOSE_RIVALS

_loose_sigma, _loose_share = way_in(kernels.loose_sigma), way_in(kernels.loose_share)


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
    values = np.array([one.value for one in explanations])
    return float(_loose_share(np.array([one.merit for one in explanations], MERIT), values, again))
