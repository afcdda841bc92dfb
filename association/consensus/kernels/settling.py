"""Compiled settling of an answer: its pose with the walls' own error estimated, and what it would be without a wall."""

import math

import numpy as np

from compiled import kernel
from registration.kernels import MAX_DEVIATION, invert3, joint_information, joint_solve, keep_alive
from registration.layout import Floats, Record, Records

from ...layout import ESTIMATE, Integers
from ...tables import KnownWalls, Question, Workspace
from ...tuning import (
    COMMON_WALL_ERROR,
    FREE_DEVIATION,
    LEAST_KNOWN_VARIANCE,
    LEAST_WALL_ERROR,
    ROUGH_SHARE,
    ROUGHNESS,
    SETTLING_ROUNDS,
    UNSEEN_ERROR,
    USUAL_WALL_ERROR,
    USUAL_WALLS,
)
from .consensus import change, solve, start_over, take_out_errors


@kernel
def settled_weight(line: Record, wall_variance: float) -> float:
    """Return the weight of a scan line, 1/m^2, on walls that are so rough along themselves."""
    return 1.0 / (1.0 / line.weight - ROUGHNESS * ROUGHNESS + ROUGH_SHARE * wall_variance)


@kernel
def weakest(covariance: Record) -> tuple[float, float, float]:
    """Return the position's deviation along its weakest direction, metres, and that unit direction."""
    middle = 0.5 * (covariance.xx + covariance.yy)
    half = 0.5 * (covariance.xx - covariance.yy)
    angle = 0.5 * math.atan2(covariance.xy, half)
    return math.sqrt(max(0.0, middle + math.hypot(half, covariance.xy))), math.cos(angle), math.sin(angle)


@kernel
def add_all(scan: Records, matches: Records, known_walls: KnownWalls, wall_variance: float, work: Workspace) -> None:
    """Fill the sums of `work` with all matches, walls off with that variance."""
    add_without(scan, matches, known_walls, wall_variance, -1, work)


@kernel
def add_without(
    scan: Records, matches: Records, known_walls: KnownWalls, wall_variance: float, without: int, work: Workspace
) -> None:
    """Fill the sums of `work` with the matches but those on a wall; -1 for none.

    Those on walls that are tied to it count the less, the more these are one wall with it.
    """
    start_over(work)
    walls = known_walls.walls
    ties = known_walls.ties
    held = work.held
    for i in range(len(scan)):
        w = matches[i].wall
        if w < 0:
            continue
        left = 1.0 if without < 0 else 1.0 - sameness(ties, w, without)
        if left > 0.0:
            held[i] = w
            work.shifts_held[i] = matches[i].shift
            work.weights_held[i] = left * settled_weight(scan[i], wall_variance)
            change(work, walls[w], scan[i], i, w, 1.0)
    take_out_errors(work, ties, wall_variance)


@kernel
def sameness(ties: Floats, one: int, other: int) -> float:
    """Return how much two walls are one, 0 to 1: the square of the correlation of their errors."""
    if one == other:
        return 1.0
    if ties[one] < 0.0 or ties[other] < 0.0:
        return 0.0
    return math.exp(-2.0 * abs(ties[one] - ties[other]))


@kernel
def copy_estimate(one: Record, other: Record) -> None:
    """Write the first to the second."""
    other.theta = one.theta
    other.x = one.x
    other.y = one.y
    other.xx = one.xx
    other.xy = one.xy
    other.xt = one.xt
    other.yy = one.yy
    other.yt = one.yt
    other.tt = one.tt


