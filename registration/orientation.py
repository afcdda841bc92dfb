"""Directions for segments that came without."""

from __future__ import annotations

import math

import numpy as np

from .correspondences import Correspondences
from .joint import JointSums
from .layout import Floats
from .transform import wrap_angle

MARGIN = 9.0  # of chi-square: three standard deviations
SAME_ANGLE = 1e-6  # rad; both starts have come down to one minimum
ROUNDING = 1e-12  # of the sums, what a difference of two costs may be and mean nothing


def choose_rotation(pairs: Correspondences, weights: Floats, *, is_noise: bool) -> tuple[float, bool]:
    """Find the rotation of pairs whose scan segments may each run either way.

    Twice an angle does not change when a segment is turned round, so the mean of the doubled angles gives the rotation
    but for a half turn. Both are solved, and the lower joint cost wins; the cost itself does not see directions.

    Parameters
    ----------
    pairs : Correspondences
        About the centres of both sets.
    weights : (n,)
    is_noise : bool
        Whether the weights are 1 / variance.

    Returns
    -------
    theta : float
        Radians; a scan segment that runs against its map segment after it is to be turned round.
    unique : bool
        False when the half turn fits about as well: not worse by three standard deviations or, without noise, by
        rounding. Of two that fit equally well the smaller rotation is taken.
    """
    doubled = 2.0 * pairs.angles(0.0)
    start = 0.5 * math.atan2(weights @ np.sin(doubled), weights @ np.cos(doubled))
    sums = JointSums.of_set(pairs, weights)
    thetas, costs = [], []
    for angle in (start, start + math.pi):
        theta, translation, _ = sums.solve(angle)
        thetas.append(theta)
        costs.append(sums.cost(theta, translation))
    rounding = ROUNDING * float(sums.compensated["cc"][0] + sums.compensated["ss"][0])
    theta = thetas[0] if costs[0] <= costs[1] + rounding else thetas[1]
    only_one = abs(wrap_angle(thetas[1] - thetas[0])) < SAME_ANGLE
    unique = only_one or abs(costs[1] - costs[0]) > rounding + (MARGIN if is_noise else 0.0)
    return theta, unique
