"""The candidates in order: refined, scored with the lines of sight and the prior, and distinct."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from registration import RigidTransform
from registration.layout import Records
from registration.values import value

from ..context import SearchContext
from ..deadline import CancelledError
from ..layout import BEAM, BEAM_EVIDENCE, ESTIMATE, MATCH, MERIT, Integers
from ..options import Estimator
from ..search.candidates import Candidates
from ..tables import Rays
from ..tuning import (
    BEAM_FINALISTS,
    BEAMS_PASSED,
    BEAMS_READ,
    CONTRADICTION,
    DISTINCT_ANGLE,
    DISTINCT_DISTANCE,
    FAR_BEHIND,
    FEW_BEAMS,
    INSIDE,
    LATE_CANDIDATES,
    LATE_FINALISTS,
    LEAST_DISTINCT,
    MOST_BEAMS,
    MOST_LOOKED_AT,
    RANKED_AT_ONCE,
    SAME_FAMILY,
)
from .kernels import ranking as kernels
from .kernels.beams import weigh_beams
from .kernels.priors import prior_values

Floats = NDArray[np.float64]
NOTHING = np.zeros(0)

_rank, _distinct_places = kernels.rank, kernels.distinct


@value(frozen=True, slots=True)
class Ranked:
    """One explanation of the scan.

    Attributes
    ----------
    estimate : (1,) of `ESTIMATE`
        Index frame from scan frame; the covariance has the model's slack in it.
    score : float
        Log-likelihood over that of a scan that is all clutter, nats; without the prior.
    value : float
        Score and prior together.
    inside : bool
        Whether it lies within a hard prior's window; True without one.
    cost : float
        The joint cost in the score, which takes half of it: a chi-square.
    one_step_cost : float
        What the same sums cost at the paper's estimate, Wahba's rotation first.
    length : float
        Of the matched segments together, metres.
    share : float
        Of the scan's length that is matched.
    reliability : float
        Eq. (28).
    misfit : float
        Mean squared offset over what the sigmas alone expect.
    blocked : float
        What lines of sight speak against it, nats, in the score.
    read, passed : float
        Shares of the beams that read the wall they should, and that passed through one; 0 without beams.
    count : float
        Rows of the scan that are matched; those that hardly are count in part.
    matches : (n,) of `MATCH`
        By row of the scan.
    """

    estimate: Records
    score: float
    value: float
    inside: bool
    cost: float
    one_step_cost: float
    length: float
    share: float
    reliability: float
    misfit: float
    blocked: float
    read: float
    passed: float
    count: float
    matches: Records

    @classmethod
    def of(cls, estimate: Records, merit: tuple[float, ...], matches: Records, *, value: float, inside: bool) -> Ranked:
        """Return what a record of `MERIT`, as a tuple, says; its arguments otherwise by name."""
        score, cost, one_step_cost, length, share, reliability, misfit, blocked, read, passed, count = merit
        sums, seen = (cost, one_step_cost), (length, share, reliability, misfit, blocked)
        return cls(estimate, score, value, inside, *sums, *seen, read, passed, count, matches)

    @property
    def pose(self) -> RigidTransform:
        """Index frame from scan frame."""
        theta, x, y, *_ = self.estimate[0].item()
        return RigidTransform(x, y, theta)

    @property
    def merit(self) -> tuple[float, ...]:
        """The same numbers in the order of `MERIT`."""
        sums = self.score, self.cost, self.one_step_cost
        seen = self.length, self.share, self.reliability, self.misfit, self.blocked
        return *sums, *seen, self.read, self.passed, self.count

    @property
    def by_segments(self) -> float:
        """The score without the beams' part."""
        return self.score - BEAMS_READ * self.read + BEAMS_PASSED * self.passed

    def score_by(self, estimator: Estimator) -> float:
        """Return the score by the sums at an estimator's pose; that of the joint one orders and judges."""
        return self.score if estimator == "joint" else self.score + 0.5 * (self.cost - self.one_step_cost)

    @property
    def covariance(self) -> Floats:
        """Of additive (x, y, theta), (3, 3)."""
        _, _, _, xx, xy, xt, yy, yt, tt = self.estimate[0].item()
        return np.array((xx, xy, xt, xy, yy, yt, xt, yt, tt)).reshape(3, 3)

    @property
    def deviation(self) -> float:
        """Standard deviation of the position along its weakest direction, metres."""
        _, _, _, xx, xy, _, yy, _, _ = self.estimate[0].item()
        return math.sqrt(0.5 * (xx + yy) + math.hypot(0.5 * (xx - yy), xy))

    @property
    def matched(self) -> NDArray[np.bool_]:
        """Which rows of the scan are matched, (n,)."""
        found: NDArray[np.bool_] = self.matches["wall"] >= 0
        return found


