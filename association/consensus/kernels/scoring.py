"""Turn poses into scored consensus sets: match, solve, match again, drop what costs more than it gains, score."""

from __future__ import annotations

import math

from compiled import kernel
from registration.layout import Floats, Record, Records

from ...layout import HARD_PRIOR, NO_PRIOR
from ...tables import Place, Question, ScoreRules, ScoreWork
from ...tuning import INSIDE
from ..tuning import ROUNDS, SAME_SHIFT
from .geometry import log_determinant, prior_value
from .matching import match_lines
from .pairs import change_pair, scale_wall, solve_pose
from .wall_errors import eliminate, infer, list_walls, residual_of_wall

UNFIT, SOLVED, CHANGED = 0, 1, 2  # what refinement leaves of a pose; a changed set is not solved yet


@kernel
def score_poses(
    question: Question, place: Place, poses: Records, rules: ScoreRules, scores: Records, matches: Records,
    work: ScoreWork,
) -> tuple[int, int]:  # fmt: skip
    """Refine poses with their consensus sets, and score these; return how many were refined, and how many were kept.

    A pose that cannot reach the floor of `rules` gets the score 0. The score is the sum of gains less half of the
    chi-square, walls' own errors eliminated, less the log-determinant; the value is the score and the prior.

    Parameters
    ----------
    question : Question
    place : Place
    poses : (k,) of `ESTIMATE`
        Each with the covariance that gates are widened by; replaced by the refined ones. If `rules` want it, those
        that are kept come first, and their values.
    rules : ScoreRules
        The best value is written.
    scores : (k,) of `SET_SCORE`
        Written.
    matches : (k, n) or (1, n) of `MATCH`
        Written; of (1, n) the last one stays.
    work : ScoreWork
    """
    scan, rule = question.scan, rules.rule[0]
    prior, gates = question.terms[0].prior, question.terms[0].gates
    soft = prior.kind != NO_PRIOR and prior.kind != HARD_PRIOR
    refined = 0
    kept = 0
    for k in range(len(poses)):
        pose = poses[k]
        out = scores[k]
        found = matches[k if len(matches) > 1 else 0]
        out.score = 0.0
        out.value = 0.0
        bonus = prior_value(prior, pose) if soft else 0.0
        least = max(rule.kept_fraction * rule.best_value, rule.least_value)
        floor = least - bonus + rule.least_freedom if least > 0.0 else 0.0
        if match_lines(scan, gates, place, pose, found, floor, work.scratch[0]) < 0.0:
            continue
        refined += 1
        pose.unfit = 0
        left = refine(question, place, pose, found, floor, work)
        if left >= SOLVED:
            out.score = score_set(question, place, pose, found, floor, left == CHANGED, work)
        forget(work.held, work.wall_sums)
        if out.score > 0.0:
            bonus = prior_value(prior, pose)
            if prior.kind == HARD_PRIOR:
                # A search within the window stores nothing outside; a ranking lists that, too.
                if rule.within and bonus < INSIDE:
                    out.score = 0.0
                out.inside = bonus >= INSIDE
                bonus = 0.0
            else:
                out.inside = 1
            out.value = out.score + bonus
            if out.score < least - bonus:
                out.score = 0.0
        if out.score > 0.0:
            rule.best_value = max(rule.best_value, out.value)
            if rules.packed:
                poses[kept] = pose
                scores[kept].value = out.value
            kept += 1
    return refined, kept


@kernel
def refine(question: Question, place: Place, pose: Record, found: Records, floor: float, work: ScoreWork) -> int:
    """Change the set to the lines that match, solve for the pose, and match again; up to `ROUNDS` times."""
    scan = question.scan
    terms = question.terms[0]
    scratch = work.scratch[0]
    plain, angles = scratch.plain, scratch.angles
    for i in range(len(scan)):
        work.held[i].wall = -1
    scratch.plain = scratch.nothing
    angles.xx = 0.0
    angles.xy = 0.0
    angles.yy = 0.0
    rounds = 0
    last = False
    while True:
        changed = change_set(scan, place.walls, found, work.held, work.wall_sums, scratch)
        if plain.count == 0.0:
            return UNFIT
        if not changed or last:
            return CHANGED if changed else SOLVED
        moved = solve_set(place.ties, terms.model, pose, work)
        rounds += 1
        last = rounds == ROUNDS or not moved
        if match_lines(scan, terms.gates, place, pose, found, floor if last else 0.0, scratch) < 0.0:
            return UNFIT