@kernel
def unlike(scan: Records, matches: Records, walls: Records, wall_variance: float) -> float:
    """Return how far the directions of the matched walls are from parallel, as a chi-square of the pairs' angles.

    With a_k the information of a pair's angle, that of the common direction from which ``sum a_k sin^2`` is least: the
    smaller eigenvalue of ``sum a_k d d'``.
    """
    xx = 0.0
    xy = 0.0
    yy = 0.0
    for i in range(len(scan)):
        w = matches[i].wall
        if w >= 0:
            angle = settled_weight(scan[i], wall_variance) * scan[i].spread
            xx += angle * walls[w].dx * walls[w].dx
            xy += angle * walls[w].dx * walls[w].dy
            yy += angle * walls[w].dy * walls[w].dy
    return max(0.0, 0.5 * (xx + yy) - math.hypot(0.5 * (xx - yy), xy))


@kernel
def estimated_variance(
    pose: Record, of_wall: Integers, own: Floats, wall_variance: float, usual: float, work: Workspace
) -> float:
    """Return the variance of the walls' own errors that their residuals show, shrunk to `usual` where walls are few.

    Each of the walls counts as far as it is one of its `own`, (k,).

    The mean residual of wall k, m_k, has the variance ``(V + 1 / s_k) (1 - h_k)`` at the pose that was fitted to all,
    with its leverage h_k. Hence V is about ``sum(m_k^2 - (1 - h_k) / s_k) / sum(1 - h_k)``; `USUAL_WALLS` more walls
    are taken to have shown `usual`.
    """
    shares = work.shares
    c = math.cos(pose.theta)
    s = math.sin(pose.theta)
    found = USUAL_WALLS * usual
    count = USUAL_WALLS
    for k in range(len(of_wall)):
        share = shares[of_wall[k]]
        mean = (share.c * c + share.s * s + share.x * pose.x + share.y * pose.y + share.one) / share.weight
        gx = share.x / share.weight
        gy = share.y / share.weight
        gt = (share.s * c - share.c * s) / share.weight
        variance = wall_variance + 1.0 / share.weight
        spread = gx * gx * pose.xx + gy * gy * pose.yy + gt * gt * pose.tt
        spread += 2.0 * (gx * gy * pose.xy + gx * gt * pose.xt + gy * gt * pose.yt)
        free = max(0.0, 1.0 - spread / variance)
        found += own[k] * (mean * mean - free / share.weight)
        count += own[k] * free
    # What so few walls show is uncertain itself: Student's t has that much more variance. And those that are farthest
    # off matched nothing.
    unsure = UNSEEN_ERROR * (1.0 + 2.0 / max(1.0, count - 2.0))
    return unsure * max(found / count, LEAST_WALL_ERROR**2)


@kernel
def walls_of(scan: Records, matches: Records, ties: Floats) -> tuple[Integers, Floats]:
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
def settle(
    question: Question, known_walls: KnownWalls, matches: Records, starts: Records, settled: Records, begin: int,
    hinges: Records, work: Workspace,
) -> int:  # fmt: skip
    """Work out the poses of consensus sets from `starts` (k,), with the error of the walls as their residuals show it.

    `matches` (k, n). Writes `settled` (k,) and, for the walls from number `begin` on that hold a match of the first
    set, as many `hinges` as there is room for; returns how many walls hold one.
    """
    count = 0
    for k in range(len(starts)):
        of_wall = find_pose(question.scan, known_walls, matches[k], starts[k], settled[k], work)
        if k == 0:
            count = len(of_wall)
            if len(hinges) > 0:
                leave_each_out(question, known_walls, matches[0], begin, settled, hinges, work)
        register_settled(question.scan, known_walls, matches[k], settled[k], work)
    return count


