"""The paper's measures of consensus sets: ambiguity and reliability; the score at the paper's estimate."""

from __future__ import annotations

import math

import numpy as np

from registration import Ambiguity, RigidTransform

from ..context import SearchContext
from .consensus_set import ConsensusSet
from .observations import observations_of


def paper_measures(
    context: SearchContext, one: ConsensusSet, pose: RigidTransform, wall_sigma: float
) -> tuple[Ambiguity, float]:
    """Return the ambiguity, Eqs. (16) and (22), of a consensus set at a pose of the index frame, and its reliability.

    With the weights that the set registers with; the rotation by Wahba's or Mitsuta's cost, as the options have it.
    """
    seen = observations_of(context, one.matches)
    if seen is None:
        return Ambiguity(0.0, 0.0), 0.0
    same = seen.wall[:, None] == seen.wall
    ties = seen.ties[seen.wall]
    tied = (ties[:, None] >= 0.0) & (ties >= 0.0)
    one_wall = np.where(tied, np.exp(-np.abs(ties[:, None] - ties)), same)
    weights = 1.0 / (seen.variances * (1.0 + wall_sigma**2 * (one_wall @ (1.0 / seen.variances))))
    c, s = math.cos(pose.theta), math.sin(pose.theta)
    nx, ny = seen.normals.T
    dx, dy = seen.directions.T
    x, y = context.lines.rows["x"][seen.row], context.lines.rows["y"][seen.row]
    ex, ey = c * dx - s * dy, s * dx + c * dy
    angles = np.arctan2(ex * -nx - ey * ny, ex * ny - ey * nx)
    gaps = seen.offsets - nx * pose.x - ny * pose.y - (dx * y - dy * x)
    wahba = context.options.rotation == "wahba"
    rotation = 4.0 * np.sin(0.5 * angles) ** 2 if wahba else angles**2
    xx, yy, xy = float(weights @ ny**2), float(weights @ nx**2), float(-(weights * nx) @ ny)
    reliability = 2.0 * math.sqrt(max(0.0, xx * yy - xy * xy)) / float(weights.sum())
    return Ambiguity(float(weights @ gaps**2), float(weights @ rotation)), min(1.0, reliability)


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