@kernel
def solve_set(ties: Floats, model: Record, pose: Record, work: ScoreWork) -> bool:
    """Move a pose to where the pairs that are held lie best, the walls' own errors eliminated: see `solve_pose`."""
    scratch = work.scratch[0]
    count = list_walls(work.held, work.wall_sums, ties, work.listed)
    eliminate(work.wall_sums, ties, work.listed, count, model.wall_variance, scratch)
    parallel = work.parallel[int(scratch.plain.count)]
    return solve_pose(scratch.sums, scratch.angles, parallel, model, pose, scratch.solution)


@kernel
def change_set(
    scan: Records, walls: Records, found: Records, held: Records, wall_sums: Records, scratch: Record
) -> bool:
    """Change the pairs that are held to those that match, in constant time each; return whether any changed."""
    plain, angles = scratch.plain, scratch.angles
    changed = False
    for i in range(len(scan)):
        w = found[i].wall
        h = held[i].wall
        if w != h or (w >= 0 and abs(found[i].shift - held[i].shift) > SAME_SHIFT):
            changed = True
            if h >= 0:
                change_pair(plain, angles, wall_sums[h], walls[h], scan[i], held[i], -1.0)
            held[i].wall = w
            if w >= 0:
                held[i].shift = found[i].shift
                held[i].weight = scan[i].weight
                change_pair(plain, angles, wall_sums[w], walls[w], scan[i], held[i], 1.0)
    return changed


@kernel
def score_set(
    question: Question, place: Place, pose: Record, found: Records, floor: float, changed: bool, work: ScoreWork
) -> float:
    """Drop the pairs without which a set scores more, solve again where it changed, and return its score, nats."""
    scratch = work.scratch[0]
    plain = scratch.plain
    model = question.terms[0].model
    before = plain.count
    count = list_walls(work.held, work.wall_sums, place.ties, work.listed)
    infer(work.wall_sums, place.ties, work.listed, count, model.wall_variance, pose)
    gain = drop_pairs(question.scan, place.walls, pose, found, work.held, work.wall_sums, scratch)
    if not (plain.count > 0.0 and gain > 0.0 and gain >= floor):
        return 0.0
    if changed or plain.count < before:
        solve_set(place.ties, model, pose, work)
    solution = scratch.solution
    freedom = log_determinant(solution, model, math.cos(pose.theta), math.sin(pose.theta))
    return max(0.0, gain - 0.5 * solution.chi_square - freedom)


@kernel
def drop_pairs(
    scan: Records, walls: Records, pose: Record, found: Records, held: Records, wall_sums: Records, scratch: Record
) -> float:
    """Score each match by what the set would lose without it, drop those without; return what the others gain, nats."""
    plain, angles = scratch.plain, scratch.angles
    c, s = math.cos(pose.theta), math.sin(pose.theta)
    gain = 0.0
    for i in range(len(scan)):
        match = found[i]
        match.score = 0.0
        w = match.wall
        if w < 0:
            continue
        own = wall_sums[w]
        weight = scan[i].weight
        px = c * scan[i].centroid_x - s * scan[i].centroid_y + pose.x
        py = s * scan[i].centroid_x + c * scan[i].centroid_y + pose.y
        off = walls[w].dx * py - walls[w].dy * px - walls[w].offset - match.shift
        cost = weight * (off * off + scan[i].spread * match.sine * match.sine)
        known = own.weight + own.other_weight
        of_all = residual_of_wall(own, c, s, pose) + own.other_sum
        cost -= of_all * of_all / known
        of_all -= weight * off
        cost += of_all * of_all / (known - weight)
        match.score = max(0.0, match.gain - 0.5 * cost)
        if match.score > 0.0:
            gain += match.gain
        else:
            match.wall = -1
            change_pair(plain, angles, own, walls[w], scan[i], held[i], -1.0)
            held[i].wall = -1
    return gain


@kernel
def forget(held: Records, wall_sums: Records) -> None:
    """Leave the sums of walls as those of no pair."""
    for i in range(len(held)):
        if held[i].wall >= 0:
            scale_wall(wall_sums[held[i].wall], 0.0)
            wall_sums[held[i].wall].count = 0.0
