"""Compute the paper's measures of a consensus set: ambiguity and reliability."""

import math

import numpy as np

from compiled import kernel
from registration.kernels import keep_alive, one_step_add
from registration.layout import ONE_STEP_SUMS, Floats, Record, Records

from ...tables import KnownWalls
from .wall_variance import registered_weights


@kernel
def paper_measures(scan: Records, matches: Records, known_walls: KnownWalls, poses: Records) -> Floats:
    """Return the one-step costs of consensus sets at poses, and their reliability, (k, 4).

    The translation's cost, ``sum w r^2``, the rotation's by Mitsuta, ``sum w a^2``, and by Wahba,
    ``2 sum w (1 - cos a)``, and Eq. (28). `matches` (k, n); `poses` (k,) of `POSE_AMONG_WALLS`.
    """
    measures = np.empty((len(poses), 4), np.float64)
    for k in range(len(poses)):
        sums = set_sums(scan, matches[k], known_walls, poses[k])
        value = sums[0]
        determinant = max(0.0, value.x2 * value.y2 - value.xy * value.xy)
        measures[k, 0] = max(0.0, value.gap2)
        measures[k, 1] = max(0.0, value.angle2)
        measures[k, 2] = max(0.0, 2.0 * value.versine)
        measures[k, 3] = min(1.0, 2.0 * math.sqrt(determinant) / value.w) if value.w > 0.0 else 0.0
        keep_alive(sums)
    return measures


@kernel
def set_sums(scan: Records, matches: Records, known_walls: KnownWalls, pose: Record) -> Records:
    """Return the one-step sums of a consensus set about a pose, with the weights that it registers with."""
    sums = np.zeros(2, ONE_STEP_SUMS)
    walls = known_walls.walls
    weights = np.empty(len(scan), np.float64)
    registered_weights(scan, matches, known_walls.ties, pose.wall_sigma**2, weights)
    for i in range(len(scan)):
        if matches[i].wall < 0:
            continue
        wall = walls[matches[i].wall]
        middle = 0.5 * (wall.begin + wall.end)
        offset = wall.offset + matches[i].shift
        on_x = wall.dx * middle - wall.dy * offset
        on_y = wall.dy * middle + wall.dx * offset
        gap = wall.dx * (on_y - pose.y) - wall.dy * (on_x - pose.x)
        gap -= scan[i].dx * scan[i].y - scan[i].dy * scan[i].x
        one_step_add(sums, wall, scan[i], gap, pose.theta, weights[i], 1.0)
    return sums
