"""Estimate the walls' error of a consensus set from its residuals, and weight the lines on these walls."""

import math

import numpy as np

from compiled import kernel
from registration.layout import Floats, Record, Records

from ...layout import Integers
from ...tables import KnownWalls, Workspace
from ...tuning import ROUGHNESS
from ..tuning import LEAST_KNOWN_VARIANCE, LEAST_WALL_ERROR, ROUGH_FRACTION, UNSEEN_ERROR, USUAL_WALLS
from .pair_sums import empty_sums, update_pair
from .wall_errors import eliminate_wall_errors


@kernel
def wall_variance_shown(
    pose: Record, of_wall: Integers, own: Floats, wall_variance: float, usual: float, work: Workspace
) -> float:
    """Return the variance of the walls' own errors that their residuals show, shrunk to `usual` where walls are few.

    Each of the walls counts as far as it is one of its `own`, (k,).

    At the pose that was fitted to all, the mean residual m_k of wall k has the variance ``(V + 1 / s_k) (1 - h_k)``,
    with its leverage h_k. Hence V is about ``sum(m_k^2 - (1 - h_k) / s_k) / sum(1 - h_k)``; `USUAL_WALLS` more walls
    are taken to have shown `usual`.
    """
    wall_sums = work.wall_sums
    c = math.cos(pose.theta)
    s = math.sin(pose.theta)
    found = USUAL_WALLS * usual
    count = USUAL_WALLS
    for k in range(len(of_wall)):
        one = wall_sums[of_wall[k]]
        mean = (one.c * c + one.s * s + one.x * pose.x + one.y * pose.y + one.one) / one.weight
        gx = one.x / one.weight
        gy = one.y / one.weight
        gt = (one.s * c - one.c * s) / one.weight
        variance = wall_variance + 1.0 / one.weight
        spread = gx * gx * pose.xx + gy * gy * pose.yy + gt * gt * pose.tt
        spread += 2.0 * (gx * gy * pose.xy + gx * gt * pose.xt + gy * gt * pose.yt)
        free = max(0.0, 1.0 - spread / variance)
        found += own[k] * (mean * mean - free / one.weight)
        count += own[k] * free
    # An estimate from so few walls is uncertain itself: Student's t has that much more variance. And the walls that are
    # farthest off matched nothing.
    unsure = UNSEEN_ERROR * (1.0 + 2.0 / max(1.0, count - 2.0))
    return unsure * max(found / count, LEAST_WALL_ERROR**2)


@kernel
def distinct_walls(scan: Records, matches: Records, ties: Floats) -> tuple[Integers, Floats]:
    """Return the walls that hold a match, each once, in the order of the scan's lines, and how far each is its own.

    As far as it is not one with a wall before it in that order, 0 to 1.
    """
    of_wall = np.empty(len(scan), np.int64)
    own = np.empty(len(scan), np.float64)
    count = 0
    for i in range(len(scan)):
        w = matches[i].wall
        if w >= 0:
            nearest = math.inf  # along their chain
            known = False
            for k in range(count):
                v = of_wall[k]
                if v == w:
                    known = True
                    break
                if ties[v] >= 0.0 and ties[w] >= 0.0:
                    nearest = min(nearest, abs(ties[v] - ties[w]))
            if not known:
                of_wall[count] = w
                own[count] = 1.0 - math.exp(-2.0 * nearest)
                count += 1
    return of_wall[:count], own[:count]


@kernel
def squared_correlation(ties: Floats, one: int, other: int) -> float:
    """Return how much two walls are one, 0 to 1: the square of the correlation of their errors."""
    if one == other:
        return 1.0
    if ties[one] < 0.0 or ties[other] < 0.0:
        return 0.0
    return math.exp(-2.0 * abs(ties[one] - ties[other]))


@kernel
def sum_pairs(scan: Records, matches: Records, known_walls: KnownWalls, wall_variance: float, work: Workspace) -> None:
    """Fill the sums of `work` with all matches, walls off with that variance."""
    sum_pairs_without(scan, matches, known_walls, wall_variance, int(np.int64(-1)), work)


@kernel
def sum_pairs_without(
    scan: Records, matches: Records, known_walls: KnownWalls, wall_variance: float, without: int, work: Workspace
) -> None:
    """Fill the sums of `work` with the matches but those on a wall; -1 for none.

    Those on walls that are tied to it count the less, the more these are one wall with it.
    """
    empty_sums(work)
    walls = known_walls.walls
    ties = known_walls.ties
    held = work.held
    for i in range(len(scan)):
        w = matches[i].wall
        if w < 0:
            continue
        left = 1.0 if without < 0 else 1.0 - squared_correlation(ties, w, without)
        if left > 0.0:
            held[i] = w
            work.shifts_held[i] = matches[i].shift
            work.weights_held[i] = left * weight_on_wall(scan[i], wall_variance)
            update_pair(work, walls[w], scan[i], i, w, 1.0)
    eliminate_wall_errors(work, ties, wall_variance)


@kernel
def weight_on_wall(line: Record, wall_variance: float) -> float:
    """Return the weight of a scan line, 1/m^2, on walls that are so rough along themselves."""
    return 1.0 / (1.0 / line.weight - ROUGHNESS * ROUGHNESS + ROUGH_FRACTION * wall_variance)


@kernel
def registered_weights(scan: Records, matches: Records, ties: Floats, wall_variance: float, weights: Floats) -> None:
    """Write with what weight each line registers, (n,) 1/m^2, walls off with that variance; 0 where it is on none.

    Alone on its wall ``1 / (variance + wall_variance)``; lines on one wall share its error.
    """
    n = len(scan)
    for i in range(n):
        weights[i] = 0.0
        w = matches[i].wall
        if w < 0:
            continue
        # The information of all lines on the wall about its error, as far as walls are one.
        known = 0.0
        for j in range(n):
            v = matches[j].wall
            if v >= 0 and (v == w or (ties[v] >= 0.0 and ties[w] >= 0.0)):
                known += math.exp(-abs(ties[v] - ties[w])) / plain_variance(scan[j])
        weights[i] = 1.0 / (plain_variance(scan[i]) * (1.0 + wall_variance * known))


@kernel
def plain_variance(line: Record) -> float:
    """Return the variance of the offset of a scan line by its sigma, m^2, without any of the walls."""
    return max(1.0 / line.weight - ROUGHNESS * ROUGHNESS, LEAST_KNOWN_VARIANCE**2)
