"""How likely chance alone explains a scan as well: an a-contrario bound over all the poses of the map."""

from __future__ import annotations

import math

import numpy as np

from .context import SearchContext
from .kernels.chance import chance_matches, log_tail
from .tuning import LEAST_SIGNIFICANCE

EXPONENTS = np.geomspace(0.01, 2.0, 40)  # of Chernoff's bound


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
    index, scan, gates = context.index, context.lines.rows, context.gates
    lengths, beyond = index.sorted_lengths
    chances = chance_matches(scan, lengths, beyond, index.agreeing_share, index.area, gates)
    exponent = float(log_tail(scan, chances, score, EXPONENTS))
    places = index.area / (2.0 * float(gates["least_offset"][0])) ** 2
    turns = math.tau / (2.0 * float(gates["least_angle"][0]))
    return min(1.0, max(LEAST_SIGNIFICANCE, math.exp(min(0.0, exponent + math.log(max(1.0, places * turns))))))