@value(frozen=True, slots=True)
class _Scored:
    """Candidates (k,) of `ESTIMATE`, what they are worth (k,) of `MERIT`, their matches (k, n) of `MATCH`."""

    estimates: Records
    merits: Records
    matches: Records

    def best(self, values: Floats, most: int) -> _Scored:
        """Return those with the greatest of some values (k,), in their order."""
        places = np.sort(np.argsort(-values, kind="stable")[:most])
        return _Scored(self.estimates[places], self.merits[places], self.matches[places])


def rank_candidates(context: SearchContext, candidates: Candidates) -> list[Ranked]:
    """Refine and order the candidates: within the prior's window first, then by value; ties by the search's order."""
    if not len(candidates.poses):
        return []
    estimates = np.zeros(len(candidates.poses), ESTIMATE)
    for name in ("theta", "x", "y"):
        estimates[name] = candidates.poses[name]
    scored = _score(context, estimates)
    if context.with_beams:
        scored = _weigh_beams(context, scored)
    beside = NOTHING if context.prior is None else _prior_values(context, scored.estimates)
    most = max(LEAST_DISTINCT, context.options.max_alternatives + 1)
    order = _distinct(scored, beside, most)
    windowed = context.window is not None
    explanations = []
    for place, merit in zip(order.tolist(), scored.merits[order].tolist(), strict=True):
        value = merit[0] + (float(beside[place]) if len(beside) else 0.0)
        within = value >= INSIDE / 2
        inside = within or not windowed
        value = merit[0] if within else value
        estimate, matches = scored.estimates[place : place + 1], scored.matches[place]
        explanations.append(Ranked.of(estimate, merit, matches, value=value, inside=inside))
    return explanations


def match_again(context: SearchContext, explanations: Sequence[Ranked]) -> Records:
    """Match explanations anew, refined from where they are; return what their segments are worth then, (k,) of `MERIT`.

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    return _score(context, poses_of(explanations)).merits


def with_lines_of_sight(
    context: SearchContext, explanations: Sequence[Ranked], others: Iterable[Ranked]
) -> Iterator[Ranked]:
    """Yield some of the explanations with what lines of sight speak against them, within the window first, by value.

    The models of the verdict were fitted to scores without it for poses that are far behind. Scores that are returned
    include it, but for those that come after the deadline; explanations whose score falls to zero are left out.

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    least = max((one.score for one in explanations), default=0.0) - FAR_BEHIND
    if not len(context.lines_of_sight.seen) or context.too_late_to_look:
        least = -math.inf
    waiting: list[Ranked] = []
    for one in others:
        # No later value exceeds the one that it has without lines of sight.
        while waiting and _place(waiting[0]) <= _place(one):
            yield waiting.pop(0)
        unseen = one.blocked == 0.0 and one.score <= least
        seen = _charged(context, one) if unseen and not context.deadline.passed else one
        if seen.score > 0.0:
            waiting.append(seen)
            waiting.sort(key=_place)
    yield from waiting


def _charged(context: SearchContext, one: Ranked) -> Ranked:
    """Return an explanation with what lines of sight speak against it."""
    blocked = float(_score(context, one.estimate.copy()).merits["blocked"][0])
    return replace(one, score=one.score - blocked, value=one.value - blocked, blocked=blocked)


def _place(one: Ranked) -> tuple[bool, float]:
    """Return what orders explanations."""
    return not one.inside, -one.value


def poses_of(explanations: Sequence[Ranked]) -> Records:
    """Return the poses of explanations for the kernels, (k,) of `ESTIMATE`."""
    return np.frombuffer(bytearray().join(one.estimate.tobytes() for one in explanations), ESTIMATE)


def matches_of(explanations: Sequence[Ranked]) -> Records:
    """Return the matches of explanations for the kernels, (k, n) of `MATCH`."""
    together = bytearray().join(one.matches.tobytes() for one in explanations)
    return np.frombuffer(together, MATCH).reshape(len(explanations), -1)


def _distinct(scored: _Scored, beside: Floats, most: int) -> Integers:
    """Return the places of the best `most`, those of the greatest value first: score, and what is `beside` it (k,)."""
    return _distinct_places(
        scored.estimates, scored.merits, beside, most, DISTINCT_DISTANCE, DISTINCT_ANGLE, SAME_FAMILY, CONTRADICTION
    )


