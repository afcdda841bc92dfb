"""Compiled measures of the paper of a consensus set on walls: ambiguity and reliability."""

import math

import numpy as np

from registration.compiling import internal, kernel
from registration.kernels import keep_alive, one_step_add
from registration.layout import ONE_STEP_SUMS, Records

from ..tuning import ROUGHNESS


@internal
@kernel
def paper_measures(
    scan: Records, matches: Records, walls: Records, wall_sigma: float, theta: float, x: float, y: float
) -> tuple[float, float, float, float]:
    """Return what the one-step sums cost at a pose, and what they say of its reliability.

    The translation's cost, ``sum w r^2``, the rotation's by Mitsuta, ``sum w a^2``, and by Wahba,
    ``2 sum w (1 - cos a)``, and Eq. (28). Walls are off by `wall_sigma`, metres, one by one.
    """
    sums = np.zeros(2, ONE_STEP_SUMS)
    for i in range(len(scan)):
        if matches[i].wall < 0:
            continue
        wall = walls[matches[i].wall]
        middle = 0.5 * (wall.begin + wall.end)
        on_x = wall.dx * middle - wall.dy * wall.offset
        on_y = wall.dy * middle + wall.dx * wall.offset
        gap = wall.dx * (on_y - y) - wall.dy * (on_x - x) - (scan[i].dx * scan[i].y - scan[i].dy * scan[i].x)
        variance = 1.0 / scan[i].weight - ROUGHNESS * ROUGHNESS + wall_sigma * wall_sigma
        one_step_add(sums, wall, scan[i], gap, theta, 1.0 / variance, 1.0)
    value = sums[0]
    costs = (max(0.0, value.gap2), max(0.0, value.angle2), max(0.0, 2.0 * value.versine))
    determinant = max(0.0, value.x2 * value.y2 - value.xy * value.xy)
    reliability = min(1.0, 2.0 * math.sqrt(determinant) / value.w) if value.w > 0.0 else 0.0
    keep_alive(sums)
    return costs[0], costs[1], costs[2], reliability
