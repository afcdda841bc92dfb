"""Score the candidate poses of a search, and keep distinct ones."""

import math

import numpy as np

from compiled import kernel
from registration.kernels import invert3, keep_alive
from registration.layout import SYMMETRIC3, Floats, Record, Records

from ...layout import BLOCKER, Integers
from ...scan.kernels.ordering import ascending
from ...tables import Blockers, Place, Question, Sights, Workspace
from ..tuning import FAR_BEHIND, LEAST_COUNT, START_ANGLE_VARIANCE, START_VARIANCE
from .geometry import wrap
from .matching import allow_all, match_scan, part_of_match
from .refinement import refine
from .scoring import one_step_chi_square
from .sight import count_blockers, sight_penalty


@kernel
def score_candidates(
    question: Question,
    place: Place,
    sights: Sights,
    estimates: Records,
    scores: Records,
    matches: Records,
    work: Workspace,
) -> None:
    """Turn each candidate pose into a scored consensus set.

    1. Match the scan at the pose.
    2. Refine pose and set until both agree, and score the set.
    3. Measure the set: its length and misfit.
    4. Charge it for the walls that lines of sight pass through; not where it is far behind.

    Parameters
    ----------
    question : Question
    place : Place
    sights : Sights
        Without any there are no lines of sight.
    estimates : (k,) of `ESTIMATE`
        The poses, best first; they move in place, and get their covariances.
    scores : (k,) of `SET_SCORE`
        Written to.
    matches : (k, n) of `MATCH`
        Written to.
    work : Workspace
    """
    scan = question.scan
    terms = question.terms[0]
    sighted = len(sights.seen) > 0
    blockers = Blockers(np.zeros(len(place.walls), BLOCKER), np.empty(len(place.walls), np.int64))
    best = 0.0
    allow_all(scan, work.possible)
    for k in range(len(estimates)):
        one = estimates[k]
        out = scores[k]
        start_at(one)
        match_scan(scan, one, place, terms.gates, work.possible, 0.0, matches[k])
        out.score = refine(scan, one, place, terms, matches[k], work, 0.0)
        measure_sums(work.scratch[0].sums, work.scratch[0].terms, one, out)
        measure_matches(scan, matches[k], out)
        out.blocked = 0.0
        # The candidates come best first: a candidate far behind is no alternative, its score may stay too good.
        if sighted and out.score > best - FAR_BEHIND:
            count = count_blockers(sights, matches[k], one, place, blockers, work.scratch[0].ray)
            out.blocked = sight_penalty(blockers, count, place.walls)
            out.score -= out.blocked
            best = max(best, out.score)


@kernel
def start_at(estimate: Record) -> None:
    """Write the covariance that a candidate pose starts with."""
    estimate.xx = START_VARIANCE
    estimate.xy = 0.0
    estimate.xt = 0.0
    estimate.yy = START_VARIANCE
    estimate.yt = 0.0
    estimate.tt = START_ANGLE_VARIANCE


@kernel
def measure_sums(sums: Record, terms: Record, estimate: Record, out: Record) -> None:
    """Write the chi-square of a refined set, and that at the paper's estimate."""
    out.chi_square = terms.chi_square if out.score > 0.0 else 0.0
    out.one_step_chi_square = one_step_chi_square(sums, estimate) if out.score > 0.0 else 0.0


@kernel
def measure_matches(scan: Records, matches: Records, out: Record) -> None:
    """Write how much of a scan is matched, and how far that is off; a match that scores little counts in part.

    So none comes or goes at once.
    """
    length = 0.0
    out.length = 0.0
    out.misfit = 0.0
    out.count = 0.0
    for i in range(len(scan)):
        length += scan[i].length
        match = matches[i]
        if match.wall >= 0:
            part = part_of_match(match)
            out.length += part * scan[i].length
            out.misfit += part * match.offset**2 / scan[i].plain_variance
            out.count += part
    out.fraction = out.length / length
    out.misfit /= max(LEAST_COUNT, out.count)


@kernel
def distinct_poses(
    poses: Records,
    scores: Records,
    bonuses: Floats,
    most: int,
    distance: float,
    angle: float,
    same_family: float,
    much_better: float,
) -> Integers:
    """Pick at most `most` poses without those that a better one stands for, the greatest sum first.

    A pose stands for those that are near, within `distance` metres and `angle` radians. It also stands for those that
    its own covariance does not distinguish from it, at less than `same_family` squared deviations: a family along a
    corridor is one explanation. It does not stand for one of its family with a score that is better by more than
    `much_better` nats: a prior may put that one behind it, and is contradicted by it.

    `poses` (k,) of `ESTIMATE`, `scores` (k,) of `SET_SCORE`; a pose without a score is no explanation. Summed are the
    score and what the prior adds, `bonuses` (k,), or (0,) without a prior. Returns the places in them; ties by place.
    """
    losses = np.empty(len(poses), np.float64)
    for k in range(len(poses)):
        total = scores[k].score + (bonuses[k] if len(bonuses) > 0 else 0.0)
        losses[k] = -total if scores[k].score > 0.0 else math.inf
    kept = np.empty(min(most, len(poses)), np.int64)
    informations = np.empty(len(kept), SYMMETRIC3)
    known = np.empty(len(kept), np.bool_)
    count = 0
    for i in ascending(losses):
        if count == len(kept) or losses[i] == math.inf:
            break
        same = False
        for k in range(count):
            better = poses[kept[k]]
            if is_near(poses[i], better, distance, angle):
                same = True
                break
            of_family = known[k] and squared_deviations(poses[i], better, informations[k]) < same_family
            if of_family and scores[i].score <= scores[kept[k]].score + much_better:
                same = True
                break
        if not same:
            kept[count] = i
            known[count] = invert3(poses[i], informations[count])
            count += 1
    keep_alive(informations)
    return kept[:count]


@kernel
def is_near(one: Record, other: Record, distance: float, angle: float) -> bool:
    """Return whether two poses are within `distance` metres and `angle` radians."""
    x = one.x - other.x
    y = one.y - other.y
    return math.sqrt(x * x + y * y) < distance and abs(wrap(one.theta - other.theta)) < angle


@kernel
def squared_deviations(one: Record, other: Record, information: Record) -> float:
    """Return the squared Mahalanobis distance of two poses by the information of the second one."""
    x = one.x - other.x
    y = one.y - other.y
    turn = wrap(one.theta - other.theta)
    square = information.xx * x * x + information.yy * y * y + information.tt * turn * turn
    square += 2.0 * (information.xy * x * y + information.xt * x * turn + information.yt * y * turn)
    return square
