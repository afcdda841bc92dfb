"""How likely chance alone explains a scan as well: an a-contrario bound over all the poses of the map."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ._chance_kernels import chance_matches, log_tail
from .map_index import MapIndex
from .scan_rows import ScanRows

Floats = NDArray[np.float64]

EXPONENTS = np.geomspace(0.01, 2.0, 40)  # of Chernoff's bound
LEAST = 1e-300


def significance(index: MapIndex, scan: ScanRows, gates: Floats, score: float) -> float:
    """Bound the probability that some pose scores `score` on a map that has nothing to do with the scan.

    At a pose drawn at random, turned so that some directions agree, scan segment i lies on a wall with a probability
    q_i that the walls' length per area gives. Chernoff's bound on the sum of the gains, times the number of poses that
    the gates tell apart (the a-contrario count of false alarms of Desolneux, Moisan and Morel).

    Parameters
    ----------
    index : MapIndex
    scan : ScanRows
    gates : (6,) see `scan_rows.gates`
    score : float
        Nats, without lines of sight.

    Returns
    -------
    float
        0 to 1; small is good.
    """
    lengths, beyond = index.sorted_lengths
    offset_gate, angle_gate = float(gates[1]), float(gates[3])
    chances = chance_matches(scan.rows, lengths, beyond, index.agreeing_share, index.area, gates)
    exponent = float(log_tail(scan.rows, chances, score, EXPONENTS))
    places = index.area / (2.0 * offset_gate) ** 2
    turns = math.tau / (2.0 * angle_gate)
    return min(1.0, max(LEAST, math.exp(min(0.0, exponent + math.log(max(1.0, places * turns))))))
