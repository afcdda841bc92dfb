"""Estimate the pose of a consensus set together with how far the map's walls are off."""

import math

import numpy as np

from compiled import kernel
from registration.kernels import MAX_DEVIATION, invert3, joint_information, joint_solve, keep_alive
from registration.layout import Record, Records

from ...layout import ESTIMATE, Integers
from ...tables import KnownWalls, Question, Workspace
from ..tuning import COMMON_WALL_ERROR, ESTIMATION_ROUNDS, FREE_DEVIATION, LEAST_KNOWN_VARIANCE, USUAL_WALL_ERROR
from .pair_sums import empty_sums, update_pair
from .reliability import fixes_pose
from .scoring import solve_pose
from .wall_variance import (
    distinct_walls,
    registered_weights,
    sum_pairs,
    sum_pairs_without,
    wall_variance_shown,
)


@kernel
def estimate_poses(
    question: Question, known_walls: KnownWalls, matches: Records, starts: Records, estimated: Records, begin: int,
    leverages: Records, work: Workspace,
) -> int:  # fmt: skip
    """Estimate the poses of consensus sets from `starts` (k,), with the error of the walls as their residuals show it.

    `matches` (k, n). Writes `estimated` (k,). Writes as many `leverages` as there is room for, for the walls from
    number `begin` on that hold a match of the first set. Returns how many walls hold one.
    """
    count = 0
    for k in range(len(starts)):
        of_wall = estimate_pose(question.scan, known_walls, matches[k], starts[k], estimated[k], work)
        if k == 0:
            count = len(of_wall)
            if len(leverages) > 0:
                leave_walls_out(question, known_walls, matches[0], begin, estimated, leverages, work)
        register_pose(question.scan, known_walls, matches[k], estimated[k], work)
    return count


@kernel
def estimate_pose(
    scan: Records, known_walls: KnownWalls, matches: Records, start: Record, out: Record, work: Workspace
) -> Integers:
    """Write to `out`, a record of `ESTIMATED`, the pose of a consensus set and how well it is fixed.

    Returns the walls that hold a match. The sums hold all matches then.
    """
    known = known_walls.variance
    pose = out.pose
    information = work.scratch[0].information
    terms = work.scratch[0].terms
    sums = work.scratch[0].sums
    of_wall, own = distinct_walls(scan, matches, known_walls.ties)
    copy_estimate(start, pose)
    out.wall_variance = max(known, LEAST_KNOWN_VARIANCE) if known >= 0.0 else USUAL_WALL_ERROR**2
    for _ in range(1 if known >= 0.0 else ESTIMATION_ROUNDS):
        sum_pairs(scan, matches, known_walls, out.wall_variance, work)
        if not solve_pose(sums, pose, information, terms):
            break
        if known < 0.0:
            out.wall_variance = wall_variance_shown(pose, of_wall, own, out.wall_variance, USUAL_WALL_ERROR**2, work)
    find_weakest_direction(scan, known_walls, matches, out, work)
    sum_pairs(scan, matches, known_walls, out.wall_variance, work)
    solve_pose(sums, pose, information, terms)
    out.parallel = not fixes_pose(work)
    return of_wall


@kernel
def find_weakest_direction(
    scan: Records, known_walls: KnownWalls, matches: Records, out: Record, work: Workspace
) -> None:
    """Write to `out` how well the pose is fixed with walls off by centimetres."""
    other = np.zeros(1, ESTIMATE)
    sum_pairs(scan, matches, known_walls, max(out.wall_variance, COMMON_WALL_ERROR**2), work)
    copy_estimate(out.pose, other[0])
    scratch = work.scratch[0]
    solve_pose(scratch.sums, other[0], scratch.information, scratch.terms)
    out.weakest, out.dx, out.dy = weakest_direction(other[0])
    keep_alive(other)


@kernel
def register_pose(scan: Records, known_walls: KnownWalls, matches: Records, out: Record, work: Workspace) -> None:
    """Move an estimated pose to where its pairs register, with the covariance there, unless the pose is not fixed."""
    pose = out.pose
    if out.parallel or out.weakest > MAX_DEVIATION:
        return
    walls = known_walls.walls
    weights = np.empty(len(scan), np.float64)
    registered_weights(scan, matches, known_walls.ties, out.wall_variance, weights)
    empty_sums(work)
    for i in range(len(scan)):
        w = matches[i].wall
        if w >= 0:
            work.held[i] = w
            work.shifts_held[i] = matches[i].shift
            work.weights_held[i] = weights[i]
            update_pair(work, walls[w], scan[i], i, w, 1.0)
    scratch = work.scratch[0]
    # A pose that is fixed needs no spring.
    theta, x, y, _, _ = joint_solve(scratch.plain, pose.theta, False)
    joint_information(scratch.plain, theta, scratch.information)
    if invert3(scratch.information, pose):
        pose.theta = theta
        pose.x = x
        pose.y = y


@kernel
def leave_walls_out(
    question: Question, known_walls: KnownWalls, matches: Records, begin: int, estimated: Records, leverages: Records,
    work: Workspace,
) -> None:  # fmt: skip
    """Write what the estimated pose would be without each of the walls, from number `begin` on.

    As many as `leverages` has room for. The sums hold all matches, and do so again.
    """
    scan = question.scan
    information = work.scratch[0].information
    terms = work.scratch[0].terms
    sums = work.scratch[0].sums
    pose = estimated[0].pose
    wall_variance = estimated[0].wall_variance
    one = np.zeros(1, ESTIMATE)
    without = one[0]
    of_wall, own = distinct_walls(scan, matches, known_walls.ties)
    for k in range(min(len(leverages), len(of_wall) - begin)):
        wall = of_wall[begin + k]
        sum_pairs_without(scan, matches, known_walls, wall_variance, wall, work)
        copy_estimate(pose, without)
        moved = solve_pose(sums, without, information, terms)
        leverages[k].wall = wall
        leverages[k].own = own[begin + k]
        write_leverage(pose, without, moved, leverages[k])
    sum_pairs(scan, matches, known_walls, wall_variance, work)
    keep_alive(one)


@kernel
def write_leverage(pose: Record, without: Record, moved: bool, out: Record) -> None:
    """Write to a record of `LEVERAGE` how far a pose is from the one without a wall, and how sharp that one is.

    Unless that one `moved` to where its pairs cost least: then nothing fixes it.
    """
    x = without.x - pose.x
    y = without.y - pose.y
    out.displacement = math.hypot(x, y)
    out.deviation, out.dx, out.dy = weakest_direction(without)
    if not moved:
        out.deviation = FREE_DEVIATION
    elif out.displacement > out.deviation:
        out.dx = x / out.displacement
        out.dy = y / out.displacement


@kernel
def weakest_direction(covariance: Record) -> tuple[float, float, float]:
    """Return the position's deviation along its weakest direction, metres, and that unit direction."""
    middle = 0.5 * (covariance.xx + covariance.yy)
    half = 0.5 * (covariance.xx - covariance.yy)
    angle = 0.5 * math.atan2(covariance.xy, half)
    return math.sqrt(max(0.0, middle + math.hypot(half, covariance.xy))), math.cos(angle), math.sin(angle)


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
