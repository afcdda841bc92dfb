"""How likely chance alone explains a scan as well: an a-contrario bound over all the poses of the map."""

from __future__ import annotations

import numpy as np

from ..context import SearchContext
from .kernels import chance

EXPONENTS = np.geomspace(0.01, 2.0, 40)  # of Chernoff's bound

_significance = chance.significance


def significance(context: SearchContext, score: float) -> float:
    """Bound the probability that some pose scores `score` on a map that has nothing to do with the scan.

    At a pose drawn at random, turned so that some directions agree, scan segment i lies on a wall with a probability
    q_i that the walls' length per area gives. Chernoff's bound on the sum of the gains, times the number of poses that
    the gates tell apart (the a-contrario count of false alarms of Desolneux, Moisan and Morel).

    Parameters
    ----------
    context : SearchContext
    score : float
        Nats, without lines of sight.

    Returns
    -------
    float
        0 to 1; small is good.
    """
    return _significance(context.lines.rows, context.index.wall_lengths, context.gates, EXPONENTS, score)