@kernel
def find_pose(
    scan: Records, known_walls: KnownWalls, matches: Records, start: Record, out: Record, work: Workspace
) -> Integers:
    """Write to `out`, a record of `SETTLED`, what a consensus set comes to; its sums hold all matches then.

    Returns the walls that hold a match.
    """
    walls = known_walls.walls
    known = known_walls.variance
    pose = out.pose
    information = work.scratch[0].information
    value = work.scratch[0].value
    sums = work.scratch[0].sums
    of_wall, own = walls_of(scan, matches, known_walls.ties)
    copy_estimate(start, pose)
    out.wall_variance = max(known, LEAST_KNOWN_VARIANCE) if known >= 0.0 else USUAL_WALL_ERROR**2
    for _ in range(1 if known >= 0.0 else SETTLING_ROUNDS):
        add_all(scan, matches, known_walls, out.wall_variance, work)
        if not solve(sums, pose, information, value):
            break
        if known < 0.0:
            out.wall_variance = estimated_variance(pose, of_wall, own, out.wall_variance, USUAL_WALL_ERROR**2, work)
    other = np.zeros(1, ESTIMATE)
    add_all(scan, matches, known_walls, max(out.wall_variance, COMMON_WALL_ERROR**2), work)
    copy_estimate(pose, other[0])
    solve(sums, other[0], information, value)
    out.weakest, out.dx, out.dy = weakest(other[0])
    keep_alive(other)
    count = 0
    for i in range(len(matches)):
        count += 1 if matches[i].wall >= 0 else 0
    out.parallel = unlike(scan, matches, walls, out.wall_variance) <= known_walls.parallel[count]
    add_all(scan, matches, known_walls, out.wall_variance, work)
    solve(sums, pose, information, value)
    return of_wall


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
        # What all lines on the wall know together of its error, as far as walls are one.
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


@kernel
def register_settled(scan: Records, known_walls: KnownWalls, matches: Records, out: Record, work: Workspace) -> None:
    """Move a settled pose to where its pairs register, with the covariance there, unless the pose is not fixed."""
    pose = out.pose
    if out.parallel or out.weakest > MAX_DEVIATION:
        return
    walls = known_walls.walls
    weights = np.empty(len(scan), np.float64)
    registered_weights(scan, matches, known_walls.ties, out.wall_variance, weights)
    start_over(work)
    for i in range(len(scan)):
        w = matches[i].wall
        if w >= 0:
            work.held[i] = w
            work.shifts_held[i] = matches[i].shift
            work.weights_held[i] = weights[i]
            change(work, walls[w], scan[i], i, w, 1.0)
    scratch = work.scratch[0]
    # What is fixed needs no spring.
    theta, x, y, _, _ = joint_solve(scratch.plain, pose.theta, False)
    joint_information(scratch.plain, theta, scratch.information)
    if invert3(scratch.information, pose):
        pose.theta = theta
        pose.x = x
        pose.y = y


@kernel
def leave_each_out(
    question: Question, known_walls: KnownWalls, matches: Records, begin: int, settled: Records, hinges: Records,
    work: Workspace,
) -> None:  # fmt: skip
    """Write what the settled pose would be without each of the walls from number `begin` on that `hinges` has room for.

    The sums hold all matches, and do so again.
    """
    scan = question.scan
    information = work.scratch[0].information
    value = work.scratch[0].value
    sums = work.scratch[0].sums
    pose = settled[0].pose
    wall_variance = settled[0].wall_variance
    one = np.zeros(1, ESTIMATE)
    without = one[0]
    of_wall, own = walls_of(scan, matches, known_walls.ties)
    for k in range(min(len(hinges), len(of_wall) - begin)):
        wall = of_wall[begin + k]
        add_without(scan, matches, known_walls, wall_variance, wall, work)
        copy_estimate(pose, without)
        hinge = hinges[k]
        hinge.wall = wall
        hinge.own = own[begin + k]
        moved = solve(sums, without, information, value)
        x = without.x - pose.x
        y = without.y - pose.y
        hinge.moves = math.hypot(x, y)
        hinge.deviation, hinge.dx, hinge.dy = weakest(without)
        if not moved:
            hinge.deviation = FREE_DEVIATION
        elif hinge.moves > hinge.deviation:
            hinge.dx = x / hinge.moves
            hinge.dy = y / hinge.moves
    add_all(scan, matches, known_walls, wall_variance, work)
    keep_alive(one)
