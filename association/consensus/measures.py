"""The score of consensus sets at the paper's estimate."""

from __future__ import annotations

import math

import numpy as np

from .consensus_set import ConsensusSet


def score_at_one_step(one: ConsensusSet) -> float:
    """Return the score of a consensus set at the paper's estimate: Wahba's rotation, then the translation that fits.

    Of its sums: that of the joint one orders and judges.
    """
    q = {name: float(one.sums[name][0]) for name in one.sums.dtype.names or ()}
    size = math.hypot(q["wahba_cos"], q["wahba_sin"])
    det = q["xx"] * q["yy"] - q["xy"] ** 2
    if size <= 0.0 or not det > 0.0:
        return one.score
    c, s = q["wahba_cos"] / size, q["wahba_sin"] / size
    x = -(c * q["cx"] + s * q["sx"] + q["x1"])
    y = -(c * q["cy"] + s * q["sy"] + q["y1"])
    tx, ty = (q["yy"] * x - q["xy"] * y) / det, (q["xx"] * y - q["xy"] * x) / det
    v = np.array([c, s, tx, ty, 1.0])
    names = ("c", "s", "x", "y", "1")
    cost = 0.0
    for i, a in enumerate(names):
        for j, b in enumerate(names[i:], i):
            cost += (1.0 if i == j else 2.0) * q["one" if a == b == "1" else a + b] * v[i] * v[j]
    return one.score + 0.5 * (one.chi_square - max(0.0, cost))
