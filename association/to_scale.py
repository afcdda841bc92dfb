"""A search where scan and map differ by a factor near one, as with a drawing that was scaled by hand.

Such a map puts far walls off by much and near ones by little. A pose makes up for part of it: the place is found, some
decimetres off, and a covariance that takes walls to be off one by one says centimetres. The sums of what matched know
the factor, if they are not held to one; with the scan's lengths multiplied by it the search finds what it missed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from registration import wrap_angle
from registration.values import value

from .consensus.acceptance import register_accepted
from .consensus.ranking import Ranked, rank_candidates
from .consensus.similarity import Similarity, fit_similarity
from .context import SearchContext
from .explain import search_and_explain
from .explanations import Explanations
from .scan.scan import scaled
from .search.candidates import Candidates, find_candidates
from .tuning import (
    DISTINCT_ANGLE,
    DOUBTING_DEVIATIONS,
    DOUBTING_WALLS,
    FACTOR_DEVIATIONS,
    FACTOR_GAP,
    FACTOR_ROUNDS,
    FACTOR_WALLS,
    LEAST_AS_SENT,
    LEAST_FACTOR,
    LEAST_OFF_WALLS,
    LOOSE_RIVALS,
    MOST_FACTOR,
    RIVAL_FACTOR,
    RIVAL_SCALES,
    SAME_PLACE,
)


@dataclass(frozen=True, slots=True)
class Factor:
    """What the lengths of a scan have to be multiplied with.

    Attributes
    ----------
    value : float
    deviation : float
        Its standard deviation.
    """

    value: float
    deviation: float


@value(frozen=True, slots=True)
class Explained:
    """What a search found, and what it searched.

    Attributes
    ----------
    context : SearchContext
        With the scan to scale.
    explanations : Explanations
    as_sent : Explanations
        Of the scan as it was sent; the same where it is not put to scale.
    factor : Factor or None
        By which the scan was put to scale; None where it is as it was sent.
    off_scale : bool
        Whether it is as it was sent, and what matched says that it is off by more than a scan is put to scale.
    """

    context: SearchContext
    explanations: Explanations
    as_sent: Explanations
    factor: Factor | None = None
    off_scale: bool = False

    @property
    def score(self) -> float:
        """Of its answer, nats; 0 where there is none."""
        return 0.0 if self.explanations.answer is None else self.explanations.answer.best.score


def put_to_scale(context: SearchContext, as_sent: Explanations) -> Explained:
    """Search a scan again to scale, where its best explanation says that it is not, and keep what fits much better.

    Parameters
    ----------
    context : SearchContext
    as_sent : Explanations
        Of the scan as it was sent.

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    first = Explained(context, as_sent, as_sent)
    if not _may_be_off(first):
        return first
    similarity = _similarity(first)
    found = _search_to_scale(first, similarity)
    if found.factor is None:
        return replace(first, off_scale=similarity is not None and is_far_off(similarity))
    rivals = beside(found.explanations, _at_their_scales(first, found))
    return _with_what_is_not_known(replace(found, explanations=rivals))


def _may_be_off(first: Explained) -> bool:
    """Tell whether a factor may matter, and nothing but the pose was solved for, and all that was.

    What is off its walls by millimetres leaves nothing to a factor; nor does a map of which the caller says how good
    it is.
    """
    context, answer = first.context, first.explanations.answer
    if answer is None or answer.settled.views is not None or context.options.estimator != "joint":
        return False
    return context.index.sigma is None and answer.settled.wall_sigma >= LEAST_OFF_WALLS


def _search_to_scale(first: Explained, similarity: Similarity | None) -> Explained:
    """Search again with the factor of a similarity, until it is right; what fits no better is left as it was."""
    found, factor = first, 1.0
    for _ in range(FACTOR_ROUNDS):
        if similarity is None or not is_off(similarity):
            break
        factor *= similarity.factor
        if not abs(factor - 1.0) <= MOST_FACTOR:
            break
        again = _at_scale(first.context, factor)
        explanations = search_and_explain(again)
        stretched = Explained(again, explanations, first.explanations, Factor(factor, similarity.deviation))
        fitted = _similarity(stretched)
        # A factor that no more walls fix than it takes lets the sides of a room fit those of any other.
        if fitted is None or fitted.more < FACTOR_WALLS or stretched.score <= found.score + FACTOR_GAP:
            break
        found, similarity = stretched, fitted
    return found


