"""Rank the poses of a search as consensus sets: refined, scored with lines of sight, beams and prior, distinct."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from registration.layout import Floats, Records
from registration.values import value

from ..context import SearchContext
from ..deadline import CancelledError
from ..layout import ESTIMATE, MATCH, SET_SCORE, Integers
from ..options import MapsPrior
from ..tuning import DISTINCT_ANGLE, DISTINCT_DISTANCE, FEW_KEPT, INSIDE, MOST_LOOKED_AT
from .beams import beam_evidence_at, beam_score
from .consensus_set import ConsensusSet, poses_of
from .kernels.priors import prior_values
from .kernels.ranking import distinct_poses, score_candidates
from .tuning import (
    BEAM_FINALISTS,
    CONTRADICTION,
    FAR_BEHIND,
    FEW_BEAMS,
    LATE_CANDIDATES,
    LATE_FINALISTS,
    MOST_BEAMS,
    RANKED_AT_ONCE,
    SAME_FAMILY,
)

NO_PRIOR = np.zeros(0)


@value(frozen=True, slots=True)
class _Scored:
    """Candidates (k,) of `ESTIMATE`, their scores (k,) of `SET_SCORE`, and their matches (k, n) of `MATCH`."""

    estimates: Records
    scores: Records
    matches: Records

    def best(self, values: Floats, most: int) -> _Scored:
        """Return those with the greatest of some values (k,), in their order."""
        places = np.sort(np.argsort(-values, kind="stable")[:most])
        return _Scored(self.estimates[places], self.scores[places], self.matches[places])


def rank_candidates(context: SearchContext, poses: Records) -> list[ConsensusSet]:
    """Rank the poses of a search, (k,) with the fields of `POSE`, as scored consensus sets.

    1. Match the scan at each pose, refine pose and set, and score the set with the lines of sight.
    2. With raw beams: add their evidence, and move the best poses to where the beams fit.
    3. Add the prior.
    4. Leave out poses that a better one stands for.

    Returns
    -------
    list of ConsensusSet
        Those within the prior's window first, then by posterior; ties by the search's order.

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    if not len(poses):
        return []
    scored = _score(context, _estimates_of(poses))
    if context.with_beams:
        scored = _add_beams(context, scored)
    bonuses = NO_PRIOR if context.prior is None else _prior_values(context, scored.estimates)
    most = max(FEW_KEPT, context.options.max_alternatives + 1, context.index.least_kept)
    order = _distinct(scored, bonuses, most)
    return [_consensus_set(context, scored, bonuses, k) for k in order.tolist()]


def _estimates_of(poses: Records) -> Records:
    """Return poses as (k,) of `ESTIMATE`, without a covariance."""
    estimates = np.zeros(len(poses), ESTIMATE)
    for name in ("theta", "x", "y"):
        estimates[name] = poses[name]
    return estimates


def _consensus_set(context: SearchContext, scored: _Scored, bonuses: Floats, k: int) -> ConsensusSet:
    scores = scored.scores[k].item()
    posterior = scores[0] + (float(bonuses[k]) if len(bonuses) else 0.0)
    within = posterior >= INSIDE / 2
    return ConsensusSet.of(
        scored.estimates[k : k + 1],
        scores,
        scored.matches[k],
        posterior=scores[0] if within else posterior,
        inside=within or context.window is None,
    )


def score_again(context: SearchContext, sets: Sequence[ConsensusSet]) -> Floats:
    """Match and refine consensus sets again from their poses; return their scores without beams and prior, (k,) nats.

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    scores: Floats = _score(context, poses_of(sets)).scores["score"]
    return scores


def with_lines_of_sight(
    context: SearchContext, ranked: Sequence[ConsensusSet], others: Iterable[ConsensusSet]
) -> Iterator[ConsensusSet]:
    """Yield consensus sets charged for lines of sight, those within the window first, by posterior.

    The models of the verdict were fitted to scores without it for poses that are far behind. Scores that are returned
    include it, but for those that come after the deadline; sets whose score falls to zero are left out.

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    least = max((one.score for one in ranked), default=0.0) - FAR_BEHIND
    if not len(context.lines_of_sight.seen) or context.too_late_to_look:
        least = -math.inf
    waiting: list[ConsensusSet] = []
    for one in others:
        # No later posterior exceeds the one that it has without lines of sight.
        while waiting and _place(waiting[0]) <= _place(one):
            yield waiting.pop(0)
        unseen = one.blocked == 0.0 and one.score <= least
        seen = charge_for_sight(context, one) if unseen and not context.deadline.passed else one
        if seen.score > 0.0:
            waiting.append(seen)
            waiting.sort(key=_place)
    yield from waiting


