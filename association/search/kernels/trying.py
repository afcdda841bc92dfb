"""Compiled trial of poses: refused as early as can be, or refined and kept."""

import math

from compiled import kernel
from registration.layout import Record, Records

from ...consensus.kernels.consensus import refine, turning
from ...consensus.kernels.matching import match_scan, may_score, wrap
from ...layout import HARD_PRIOR
from ...tables import MapTables, Place, Question, Workspace
from ...tuning import TESTS_HYPOTHESIS, TESTS_REFINED, TESTS_REJECTED, WHOLE_OVERLAP, WINDOW_MARGIN, WINDOW_TURN
from .best_poses import floor_of, offer, prior_value


@kernel
def try_poses(
    question: Question,
    tables: MapTables,
    count: int,
    found: Records,
    progress: Record,
    work: Workspace,
    budget: int,
) -> tuple[int, bool]:
    """Score the first `count` poses of the workspace, in order; keep them if they are among the best.

    Returns what it cost, in tests of a wall, and whether `budget` was used up: then `progress` stands behind the last
    one tried.
    """
    scan = question.scan
    posed = work.posed
    terms = question.terms[0]
    prior = terms.prior
    for k in range(count):
        one = posed[k]
        one.bonus = 0.0 if prior.kind == HARD_PRIOR else prior_value(prior, one)
        one.floor = floor_of(question.rules[0], progress, one.bonus) + progress.least_freedom
        if prior.kind == HARD_PRIOR and not is_about(prior, one):
            one.floor = math.inf
    if terms.gates.least_overlap >= WHOLE_OVERLAP:
        may_score(scan, posed, count, work.spreads, work.shifts, work.later, tables.raster, work.near)
    else:
        for k in range(count):
            posed[k].possible = posed[k].floor < math.inf
            for i in range(len(scan)):
                work.near[i, k] = 1
    pose = work.scratch[0].estimate
    spent = 0
    for k in range(count):
        one = posed[k]
        progress.hypotheses += 1
        if one.possible:
            pose.theta = one.theta
            pose.x = one.x
            pose.y = one.y
            turning(one.angle_variance, one.lever_x, one.lever_y, pose)
            spent += _match_and_refine(question, tables.place, k, found, progress, work)
        else:
            spent += TESTS_REJECTED
        if spent > budget:
            progress.anchor = one.anchor
            progress.step = one.step
            progress.entry = one.entry
            return spent, True
    return spent, False


@kernel
def is_about(prior: Record, pose: Record) -> bool:
    """Tell whether a pose may be refined into the window of a hard prior."""
    near = math.hypot(pose.x - prior.x, pose.y - prior.y) <= prior.radius + WINDOW_MARGIN
    return near and abs(wrap(pose.theta - prior.theta)) <= prior.angle + WINDOW_TURN


@kernel
def _match_and_refine(
    question: Question, place: Place, k: int, found: Records, progress: Record, work: Workspace
) -> int:
    """Match the pose of the workspace, which is the k-th of its poses to be tried, as far as it may still be kept."""
    scan = question.scan
    terms = question.terms[0]
    rules = question.rules[0]
    one = work.posed[k]
    possible = work.possible
    pose = work.scratch[0].estimate
    # Of the poses tried before it one may have been better than what was known when it was looked at.
    floor = floor_of(rules, progress, one.bonus) + progress.least_freedom
    most = 0.0
    for i in range(len(scan)):
        possible[i] = scan[i].gain if work.near[i, k] else -1.0
        # As `may_score` counts, wherever a search was interrupted between the two.
        if work.shifts[i] >= 0:
            most += max(0.0, possible[i])
    if most < floor:
        return TESTS_REJECTED if terms.gates.least_overlap >= WHOLE_OVERLAP else TESTS_HYPOTHESIS
    matched = match_scan(scan, pose, place, terms.gates, possible, floor, work.matches)
    if matched < 0.0:
        return TESTS_HYPOTHESIS
    progress.verified += 1
    # No prior makes up for what the set lacks.
    least = floor_of(rules, progress, 0.0) + progress.least_freedom
    score = refine(scan, pose, place, terms, work.matches, work, least)
    offer(found, progress, rules, terms.prior, pose, score)
    return TESTS_REFINED
