"""Compiled scores of hypotheses: each is rejected as early as possible, or matched, refined and stored."""

import math

from compiled import kernel
from registration.layout import Record, Records

from ...consensus.kernels.geometry import wrap
from ...consensus.kernels.matching import match_scan
from ...consensus.kernels.priors import prior_value
from ...consensus.kernels.raster import may_score
from ...consensus.kernels.refinement import refine
from ...consensus.kernels.scoring import covariance_about
from ...layout import HARD_PRIOR
from ...tables import MapTables, Place, Question, Workspace
from ..tables import SearchState
from ..tuning import WHOLE_OVERLAP, WINDOW_MARGIN, WINDOW_TURN
from .best_poses import floor_of, offer


@kernel
def score_hypotheses(question: Question, tables: MapTables, count: int, state: SearchState, work: Workspace) -> bool:
    """Score the first `count` hypotheses of the workspace, in order; store those among the best poses.

    1. Set the score that each has to reach.
    2. Reject those that cannot reach it by what lies near their segments.
    3. Match, refine and store the others one by one.

    Returns False if the search has to end before the last one.
    """
    stop = state.stop
    statistics = state.statistics[0]
    set_floors(question, count, state.best[0], work)
    reject(question, tables, count, work)
    for k in range(count):
        if stop[0] != 0:
            return False
        statistics.hypotheses += 1
        if work.hypotheses[k].possible:
            score_hypothesis(question, tables.place, k, state, work)
    return True


@kernel
def set_floors(question: Question, count: int, best: Record, work: Workspace) -> None:
    """Write the score that each hypothesis has to reach, inf outside the window of a hard prior."""
    prior = question.terms[0].prior
    for k in range(count):
        one = work.hypotheses[k]
        one.bonus = 0.0 if prior.kind == HARD_PRIOR else prior_value(prior, one)
        one.floor = floor_of(question.rules[0], best, one.bonus) + best.least_freedom
        if prior.kind == HARD_PRIOR and not is_about(prior, one):
            one.floor = math.inf


@kernel
def is_about(prior: Record, pose: Record) -> bool:
    """Return whether a pose may be refined into the window of a hard prior."""
    near = math.hypot(pose.x - prior.x, pose.y - prior.y) <= prior.radius + WINDOW_MARGIN
    return near and abs(wrap(pose.theta - prior.theta)) <= prior.angle + WINDOW_TURN


@kernel
def reject(question: Question, tables: MapTables, count: int, work: Workspace) -> None:
    """Write which hypotheses may reach their floors, and which scan lines may lie on a wall there."""
    scan = question.scan
    hypotheses = work.hypotheses
    if question.terms[0].gates.least_overlap >= WHOLE_OVERLAP:
        may_score(scan, hypotheses, count, work.spreads, work.shifts, work.later, tables.raster, work.near)
        return
    # A midpoint may then lie on no wall.
    for k in range(count):
        hypotheses[k].possible = hypotheses[k].floor < math.inf
        for i in range(len(scan)):
            work.near[i, k] = 1


@kernel
def score_hypothesis(question: Question, place: Place, k: int, state: SearchState, work: Workspace) -> None:
    """Match and refine the k-th hypothesis of the workspace as far as it may still be stored."""
    scan = question.scan
    terms = question.terms[0]
    rules = question.rules[0]
    best = state.best[0]
    one = work.hypotheses[k]
    pose = work.scratch[0].estimate
    pose.theta = one.theta
    pose.x = one.x
    pose.y = one.y
    covariance_about(one.angle_variance, one.lever_x, one.lever_y, pose)
    # An earlier hypothesis may have scored more than the best value when the floors were set.
    floor = floor_of(rules, best, one.bonus) + best.least_freedom
    if most_possible(scan, k, work) < floor:
        return
    if match_scan(scan, pose, place, terms.gates, work.possible, floor, work.matches) < 0.0:
        return
    state.statistics[0].verified += 1
    # A prior does not make up for a score of the set that is too low.
    least = floor_of(rules, best, 0.0) + best.least_freedom
    score = refine(scan, pose, place, terms, work.matches, work, least)
    offer(state.poses, best, rules, terms.prior, pose, score)


@kernel
def most_possible(scan: Records, k: int, work: Workspace) -> float:
    """Write what each scan line may gain at the k-th hypothesis, -1 for nothing; return the sum, nats."""
    possible = work.possible
    total = 0.0
    for i in range(len(scan)):
        possible[i] = scan[i].gain if work.near[i, k] else -1.0
        # Counts as in `may_score`, so that the result does not depend on which hypotheses are scored together.
        if work.shifts[i] >= 0:
            total += max(0.0, possible[i])
    return total