def charge_for_sight(context: SearchContext, one: ConsensusSet) -> ConsensusSet:
    """Return a consensus set with the penalty of lines of sight."""
    blocked = float(_score(context, one.estimate.copy()).scores["blocked"][0])
    return replace(one, score=one.score - blocked, posterior=one.posterior - blocked, blocked=blocked)


def _place(one: ConsensusSet) -> tuple[bool, float]:
    """Return the key that orders consensus sets."""
    return not one.inside, -one.posterior


def _distinct(scored: _Scored, bonuses: Floats, most: int) -> Integers:
    """Return the places of the best `most`, those of the greatest score and prior (k,) together first."""
    return distinct_poses(
        scored.estimates, scored.scores, bonuses, most, DISTINCT_DISTANCE, DISTINCT_ANGLE, SAME_FAMILY, CONTRADICTION
    )


def _score(context: SearchContext, poses: Records) -> _Scored:
    """Refine poses (k,) of `ESTIMATE` in place and score their sets, with lines of sight unless there are beams.

    The first are scored also when the deadline has passed, so that there is an answer, without lines of sight where
    those take long; what it leaves unscored has the score 0.

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    k, place = len(poses), context.index.tables.place
    scored = _Scored(poses, np.zeros(k, SET_SCORE), np.zeros((k, len(context.lines.rows)), MATCH))
    # Between some poses the clock is looked at: of the best first there are usually few enough for one go.
    step = int(RANKED_AT_ONCE / (max(1, len(context.lines.rows)) * max(1.0, context.index.crowd)))
    step = max(1, min(step, int(MOST_LOOKED_AT / (1.0 + context.looks))))
    for begin in range(0, k, step):
        if context.deadline.cancelled or (begin > 0 and context.deadline.passed):
            break
        some = slice(begin, begin + step)
        parts = scored.estimates[some], scored.scores[some], scored.matches[some]
        sights = context.nothing_seen if context.too_late_to_look else context.lines_of_sight
        score_candidates(context.question_of_a_pose, place, sights, *parts, context.workspace)
    if context.deadline.cancelled:
        raise CancelledError
    return scored


def _add_beams(context: SearchContext, scored: _Scored) -> _Scored:
    """Add the evidence of raw beams to the scores, and move the best poses to where the beams fit."""
    finalists = BEAM_FINALISTS
    if context.deadline.passed:
        finalists = LATE_FINALISTS
        scored = scored.best(scored.scores["score"] + _prior_values(context, scored.estimates), LATE_CANDIDATES)
    by_few = scored.scores["score"] + beam_score(beam_evidence_at(context, scored.estimates, FEW_BEAMS, 0))
    best = np.argsort(-by_few, kind="stable")[:finalists]
    if context.window is not None:
        # Poses within the window are looked at, however good the poses outside are.
        within = np.argsort(-(by_few + _prior_values(context, scored.estimates)), kind="stable")[:finalists]
        best = np.concatenate([within, best[~np.isin(best, within)]])
    poses = scored.estimates[best]
    evidence = beam_evidence_at(context, poses, MOST_BEAMS, len(poses))
    final = _score(context, poses)
    for name in ("read", "passed"):
        final.scores[name] = evidence[name]
    final.scores["score"] = np.where(final.scores["score"] > 0.0, final.scores["score"] + beam_score(evidence), 0.0)
    return final


def _prior_values(context: SearchContext, poses: Records) -> Floats:
    """Return the score of each pose by the prior, nats."""
    values: Floats = prior_values(context.prior_record, poses)
    if isinstance(context.prior, MapsPrior):
        values += context.prior.of_maps[context.maps_at(poses)]
    return values
