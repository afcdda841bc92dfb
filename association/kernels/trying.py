"""Compiled trial of one pose: refused as early as can be, or refined and kept."""

import math

from registration.compiling import kernel
from registration.layout import Record, Records

from ..layout import HARD_PRIOR
from ..tables import Place, Question, Raster, Workspace
from ..tuning import TESTS_HYPOTHESIS, TESTS_REFINED, TESTS_REJECTED, WHOLE_OVERLAP, WINDOW_MARGIN, WINDOW_TURN
from .best_poses import floor_of, offer, prior_value
from .consensus import refine
from .matching import allow_all, match_scan, may_score, wrap


@kernel
def try_pose(
    question: Question, place: Place, raster: Raster, found: Records, tried: Records, progress: Record, work: Workspace
) -> int:
    """Score the pose of the workspace, given with its covariance; keep it if it is among the best.

    Where there is room in `tried` (k,) it is noted there instead, for `keep_tried`. Returns what it cost, in tests of a
    wall.
    """
    scan = question.scan
    terms = question.terms[0]
    gates = terms.gates
    rules = question.rules[0]
    prior = terms.prior
    pose = work.scratch[0].estimate
    progress.hypotheses += 1
    bonus = prior_value(prior, pose)
    if prior.kind == HARD_PRIOR:
        bonus = 0.0
        if (
            math.hypot(pose.x - prior.x, pose.y - prior.y) > prior.radius + WINDOW_MARGIN
            or abs(wrap(pose.theta - prior.theta)) > prior.angle + WINDOW_TURN
        ):
            return TESTS_REJECTED
    floor = floor_of(rules, progress, bonus) + progress.least_freedom
    possible = work.possible
    if gates.least_overlap < WHOLE_OVERLAP:
        allow_all(scan, possible)
    elif not may_score(scan, pose, work.spreads, work.shifts, raster, floor, possible):
        return TESTS_REJECTED
    most = math.inf
    if len(tried) > 0 and gates.least_overlap >= WHOLE_OVERLAP:
        most = 0.0
        for i in range(len(scan)):
            most += max(0.0, possible[i])
    matched = match_scan(scan, pose, place, gates, possible, floor, work.matches)
    if matched < 0.0:
        return TESTS_HYPOTHESIS
    progress.verified += 1
    # No prior makes up for what the set lacks.
    least = floor_of(rules, progress, 0.0) + progress.least_freedom
    score = refine(scan, pose, place, terms, work.matches, work, least)
    if len(tried) == 0:
        offer(found, progress, rules, prior, pose, score)
        return TESTS_REFINED
    one = tried[progress.tried]
    progress.tried += 1
    one.bonus = bonus
    one.possible = min(most, matched)
    one.score = score
    one.theta = pose.theta
    one.x = pose.x
    one.y = pose.y
    return TESTS_REFINED


@kernel
def keep_tried(question: Question, tried: Records, found: Records, progress: Record, work: Workspace) -> None:
    """Keep of the poses that were tried ahead of their turn what `try_pose` would have kept in their turn, in order.

    It would have known of better ones by then, and left off sooner, where `tried` (k,) shows how much was possible. A
    score that is kept comes of gains that it would not have left off at.
    """
    rules = question.rules[0]
    prior = question.terms[0].prior
    pose = work.scratch[0].estimate
    for k in range(len(tried)):
        one = tried[k]
        if one.possible < floor_of(rules, progress, one.bonus) + progress.least_freedom:
            continue
        progress.verified += 1
        pose.theta = one.theta
        pose.x = one.x
        pose.y = one.y
        offer(found, progress, rules, prior, pose, one.score)
