"""Solve for the pose of a consensus set, and score the set: gains less half of chi-square and log-determinant."""

import math

from compiled import kernel
from registration.kernels import invert3, joint_cost, joint_information, joint_solve
from registration.layout import Record, Records

from ...tables import Place, Workspace
from ..tuning import MAX_STEP, MAX_TURN, SPRING
from .geometry import wrap
from .wall_errors import infer_wall_errors, residual_of_wall


@kernel
def covariance_about(theta_var: float, gx: float, gy: float, covariance: Record) -> None:
    """Write the covariance of a pose held at a point, and turning about it with `theta_var`.

    ``(gx, gy)`` is that point in the scan frame, rotated: the lever from the sensor to it.
    """
    covariance.xx = theta_var * gy * gy
    covariance.xy = -theta_var * gx * gy
    covariance.yy = theta_var * gx * gx
    covariance.xt = theta_var * gy
    covariance.yt = -theta_var * gx
    covariance.tt = theta_var


@kernel
def add_spring(sums: Record, x: float, y: float, sign: float) -> None:
    """Add or remove the weak spring that holds a translation where it is."""
    sums.xx += sign * SPRING
    sums.yy += sign * SPRING
    sums.x1 -= sign * SPRING * x
    sums.y1 -= sign * SPRING * y
    sums.one += sign * SPRING * (x * x + y * y)


@kernel
def solve_pose(sums: Record, estimate: Record, information: Record, terms: Record) -> bool:
    """Move a pose to the least chi-square of the sums, and write its covariance, its information and the chi-square.

    A direction that no pair fixes is held where it is. Returns False where the pose would go too far, and stays:
    nearly parallel pairs, one of them wrong, throw the crossing far away. Then the chi-square is that of the pose.
    """
    x = estimate.x
    y = estimate.y
    add_spring(sums, x, y, 1.0)
    theta, tx, ty, cost, _ = joint_solve(sums, estimate.theta, False)
    joint_information(sums, theta, information)
    add_spring(sums, x, y, -1.0)
    near = abs(wrap(theta - estimate.theta)) <= MAX_TURN and (tx - x) ** 2 + (ty - y) ** 2 <= MAX_STEP**2
    if not invert3(information, estimate):
        terms.chi_square = math.inf
        return False
    if not near:
        terms.chi_square = joint_cost(sums, estimate.theta, x, y)
        return False
    terms.chi_square = cost
    estimate.theta = theta
    estimate.x = tx
    estimate.y = ty
    return True


@kernel
def one_step_chi_square(sums: Record, estimate: Record) -> float:
    """Return what the sums cost at the paper's estimate: Wahba's rotation first, then the translation that fits it.

    Not what they cost at their optimum, and so no chi-square. A direction that no pair fixes is held where `estimate`
    is.
    """
    c, s = sums.wahba_cos, sums.wahba_sin
    size = math.hypot(c, s)
    if size <= 0.0:
        return joint_cost(sums, estimate.theta, estimate.x, estimate.y)
    c /= size
    s /= size
    xx = sums.xx + SPRING
    yy = sums.yy + SPRING
    x = SPRING * estimate.x - (c * sums.cx + s * sums.sx + sums.x1)
    y = SPRING * estimate.y - (c * sums.cy + s * sums.sy + sums.y1)
    det = xx * yy - sums.xy * sums.xy
    return joint_cost(sums, math.atan2(s, c), (yy * x - sums.xy * y) / det, (xx * y - sums.xy * x) / det)


@kernel
def discount_steps(scan: Records, matches: Records) -> None:
    """Reduce each gain by the penalty for steps between the walls under one straight line."""
    for i in range(len(scan)):
        match = matches[i]
        if match.wall >= 0 and match.uneven > 0.0:
            match.gain = max(0.0, match.gain - 0.5 * scan[i].weight * match.uneven)


@kernel
def score_pairs(
    scan: Records, estimate: Record, place: Place, wall_variance: float, matches: Records, work: Workspace
) -> float:
    """Score each match by what the set would lose without it at this pose; drop those without; return the sum of gains.

    The score of a match is its gain less half of the chi-square that goes with it. The wall's own error is taken out
    before and after. A match that scores nothing is clutter.
    """
    walls = place.walls
    wall_sums = work.wall_sums
    c = math.cos(estimate.theta)
    s = math.sin(estimate.theta)
    infer_wall_errors(work, place.ties, wall_variance, estimate)
    total = 0.0
    for i in range(len(scan)):
        match = matches[i]
        match.score = 0.0
        w = match.wall
        if w < 0:
            continue
        own_sums = wall_sums[w]
        wall = walls[w]
        weight = scan[i].weight
        x = c * scan[i].centroid_x - s * scan[i].centroid_y + estimate.x
        y = s * scan[i].centroid_x + c * scan[i].centroid_y + estimate.y
        off = wall.dx * y - wall.dy * x - wall.offset - match.shift
        cost = weight * (off * off + scan[i].spread * match.sine * match.sine)
        known = own_sums.weight + own_sums.other_weight
        sum_of_all = residual_of_wall(own_sums, c, s, estimate) + own_sums.other_sum
        cost -= sum_of_all * sum_of_all / known
        sum_of_all -= weight * off
        cost += sum_of_all * sum_of_all / (known - weight)
        score = match.gain - 0.5 * cost
        if score > 0.0:
            match.score = score
            total += match.gain
        else:
            match.wall = -1
    return total
