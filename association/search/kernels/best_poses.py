"""Compiled list of the best poses so far."""

import numpy as np

from compiled import kernel
from registration.kernels import keep_alive
from registration.layout import Record, Records

from ...consensus.kernels.geometry import wrap
from ...consensus.kernels.priors import prior_value
from ...layout import FOUND, HARD_PRIOR
from ...scan.kernels.ordering import ascending
from ...tuning import INSIDE
from ..tables import SearchState


@kernel
def store(found: Records, best: Record, rules: Record, pose: Record, score: float, value: float) -> None:
    """Put a pose among the best, at most one within the distance and angle of `rules`; ties keep the earlier."""
    n = best.count
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
        best.count = n + 1
    else:
        place = worst
        if value <= found[worst].value:
            return
    found[place].value = value
    found[place].theta = pose.theta
    found[place].x = pose.x
    found[place].y = pose.y
    found[place].score = score
    if best.count == len(found):
        least = found[0].value
        for k in range(1, len(found)):
            least = min(least, found[k].value)
        best.least_value = least


@kernel
def floor_of(rules: Record, best: Record, bonus: float) -> float:
    """Return the score that a pose must reach to be stored, given the prior's bonus to it."""
    return max(rules.kept_share * best.best_value, best.least_value) - bonus


@kernel
def offer(found: Records, best: Record, rules: Record, prior: Record, pose: Record, score: float) -> None:
    """Store a refined pose if its score reaches the floor and it lies in the window of a hard prior."""
    bonus = prior_value(prior, pose)
    if prior.kind == HARD_PRIOR:
        if bonus < INSIDE:
            return
        bonus = 0.0
    if score <= 0.0 or score < floor_of(rules, best, bonus):
        return
    store(found, best, rules, pose, score, score + bonus)
    best.best_value = max(best.best_value, score + bonus)


@kernel
def best_first(of_bases: SearchState, of_slides: SearchState) -> Records:
    """Return the poses of bases and of slides, (k,) of `FOUND`, the best value first, ties as they were found."""
    first = of_bases.best[0].count
    n = first + of_slides.best[0].count
    losses = np.empty(n, np.float64)
    together = np.empty(n, FOUND)
    ordered = np.empty(n, FOUND)
    for k in range(n):
        if k < first:
            together[k] = of_bases.poses[k]
        else:
            together[k] = of_slides.poses[k - first]
        losses[k] = -together[k].value
    order = ascending(losses)
    for k in range(n):
        ordered[k] = together[order[k]]
    keep_alive(together)
    return ordered