def _score(context: SearchContext, poses: Records) -> _Scored:
    """Refine poses (k,) of `ESTIMATE` in place and score their sets, with lines of sight unless there are beams.

    The first are scored also when the deadline has passed, so that there is an answer, without lines of sight where
    those take long; what it leaves unscored is worth nothing.

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    k, place = len(poses), context.index.tables.place
    scored = _Scored(poses, np.zeros(k, MERIT), np.zeros((k, len(context.lines.rows)), MATCH))
    # Between some poses the clock is looked at: of the best first there are usually few enough for one go.
    step = int(RANKED_AT_ONCE / (max(1, len(context.lines.rows)) * max(1.0, context.index.crowd)))
    step = max(1, min(step, int(MOST_LOOKED_AT / (1.0 + context.looks))))
    for begin in range(0, k, step):
        if context.deadline.cancelled or (begin > 0 and context.deadline.passed):
            break
        some = slice(begin, begin + step)
        parts = scored.estimates[some], scored.merits[some], scored.matches[some]
        sights = context.nothing_seen if context.too_late_to_look else context.lines_of_sight
        _rank(context.question_of_a_pose, place, sights, *parts, context.workspace)
    if context.deadline.cancelled:
        raise CancelledError
    return scored


def _weigh_beams(context: SearchContext, scored: _Scored) -> _Scored:
    """Add what the raw beams say to the scores, and move the best poses to where the beams fit."""
    finalists = BEAM_FINALISTS
    if context.deadline.passed:
        finalists = LATE_FINALISTS
        scored = scored.best(scored.merits["score"] + _prior_values(context, scored.estimates), LATE_CANDIDATES)
    by_few = scored.merits["score"] + _nats(beam_evidence_at(context, scored.estimates, FEW_BEAMS, 0))
    best = np.argsort(-by_few, kind="stable")[:finalists]
    if context.window is not None:
        # What lies within the window is looked at, however good the poses outside are.
        within = np.argsort(-(by_few + _prior_values(context, scored.estimates)), kind="stable")[:finalists]
        best = np.concatenate([within, best[~np.isin(best, within)]])
    poses = scored.estimates[best]
    evidence = beam_evidence_at(context, poses, MOST_BEAMS, len(poses))
    final = _score(context, poses)
    for name in ("read", "passed"):
        final.merits[name] = evidence[name]
    final.merits["score"] = np.where(final.merits["score"] > 0.0, final.merits["score"] + _nats(evidence), 0.0)
    return final


def _prior_values(context: SearchContext, poses: Records) -> Floats:
    """Return what the prior says of each pose, nats."""
    values: Floats = prior_values(context.prior_record, poses)
    return values


def _nats(evidence: Records) -> Floats:
    """Return what beams say of each pose, over one where none reads what it should."""
    return np.asarray(BEAMS_READ * evidence["read"] - BEAMS_PASSED * evidence["passed"])


def beam_evidence_at(context: SearchContext, poses: Records, most: int, refined: int) -> Records:
    """Return what at most `most` of the beams say of each pose, (k,) of `BEAM_EVIDENCE`.

    Moves the first `refined` of the poses. What the deadline leaves, and all where rays cannot be followed, is 0.
    """
    evidence, rays, place = np.zeros(len(poses), BEAM_EVIDENCE), rays_of(context, most), context.index.tables.place
    step = max(1, int(MOST_LOOKED_AT / (1.0 + context.looks)))
    for begin in range(0, len(poses) if context.can_look else 0, step):
        if begin > 0 and context.deadline.passed:
            break
        some, moved = slice(begin, begin + step), max(0, refined - begin)
        weigh_beams(rays, poses[some], place, moved, context.workspace, evidence[some])
    return evidence


def rays_of(context: SearchContext, most: int) -> Rays:
    """Return at most `most` of the beams of which something is known, evenly spread."""
    beams = context.scan.beams
    assert beams is not None
    known = np.flatnonzero(~np.isnan(beams.ranges))
    chosen = known[:: max(1, math.ceil(len(known) / most))]
    begins = (context.scan.viewpoint or (0.0, 0.0)) if beams.origins is None else beams.origins[chosen].T
    return Rays(beam_rows(begins, beams.angles[chosen], beams.ranges[chosen]), beams.range_max)


def beam_rows(begins: ArrayLike, angles: Floats, ranges: Floats) -> Records:
    """Return beams as records (n,) of `BEAM`, of where they begin, (2,) for all of them or (2, n), m."""
    rows = np.empty(len(angles), BEAM)
    rows["x"], rows["y"] = np.asarray(begins)
    rows["dx"], rows["dy"], rows["range"] = np.cos(angles), np.sin(angles), ranges
    return rows
