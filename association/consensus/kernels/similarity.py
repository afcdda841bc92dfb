"""Fit a similarity to the pairs of a consensus set: its pose where the map is off by a factor.

Let ``a = f cos theta`` and ``b = f sin theta``. The sums of a set are `x' Q x` of `x = [a, b, t_x, t_y, 1]`, as of a
pose. The condition ``a^2 + b^2 = 1`` of a pose does not hold, so that the solution of linear equations minimizes them.
"""

import math

from compiled import kernel
from registration.layout import Floats, Record, Records

from ...layout import Integers
from ...tables import KnownWalls, Question, Workspace
from ..tuning import ESTIMATION_ROUNDS, LEAST_WALL_ERROR, UNSEEN_ERROR, USUAL_WALL_ERROR, USUAL_WALLS
from .wall_variance import distinct_walls, sum_pairs

LEAST_FIXED = 1e-9  # determinant over squared trace, rounding


@kernel
def solve_similarity(sums: Record, solution: Floats, covariance: Floats) -> bool:
    """Write the a, b, t_x, t_y of which the sums cost least, (4,), and their covariance, (4, 4).

    The translation is eliminated first. False where they are not fixed; then nothing is written.
    """
    xx = sums.xx
    yy = sums.yy
    xy = sums.xy
    det = xx * yy - xy * xy
    if not det > LEAST_FIXED * (xx + yy) ** 2:
        return False
    kxc = (yy * sums.cx - xy * sums.cy) / det
    kyc = (xx * sums.cy - xy * sums.cx) / det
    kxs = (yy * sums.sx - xy * sums.sy) / det
    kys = (xx * sums.sy - xy * sums.sx) / det
    kx1 = (yy * sums.x1 - xy * sums.y1) / det
    ky1 = (xx * sums.y1 - xy * sums.x1) / det
    cc = sums.cc - sums.cx * kxc - sums.cy * kyc
    cs = sums.cs - sums.cx * kxs - sums.cy * kys
    ss = sums.ss - sums.sx * kxs - sums.sy * kys
    c1 = sums.c1 - sums.cx * kx1 - sums.cy * ky1
    s1 = sums.s1 - sums.sx * kx1 - sums.sy * ky1
    left = cc * ss - cs * cs
    if not left > LEAST_FIXED * (cc + ss) ** 2:
        return False
    covariance[0, 0] = ss / left
    covariance[0, 1] = -cs / left
    covariance[1, 1] = cc / left
    covariance[1, 0] = covariance[0, 1]
    a = -(covariance[0, 0] * c1 + covariance[0, 1] * s1)
    b = -(covariance[0, 1] * c1 + covariance[1, 1] * s1)
    solution[0] = a
    solution[1] = b
    solution[2] = -(kxc * a + kxs * b + kx1)
    solution[3] = -(kyc * a + kys * b + ky1)
    for j in range(2):
        covariance[2, j] = -(kxc * covariance[0, j] + kxs * covariance[1, j])
        covariance[3, j] = -(kyc * covariance[0, j] + kys * covariance[1, j])
        covariance[j, 2] = covariance[2, j]
        covariance[j, 3] = covariance[3, j]
    covariance[2, 2] = yy / det - kxc * covariance[0, 2] - kxs * covariance[1, 2]
    covariance[3, 3] = xx / det - kyc * covariance[0, 3] - kys * covariance[1, 3]
    covariance[2, 3] = -xy / det - kxc * covariance[0, 3] - kxs * covariance[1, 3]
    covariance[3, 2] = covariance[2, 3]
    return True


@kernel
def variance_left(
    solution: Floats, covariance: Floats, of_wall: Integers, own: Floats, wall_variance: float, work: Workspace
) -> tuple[float, float]:
    """Return the variance of the walls' own errors that their residuals show, as `wall_variance_shown` does of a pose.

    Walls were off by `wall_variance` where the similarity was solved. Returns how many walls are left to show it, too.
    """
    wall_sums = work.wall_sums
    found = USUAL_WALLS * USUAL_WALL_ERROR**2
    count = USUAL_WALLS
    for k in range(len(of_wall)):
        one = wall_sums[of_wall[k]]
        g = (one.c / one.weight, one.s / one.weight, one.x / one.weight, one.y / one.weight)
        mean = one.one / one.weight
        spread = 0.0
        for i in range(4):
            mean += g[i] * solution[i]
            for j in range(4):
                spread += g[i] * g[j] * covariance[i, j]
        free = max(0.0, 1.0 - spread / (wall_variance + 1.0 / one.weight))
        found += own[k] * (mean * mean - free / one.weight)
        count += own[k] * free
    unsure = UNSEEN_ERROR * (1.0 + 2.0 / max(1.0, count - 2.0))
    return unsure * max(found / count, LEAST_WALL_ERROR**2), count - USUAL_WALLS


@kernel
def estimate_similarity(
    question: Question, known_walls: KnownWalls, matches: Records, solution: Floats, covariance: Floats, work: Workspace
) -> tuple[float, float]:
    """Fit a similarity to a consensus set, walls off as their residuals show it.

    Writes a, b, t_x, t_y, (4,), and their covariance, (4, 4); returns the variance of a wall's error, or -1 where no
    similarity is fixed, and how many walls more there are than it takes.
    """
    scan = question.scan
    sums = work.scratch[0].sums
    of_wall, own = distinct_walls(scan, matches, known_walls.ties)
    wall_variance = USUAL_WALL_ERROR**2
    used = wall_variance
    more = 0.0
    for _ in range(ESTIMATION_ROUNDS + 1):
        sum_pairs(scan, matches, known_walls, wall_variance, work)
        if not solve_similarity(sums, solution, covariance):
            return -1.0, 0.0
        used = wall_variance
        wall_variance, more = variance_left(solution, covariance, of_wall, own, wall_variance, work)
    if solution[0] == 0.0 and solution[1] == 0.0:
        return -1.0, 0.0
    return used, more


@kernel
def pose_of_similarity(solution: Floats, covariance: Floats, pose: Record) -> tuple[float, float]:
    """Write the pose of a similarity, with its covariance; return the factor and its variance."""
    a = solution[0]
    b = solution[1]
    factor = math.hypot(a, b)
    c = a / factor
    s = b / factor
    pose.theta = math.atan2(b, a)
    pose.x = solution[2]
    pose.y = solution[3]
    pose.xx = covariance[2, 2]
    pose.xy = covariance[2, 3]
    pose.yy = covariance[3, 3]
    pose.xt = (c * covariance[2, 1] - s * covariance[2, 0]) / factor
    pose.yt = (c * covariance[3, 1] - s * covariance[3, 0]) / factor
    turn = s * s * covariance[0, 0] - 2.0 * c * s * covariance[0, 1] + c * c * covariance[1, 1]
    pose.tt = turn / (factor * factor)
    spread = c * c * covariance[0, 0] + 2.0 * c * s * covariance[0, 1] + s * s * covariance[1, 1]
    return factor, spread
