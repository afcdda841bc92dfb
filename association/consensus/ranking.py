"""Rank the poses of a search as consensus sets: refined, scored with beams and prior, distinct."""

from __future__ import annotations

import numpy as np

from registration.layout import Floats, Records

from ..context import SearchContext
from ..deadline import CancelledError
from ..layout import MATCH, RULE, SET_SCORE, record
from ..options import MapsPrior
from ..tables import ScoreRules
from ..tuning import DISTINCT_ANGLE, DISTINCT_DISTANCE, FEW_KEPT, INSIDE
from .beams import cast, evidence_of, penalty_of_sight, score_of_beams
from .consensus_set import ConsensusSet
from .kernels.distinct import pick_distinct
from .kernels.scoring import score_poses
from .tuning import (
    BEAM_FINALISTS,
    CONTRADICTION,
    FAR_BEHIND,
    FEW_BEAMS,
    FIRST_RANKED,
    LATE_FINALISTS,
    RANKED_AT_ONCE,
    SAME_FAMILY,
    START_ANGLE_VARIANCE,
    START_VARIANCE,
    WHOLE_SCORE,
)


def score(context: SearchContext, estimates: Records) -> tuple[Records, Records]:
    """Refine poses, (k,) of `ESTIMATE`, in place; return their scores, (k,) of `SET_SCORE`, and matches (k, n)."""
    k, n = len(estimates), len(context.lines.rows)
    scores, matches = np.zeros(k, SET_SCORE), np.zeros((k, n), MATCH)
    matches["wall"] = -1
    # Of the sensor's place; the pose is that of the scan's origin.
    (x, y), t = context.sensor, START_ANGLE_VARIANCE
    c, s = np.cos(estimates["theta"]), np.sin(estimates["theta"])
    x, y = c * x - s * y, s * x + c * y
    estimates["xx"], estimates["xy"], estimates["yy"] = (
        START_VARIANCE + t * y * y,
        -t * x * y,
        START_VARIANCE + t * x * x,
    )
    estimates["xt"], estimates["yt"], estimates["tt"] = t * y, -t * x, t
    rules = ScoreRules(record(RULE), False)
    step = max(2, int(RANKED_AT_ONCE / (max(1, n) * max(1.0, context.index.crowd))))
    for begin in range(0, k, step):
        if context.deadline.cancelled:
            raise CancelledError
        if begin and context.deadline.passed:
            break
        some = slice(begin, begin + step)
        # Of one pose the matches are written to the only row there is.
        score_poses(
            context.question, context.index.tables.place, estimates[some], rules, scores[some], matches[some],
            context.work,
        )  # fmt: skip
    return scores, matches


def rank(context: SearchContext, poses: Records) -> list[ConsensusSet]:
    """Rank the poses of a search, (k,) of `ESTIMATE`, as scored consensus sets.

    1. Refine and score each by its pairs.
    2. Score by the beams: those of the ranges, or the lines of sight of segments.
    3. Keep distinct ones, those within a hard prior's window first, the best first.
    """
    estimates = poses.copy()
    scores, matches = score(context, estimates)
    keep = np.flatnonzero(scores["score"] > 0.0)
    estimates, scores, matches = estimates[keep], scores[keep], matches[keep]
    if not len(keep):
        return []
    if context.with_beams:
        estimates, scores, matches, more = _with_ranges(context, estimates, scores, matches)
    else:
        estimates, scores, matches, more = _with_sight(context, estimates, scores, matches)
    totals = scores["score"] + more
    posteriors = totals + scores["value"] - scores["score"] + _map_priors(context, estimates)
    ranked = np.where(totals > 0.0, np.maximum(posteriors, 1e-9), 0.0)
    if context.window is not None:
        ranked += np.where((scores["inside"] > 0) & (totals > 0.0), INSIDE, 0.0)
    most = max(FEW_KEPT, context.options.max_alternatives + 1, context.index.least_kept)
    order = pick_distinct(
        context.at_sensor(estimates), ranked, most, DISTINCT_DISTANCE, DISTINCT_ANGLE, SAME_FAMILY, CONTRADICTION
    )
    parts = np.where(matches["wall"] >= 0, np.minimum(1.0, matches["score"] / WHOLE_SCORE), 0.0)
    return [
        ConsensusSet(
            estimate=estimates[k : k + 1],
            score=float(totals[k]),
            posterior=float(posteriors[k]),
            inside=bool(scores["inside"][k]),
            by_pairs=float(scores["score"][k]),
            matches=matches[k],
            parts=parts[k],
        )
        for k in order.tolist()
    ]


def _with_ranges(
    context: SearchContext, estimates: Records, scores: Records, matches: Records
) -> tuple[Records, Records, Records, Floats]:
    """Return the finalists by a few beams, with the terms of all beams."""
    finalists = LATE_FINALISTS if context.deadline.passed else BEAM_FINALISTS
    beams, prior = context.beams, scores["value"] - scores["score"]
    first = np.argsort(-scores["value"], kind="stable")[:FIRST_RANKED]
    few = beams.take(np.arange(0, len(beams), max(1, len(beams) // FEW_BEAMS)))
    by_few = scores["score"] + prior
    by_few[first] += score_of_beams(few, evidence_of(context, few, cast(context, few, estimates[first])))
    if context.window is not None:
        by_few += np.where(scores["inside"] > 0, INSIDE, 0.0)
    best = first[np.argsort(-by_few[first], kind="stable")[:finalists]]
    evidence = evidence_of(context, beams, cast(context, beams, estimates[best]))
    return estimates[best], scores[best], matches[best], score_of_beams(beams, evidence)


def _with_sight(
    context: SearchContext, estimates: Records, scores: Records, matches: Records
) -> tuple[Records, Records, Records, Floats]:
    """Return the poses that are not far behind, with their penalties of lines of sight."""
    order = np.argsort(-scores["value"], kind="stable")
    near = scores["value"][order] >= scores["value"][order[0]] - FAR_BEHIND
    near[: context.options.max_alternatives + 1] = True
    kept = np.sort(order[near])
    estimates, scores, matches = estimates[kept], scores[kept], matches[kept]
    table = cast(context, context.beams, estimates)
    return estimates, scores, matches, -penalty_of_sight(context, context.beams, table, matches)


def _map_priors(context: SearchContext, estimates: Records) -> Floats | float:
    """Return the logarithm of the prior probability of each pose's map, nats."""
    prior = context.prior
    return prior.of_maps[context.maps_at(estimates)] if isinstance(prior, MapsPrior) else 0.0
