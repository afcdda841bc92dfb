"""Compiled ranking: candidate poses refined, scored with the lines of sight, and told apart."""

import math

import numpy as np

from compiled import kernel
from registration.kernels import invert3, keep_alive
from registration.layout import SYMMETRIC3, Floats, Records

from ...layout import BLOCKER, Integers
from ...tables import Blockers, Place, Question, Sights, Workspace
from ...tuning import FAR_BEHIND, LEAST_COUNT, START_ANGLE_VARIANCE, START_VARIANCE
from .consensus import one_step_cost, refine
from .matching import allow_all, match_scan, part_of_match, wrap
from .ordering import ascending
from .sight import count_blockers, sight_penalty


@kernel
def rank(
    question: Question,
    place: Place,
    sights: Sights,
    estimates: Records,
    merits: Records,
    matches: Records,
    work: Workspace,
) -> None:
    """Refine the candidate poses of `estimates` (k,) in place and score them with the lines of sight.

    The poses come best first. Writes their covariances, `merits` (k,) and `matches` (k, n). Where there are no sights
    there are no lines of sight.
    """
    scan = question.scan
    terms = question.terms[0]
    sums = work.scratch[0].sums
    sighted = len(sights.seen) > 0
    blockers = Blockers(np.zeros(len(place.walls), BLOCKER), np.empty(len(place.walls), np.int64))
    best = 0.0
    length = 0.0
    for i in range(len(scan)):
        length += scan[i].length
    allow_all(scan, work.possible)
    for k in range(len(estimates)):
        one = estimates[k]
        merit = merits[k]
        one.xx = START_VARIANCE
        one.xy = 0.0
        one.xt = 0.0
        one.yy = START_VARIANCE
        one.yt = 0.0
        one.tt = START_ANGLE_VARIANCE
        match_scan(scan, one, place, terms.gates, work.possible, 0.0, matches[k])
        merit.score = refine(scan, one, place, terms, matches[k], work, 0.0)
        merit.cost = work.scratch[0].value.cost if merit.score > 0.0 else 0.0
        merit.one_step_cost = one_step_cost(sums, one) if merit.score > 0.0 else 0.0
        det = sums.xx * sums.yy - sums.xy * sums.xy
        weight = sums.xx + sums.yy
        merit.reliability = min(1.0, 2.0 * math.sqrt(max(det, 0.0)) / weight) if weight > 0.0 else 0.0
        merit.length = 0.0
        merit.misfit = 0.0
        merit.blocked = 0.0
        merit.count = 0.0
        for i in range(len(scan)):
            match = matches[k, i]
            if match.wall >= 0:
                # What is hardly worth a match is one in part, so that none comes or goes at once.
                part = part_of_match(match)
                merit.length += part * scan[i].length
                merit.misfit += part * match.offset**2 / scan[i].plain_variance
                merit.count += part
        merit.share = merit.length / length
        merit.misfit /= max(LEAST_COUNT, merit.count)
        # The candidates come best first: what is far behind is no rival, its score may stay too good.
        if sighted and merit.score > best - FAR_BEHIND:
            count = count_blockers(sights, matches[k], one, place, blockers, work.scratch[0].ray)
            merit.blocked = sight_penalty(blockers, count, place.walls)
            merit.score -= merit.blocked
            best = max(best, merit.score)


@kernel
def distinct(
    poses: Records,
    merits: Records,
    beside: Floats,
    most: int,
    distance: float,
    angle: float,
    same_family: float,
    much_better: float,
) -> Integers:
    """Pick at most `most` poses without those that a better one stands for, that of the greatest value first.

    A pose stands for those that are near, within `distance` metres and `angle` radians, and for those that its own
    covariance does not tell from it, at less than `same_family` squared deviations: a family along a corridor is one
    explanation. It does not stand for one of its family with a score that is better by more than `much_better` nats: a
    prior may put that one behind it, and is contradicted by it. `poses` (k,) of `ESTIMATE`, `merits` (k,) of `MERIT`;
    what does not score is no explanation. The value is the score and what is `beside` it (k,), or (0,) where that is
    nothing; ties by place. Returns the places in them.
    """
    losses = np.empty(len(poses), np.float64)
    for k in range(len(poses)):
        value = merits[k].score + (beside[k] if len(beside) > 0 else 0.0)
        losses[k] = -value if merits[k].score > 0.0 else math.inf
    kept = np.empty(min(most, len(poses)), np.int64)
    informations = np.empty(len(kept), SYMMETRIC3)
    known = np.empty(len(kept), np.bool_)
    count = 0
    for i in ascending(losses):
        if count == len(kept) or losses[i] == math.inf:
            break
        stands = False
        for k in range(count):
            better = poses[kept[k]]
            x = poses[i].x - better.x
            y = poses[i].y - better.y
            turn = wrap(poses[i].theta - better.theta)
            if math.sqrt(x * x + y * y) < distance and abs(turn) < angle:
                stands = True
                break
            f = informations[k]
            square = f.xx * x * x + f.yy * y * y + f.tt * turn * turn
            square += 2.0 * (f.xy * x * y + f.xt * x * turn + f.yt * y * turn)
            if known[k] and square < same_family and merits[i].score <= merits[kept[k]].score + much_better:
                stands = True
                break
        if not stands:
            kept[count] = i
            known[count] = invert3(poses[i], informations[count])
            count += 1
    keep_alive(informations)
    return kept[:count]