def _at_scale(context: SearchContext, factor: float) -> SearchContext:
    """Prepare the search of a stretched scan; the origin of its frame, whose pose is asked, stays where it is."""
    scan = scaled(context.scan, factor)
    return SearchContext.of(context.index, scan, context.prior, context.options, context.deadline)


def _similarity(found: Explained) -> Similarity | None:
    answer = found.explanations.answer
    return None if answer is None else fit_similarity(found.context, answer.best)


def is_off(similarity: Similarity) -> bool:
    """Tell whether a similarity says that the scan is not to scale."""
    return abs(similarity.factor - 1.0) >= max(LEAST_FACTOR, FACTOR_DEVIATIONS * similarity.deviation)


def is_far_off(similarity: Similarity) -> bool:
    """Tell whether a similarity says that the scan is off by more than what is put to scale.

    Then its pose is off by decimetres, or it is in another room of the same shape.
    """
    off = abs(similarity.factor - 1.0)
    shown = similarity.more >= DOUBTING_WALLS or off >= DOUBTING_DEVIATIONS * similarity.deviation
    return is_off(similarity) and off > MOST_FACTOR and shown


def _at_their_scales(first: Explained, found: Explained) -> list[Ranked]:
    """Return what explains the scan at other scales, each at the one that fits it best.

    Of two rooms that differ by a factor the one fits with a map too large, the other with one too small.
    """
    rivals: list[Ranked] = []
    for scale in RIVAL_SCALES:
        context = first.context if scale == 1.0 else _at_scale(first.context, scale)
        if len(context.lines.rows) != len(found.context.lines.rows):
            continue
        ranked = first.explanations.ranked
        if scale != 1.0:
            ranked = tuple(rank_candidates(context, find_candidates(context)))
        near = [one for one in ranked if one.score >= LEAST_AS_SENT * found.score]
        rivals += [_at_its_scale(first, context, scale, one) for one in near[:LOOSE_RIVALS]]
    return rivals


def _at_its_scale(first: Explained, context: SearchContext, scale: float, one: Ranked) -> Ranked:
    similarity = fit_similarity(context, one)
    if similarity is None or not abs(scale * similarity.factor - 1.0) <= RIVAL_FACTOR:
        return one
    again = _at_scale(first.context, scale * similarity.factor)
    if len(again.lines.rows) != len(one.matches):
        return one
    found = rank_candidates(again, Candidates(one.estimate, first.explanations.search))
    return found[0] if found else one


def beside(explanations: Explanations, rivals: Sequence[Ranked]) -> Explanations:
    """Return explanations with rivals that fit at other scales among them, none of them above the answer."""
    if explanations.answer is None:
        return explanations
    best, ranked = explanations.answer.best, list(explanations.ranked)
    for rival in rivals:
        one = replace(rival, score=min(rival.score, best.score), value=min(rival.value, best.value))
        place = next((k for k, other in enumerate(ranked) if _same_place(one, other)), len(ranked))
        if place == len(ranked) or ranked[place].value < one.value:
            ranked[place : place + 1] = [one]
    ranked.sort(key=lambda one: (not one.inside, -one.value))
    return replace(explanations, ranked=tuple(ranked))


def _same_place(one: Ranked, other: Ranked) -> bool:
    """Tell whether two poses are of one place, at whatever scales."""
    a, b = one.pose, other.pose
    return math.hypot(a.x - b.x, a.y - b.y) <= SAME_PLACE and abs(wrap_angle(a.theta - b.theta)) <= DISTINCT_ANGLE


def _with_what_is_not_known(found: Explained) -> Explained:
    """Return what was put to scale with the pose of a similarity, and the covariance that comes with its factor."""
    answer, factor, similarity = found.explanations.answer, found.factor, _similarity(found)
    if answer is None or factor is None or similarity is None:
        return found
    settled = replace(answer.settled, pose=similarity.pose, covariance=similarity.covariance)
    at_scale = register_accepted(found.context, answer.best, answer.accepted, settled, fitted=False)
    assert at_scale is not None  # of pairs that it was registered of before
    answer = replace(answer, settled=settled, registered=at_scale[0])
    factor = Factor(factor.value * similarity.factor, similarity.deviation)
    return replace(found, explanations=replace(found.explanations, answer=answer), factor=factor)
