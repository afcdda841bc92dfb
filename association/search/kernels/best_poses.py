"""Compiled list of the best poses so far, and what a prior says of a pose."""

import numpy as np

from compiled import kernel
from registration.layout import Floats, Record, Records

from ...consensus.kernels.matching import wrap
from ...layout import HARD_PRIOR, NO_PRIOR
from ...tuning import INSIDE, SOFT_FLOOR


@kernel
def prior_value(prior: Record, pose: Record) -> float:
    """Return what the prior says of a pose, nats: at most 0 for a soft one, `INSIDE` or 0 for a hard one."""
    if prior.kind == NO_PRIOR:
        return 0.0
    dx = pose.x - prior.x
    dy = pose.y - prior.y
    turn = wrap(pose.theta - prior.theta)
    if prior.kind == HARD_PRIOR:
        return INSIDE if dx * dx + dy * dy <= prior.radius * prior.radius and abs(turn) <= prior.angle else 0.0
    square = (
        prior.xx * dx * dx
        + 2.0 * prior.xy * dx * dy
        + 2.0 * prior.xt * dx * turn
        + prior.yy * dy * dy
        + 2.0 * prior.yt * dy * turn
        + prior.tt * turn * turn
    )
    return max(SOFT_FLOOR, -0.5 * square)


@kernel
def prior_values(prior: Records, poses: Records) -> Floats:
    """Return what the prior (1,) says of each of the poses (k,), nats."""
    values = np.empty(len(poses), np.float64)
    for k in range(len(poses)):
        values[k] = prior_value(prior[0], poses[k])
    return values


@kernel
def keep(found: Records, progress: Record, rules: Record, pose: Record, score: float, value: float) -> None:
    """Put a pose among the best, at most one within the distance and angle of `rules`; ties keep the earlier."""
    n = progress.count
    near = -1
    worst = 0
    for k in range(n):
        if (
            abs(found[k].x - pose.x) < rules.distinct_distance
            and abs(found[k].y - pose.y) < rules.distinct_distance
            and abs(wrap(found[k].theta - pose.theta)) < rules.distinct_angle
            and (near < 0 or found[k].value > found[near].value)
        ):
            near = k
        if found[k].value < found[worst].value:
            worst = k
    if near >= 0:
        place = near
        if value <= found[near].value:
            return
    elif n < len(found):
        place = n
        progress.count = n + 1
    else:
        place = worst
        if value <= found[worst].value:
            return
    found[place].value = value
    found[place].theta = pose.theta
    found[place].x = pose.x
    found[place].y = pose.y
    found[place].score = score
    if progress.count == len(found):
        least = found[0].value
        for k in range(1, len(found)):
            least = min(least, found[k].value)
        progress.least_kept = least


@kernel
def floor_of(rules: Record, progress: Record, bonus: float) -> float:
    """Return the score that a pose must reach to be kept, given what the prior says of it."""
    return max(rules.kept_share * progress.best_value, progress.least_kept) - bonus


@kernel
def offer(found: Records, progress: Record, rules: Record, prior: Record, pose: Record, score: float) -> None:
    """Keep a refined pose if it is worth it."""
    bonus = prior_value(prior, pose)
    if prior.kind == HARD_PRIOR:
        if bonus < INSIDE:
            return
        bonus = 0.0
    if score <= 0.0 or score < floor_of(rules, progress, bonus):
        return
    keep(found, progress, rules, pose, score, score + bonus)
    progress.best_value = max(progress.best_value, score + bonus)
