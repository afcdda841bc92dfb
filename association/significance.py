"""How likely chance alone explains a scan as well: an a-contrario bound over all the poses of the map."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

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
    rows = scan.rows
    chances = chance_matches(index, rows, gates)
    gains = rows[:, 12]
    logs = np.log1p(chances[None] * np.expm1(np.minimum(EXPONENTS[:, None] * gains[None], 600.0))).sum(axis=1)
    exponent = float(np.min(logs - EXPONENTS * score))
    places = index.area / (2.0 * gates[1]) ** 2
    turns = math.tau / (2.0 * gates[3])
    return min(1.0, max(LEAST, math.exp(min(0.0, exponent + math.log(max(1.0, places * turns))))))


def chance_matches(index: MapIndex, rows: Floats, gates: Floats) -> Floats:
    """Return (n,) the probability that each scan segment lies on a wall at a random pose with agreeing directions."""
    lengths, beyond = index.sorted_lengths
    usable = beyond[np.searchsorted(lengths, gates[5] * rows[:, 4])]
    agreeing = index.agreeing_share
    return np.asarray(np.clip(2.0 * gates[1] * agreeing * usable / index.area, 1e-6, 0.9))
