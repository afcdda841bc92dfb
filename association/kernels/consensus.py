"""Compiled growing and shrinking of the consensus set at a pose."""

import math

from registration.compiling import inlined, kernel
from registration.kernels import invert3, joint_add, joint_information, joint_solve
from registration.layout import Record, Records

from ..layout import Place, Workspace
from ..tuning import MAX_STEP, MAX_TURN, SPRING
from .matching import match_scan, wrap


@kernel
def turning(theta_var: float, gx: float, gy: float, covariance: Record) -> None:
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
def value_matches(scan: Records, matches: Records) -> float:
    """Give each match its worth, the gain less half its chi-square, at least 0 (clutter); return their sum, nats."""
    total = 0.0
    for i in range(len(scan)):
        matches[i].worth = 0.0
        if matches[i].wall >= 0:
            offset = matches[i].offset
            angle = math.asin(max(-1.0, min(1.0, matches[i].sine)))
            chi2 = offset * offset / scan[i].offset_variance + angle * angle / scan[i].angle_variance
            value = scan[i].gain * matches[i].overlap - 0.5 * chi2
            if value > 0.0:
                matches[i].worth = value
                total += value
            else:
                matches[i].wall = -1
    return total


@inlined
def hold(sums: Record, x: float, y: float, sign: float) -> None:
    """Add or remove the weak spring that holds a translation where it is."""
    sums.xx += sign * SPRING
    sums.yy += sign * SPRING
    sums.x1 -= sign * SPRING * x
    sums.y1 -= sign * SPRING * y
    sums.one += sign * SPRING * (x * x + y * y)


@kernel
def clear(sums: Record) -> None:
    """Set the sums to those of no pair."""
    sums.cc = 0.0
    sums.cs = 0.0
    sums.cx = 0.0
    sums.cy = 0.0
    sums.c1 = 0.0
    sums.ss = 0.0
    sums.sx = 0.0
    sums.sy = 0.0
    sums.s1 = 0.0
    sums.xx = 0.0
    sums.xy = 0.0
    sums.x1 = 0.0
    sums.yy = 0.0
    sums.y1 = 0.0
    sums.one = 0.0
    sums.wahba_cos = 0.0
    sums.wahba_sin = 0.0
    sums.count = 0.0


@kernel
def refine(
    scan: Records, estimate: Record, place: Place, gates: Record, matches: Records, work: Workspace, rounds: int
) -> float:
    """Grow and shrink the consensus set at a pose, solving anew each time; pose and covariance move in place.

    Pairs that come or go change the sums of `work` in constant time. Returns the score in nats; the consensus set stays
    in `matches`. A direction that no pair fixes is held where it is, and shows in the covariance.
    """
    walls = place.walls
    held = work.held
    sums = work.scratch[0].sums
    information = work.scratch[0].information
    n = len(scan)
    clear(sums)
    for i in range(n):
        held[i] = -1
    for _ in range(rounds):
        match_scan(scan, estimate, place, gates, 0.0, matches)
        changed = False
        for i in range(n):
            w = matches[i].wall
            if w != held[i]:
                changed = True
                if held[i] >= 0:
                    joint_add(sums, walls[held[i]], scan[i], scan[i].weight, -1.0)
                if w >= 0:
                    joint_add(sums, walls[w], scan[i], scan[i].weight, 1.0)
                held[i] = w
        if not changed:
            break
        if sums.count == 0.0:
            return 0.0  # of pairs that came and went the sums keep rounding, which fixes nothing
        x = estimate.x
        y = estimate.y
        hold(sums, x, y, 1.0)
        theta, tx, ty, _, _ = joint_solve(sums, estimate.theta, False)
        joint_information(sums, theta, information)
        hold(sums, x, y, -1.0)
        if not invert3(information, estimate):
            return 0.0
        if abs(wrap(theta - estimate.theta)) > MAX_TURN or (tx - x) ** 2 + (ty - y) ** 2 > MAX_STEP**2:
            # Nearly parallel pairs, one of them wrong, throw the crossing far away.
            break
        estimate.theta = theta
        estimate.x = tx
        estimate.y = ty
    match_scan(scan, estimate, place, gates, 0.0, matches)
    return value_matches(scan, matches)
