"""Directions for segments that came without."""

from __future__ import annotations

import math

from compiled import kernel

from ..layout import Floats, Records
from .joint import joint_cost, joint_solve, joint_sums_compensated
from .pairs import relative_angles
from .records import keep_alive

MARGIN = 9.0  # of chi-square: three standard deviations
SAME_ANGLE = 1e-6  # rad; both starts have come down to one minimum
ROUNDING = 1e-12  # of the sums, what a difference of two costs may be and mean nothing


@kernel
def choose_rotation(pairs: Records, weights: Floats, is_noise: bool) -> tuple[float, bool]:
    """Find the rotation of pairs whose scan segments may each run either way.

    Twice an angle does not change when a segment is turned round, so the mean of the doubled angles gives the rotation
    but for a half turn. Both are solved, and the lower joint cost wins; the cost itself does not see directions.

    Parameters
    ----------
    pairs : (n,) PAIR
        About the centres of both sets.
    weights : (n,)
    is_noise : bool
        True if the weights are 1 / variance.

    Returns
    -------
    theta : float
        Radians; a scan segment that runs against its map segment after it is to be turned round.
    unique : bool
        False when the half turn fits about as well: not worse by three standard deviations or, without noise, by
        rounding. Of two that fit equally well the smaller rotation is taken.
    """
    angles = relative_angles(pairs, 0.0)
    sine = 0.0
    cosine = 0.0
    for i in range(len(pairs)):
        sine += weights[i] * math.sin(2.0 * angles[i])
        cosine += weights[i] * math.cos(2.0 * angles[i])
    start = 0.5 * math.atan2(sine, cosine)
    sums = joint_sums_compensated(pairs, weights)
    one, x, y, _, _ = joint_solve(sums[0], start, False)
    cost = joint_cost(sums[0], one, x, y)
    other, x, y, _, _ = joint_solve(sums[0], start + math.pi, False)
    other_cost = joint_cost(sums[0], other, x, y)
    rounding = ROUNDING * (sums[0].cc + sums[0].ss)
    keep_alive(sums)
    only_one = abs(math.sin(0.5 * (other - one))) < 0.5 * SAME_ANGLE
    unique = only_one or abs(other_cost - cost) > rounding + (MARGIN if is_noise else 0.0)
    return (one if cost <= other_cost + rounding else other), unique


@kernel
def turn_against(centred: Records, local: Records, theta: float) -> None:
    """Turn those scan segments round, in both, that run against their map segments once they are turned by `theta`."""
    angles = relative_angles(centred, theta)
    for i in range(len(centred)):
        if abs(angles[i]) > 0.5 * math.pi:
            seen = centred[i].scan
            seen.dx *= -1.0
            seen.dy *= -1.0
            seen = local[i].scan
            seen.dx *= -1.0
            seen.dy *= -1.0
