"""Search where scan and map differ by a factor: the one place that searches scaled scans.

A map may be off by a factor near one, as a drawing that was scaled by hand. Far walls are then off by much, near ones
by little. A pose corrects part of it: the place is found, some decimetres off. A covariance that takes walls to be off
one by one has deviations of centimetres there. The sums of the matches determine the factor, if they are not held to
one. With the scan's lengths multiplied by it the search finds the missed matches.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from registration import RigidTransform
from registration.layout import Floats
from registration.values import value

from .consensus.acceptance import register_accepted
from .consensus.common_offset import CommonOffset, fit_common_offset
from .consensus.distortion import Distortion, fit_distortion
from .consensus.similarity import Similarity, fit_similarity
from .context import SearchContext
from .explanations import Answer, Explanations
from .options import AssociationOptions
from .rank_and_estimate import search_and_rank
from .scan.scan import scaled
from .search.candidates import Effort
from .tuning import (
    DOUBTING_DEVIATIONS,
    DOUBTING_WALLS,
    FACTOR_DEVIATIONS,
    FACTOR_GAP,
    FACTOR_ROUNDS,
    FACTOR_WALLS,
    LEAST_FACTOR,
    LEAST_OFF_WALLS,
    LOOSE_WALLS,
    MOST_FACTOR,
)


@dataclass(frozen=True, slots=True)
class Factor:
    """The factor on the lengths of a scan.

    Attributes
    ----------
    value : float
    deviation : float
        Its standard deviation.
    """

    value: float
    deviation: float


@value(frozen=True, slots=True)
class ScaledSearch:
    """The result of a search, and the scan that it searched.

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
        True if it is as it was sent, and its consensus set is off by more than `MOST_FACTOR`.
    offset : CommonOffset or None
        That all walls of the answer share, where it is beyond noise and explains the scan without a factor.
    distortion : Distortion or None
        Of the map around the answer, where it is beyond noise and no offset explains it.
    """

    context: SearchContext
    explanations: Explanations
    as_sent: Explanations
    factor: Factor | None = None
    off_scale: bool = False
    offset: CommonOffset | None = None
    distortion: Distortion | None = None

    @property
    def score(self) -> float:
        """Of its answer, nats; 0 where there is none."""
        return 0.0 if self.explanations.answer is None else self.explanations.answer.best.score

    def cut_short(self) -> ScaledSearch:
        """Return the same, where the deadline ended a search."""
        return replace(self, explanations=replace(self.explanations, search=self.explanations.search.cut_short()))


def search_to_scale(context: SearchContext) -> ScaledSearch:
    """Search a scan, and again to scale where that fits much better.

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    return put_to_scale(context, search_and_rank(context))


def put_to_scale(context: SearchContext, as_sent: Explanations) -> ScaledSearch:
    """Search a scan again to scale if its best explanation is off by a factor near one; use the result if much better.

    1. If an offset that all walls share explains the best consensus set without a factor, correct its pose by that.
    2. Estimate the factor by a similarity that is fitted to the best consensus set.
    3. Search the scan at that factor, until the factor is right.
    4. Search for alternatives at other scales, each at the one that fits it best.
    5. Add the uncertainty of the factor to the pose's covariance.
    6. If walls show that the map is distorted, estimate the pose together with that.

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
    first = ScaledSearch(context, as_sent, as_sent)
    if not _may_be_off(first):
        return _with_distortion(first)
    with_offset = _with_common_offset(first)
    if with_offset is not None:
        return with_offset
    return _with_distortion(_with_factor(first))


def _with_factor(first: ScaledSearch) -> ScaledSearch:
    """Return the search with the factor by which scan and map differ; the same where there is none."""
    similarity = _similarity(first)
    found = _search_with_factor(first, similarity)
    if found.factor is None:
        return replace(first, off_scale=similarity is not None and is_far_off(similarity))
    return _with_uncertain_factor(found)


def _may_be_off(first: ScaledSearch) -> bool:
    """Return whether a factor may matter, and nothing but the pose was solved for, and all that was.

    A scan that is off its walls by millimetres leaves nothing to a factor; nor does a map that is declared to be that
    exact, or to be off by more than the walls of a map of unknown deviation are.
    """
    context, answer = first.context, first.explanations.answer
    if answer is None or answer.estimated.views is not None or context.options.estimator != "joint":
        return False
    declared = context.index.sigma
    if declared is None:
        return answer.estimated.wall_sigma >= LEAST_OFF_WALLS
    return LEAST_OFF_WALLS <= declared <= LOOSE_WALLS


def _with_common_offset(first: ScaledSearch) -> ScaledSearch | None:
    """Return the search with the pose of an offset that all walls share; None unless that explains it alone."""
    context, answer = first.context, first.explanations.answer
    assert answer is not None  # see `_may_be_off`
    if answer.estimated.free or answer.estimated.degenerate:
        return None
    found = fit_common_offset(context, answer.best, answer.estimated.wall_sigma)
    if found is None or is_factor(found.factor, found.factor_deviation):
        return None
    answer = _moved(context, answer, found.pose, found.covariance)
    return replace(first, explanations=replace(first.explanations, answer=answer), offset=found)


def _moved(context: SearchContext, answer: Answer, pose: RigidTransform, covariance: Floats) -> Answer:
    """Return an answer with another pose, at which its pairs are evaluated."""
    estimated = replace(answer.estimated, pose=pose, covariance=covariance)
    registered = register_accepted(context, answer.best, answer.accepted, estimated, fitted=False)
    assert registered is not None  # of pairs that it was registered of before
    return replace(answer, estimated=estimated, registered=registered[0])


def _search_with_factor(first: ScaledSearch, similarity: Similarity | None) -> ScaledSearch:
    """Search again with the factor of a similarity, until it is right; a scan that fits no better is left as it was."""
    found, factor = first, 1.0
    for _ in range(FACTOR_ROUNDS):
        if similarity is None or not is_off(similarity):
            break
        factor *= similarity.factor
        if not abs(factor - 1.0) <= MOST_FACTOR:
            break
        again = at_scale(first.context, factor)
        explanations = search_and_rank(again, _effort_beyond(again, found))
        stretched = ScaledSearch(again, explanations, first.explanations, Factor(factor, similarity.deviation))
        fitted = _similarity(stretched)
        # A factor that no more walls fix than it takes lets the sides of a room fit those of any other.
        if fitted is None or fitted.more < FACTOR_WALLS or stretched.score <= found.score + FACTOR_GAP:
            break
        found, similarity = stretched, fitted
    return found


def _effort_beyond(context: SearchContext, found: ScaledSearch) -> Effort:
    """Return the effort of a search at another scale: for poses that score a fraction of what the answer does.

    At a wrong scale nothing scores high: a search that starts from nothing would go on until no base is left, which
    takes up to ten times as long.
    """
    answer = found.explanations.answer
    assert answer is not None  # whose factor is tried
    known = answer.best.by_segments + answer.best.posterior - answer.best.score
    return replace(Effort.of(context), known=max(0.0, known))  # a soft prior may cost more than the segments gain


def at_scale(context: SearchContext, factor: float, options: AssociationOptions | None = None) -> SearchContext:
    """Prepare the search of a scan with its lengths times a factor; the origin of its frame stays.

    Parameters
    ----------
    context : SearchContext
    factor : float
    options : AssociationOptions or None
        None: those of the context.
    """
    scan = scaled(context.scan, factor)
    return SearchContext.of(context.index, scan, context.prior, options or context.options, context.deadline)


def _similarity(found: ScaledSearch) -> Similarity | None:
    answer = found.explanations.answer
    return None if answer is None else fit_similarity(found.context, answer.best)


def is_off(similarity: Similarity) -> bool:
    """Return whether a similarity differs from a rigid motion by its factor."""
    return is_factor(similarity.factor, similarity.deviation)


def is_factor(factor: float, deviation: float) -> bool:
    """Return whether a factor with this standard deviation differs from one."""
    return abs(factor - 1.0) >= max(LEAST_FACTOR, FACTOR_DEVIATIONS * deviation)


def is_far_off(similarity: Similarity) -> bool:
    """Return whether the factor of a similarity is greater than those that a scan is searched with.

    Then its pose is off by decimetres, or it is in another room of the same shape.
    """
    off = abs(similarity.factor - 1.0)
    shown = similarity.more >= DOUBTING_WALLS or off >= DOUBTING_DEVIATIONS * similarity.deviation
    return is_off(similarity) and off > MOST_FACTOR and shown


def _with_uncertain_factor(found: ScaledSearch) -> ScaledSearch:
    """Return the search put to scale with the pose of a similarity, and the covariance that comes with its factor."""
    answer, factor, similarity = found.explanations.answer, found.factor, _similarity(found)
    if answer is None or factor is None or similarity is None:
        return found
    answer = _moved(found.context, answer, similarity.pose, similarity.covariance)
    factor = Factor(factor.value * similarity.factor, similarity.deviation)
    return replace(found, explanations=replace(found.explanations, answer=answer), factor=factor)


def _with_distortion(found: ScaledSearch) -> ScaledSearch:
    """Return the search with a pose that was estimated together with the distortion of the map, if walls show one.

    The same where the pose is not fixed, where the map is declared to be exact or off by more than maps usually are,
    where more than a pose was solved for, or less, and where the scan was not taken from one place.
    """
    context, answer, sensor = found.context, found.explanations.answer, found.context.scan.viewpoint
    if answer is None or answer.estimated.views is not None or context.options.estimator != "joint" or sensor is None:
        return found
    declared = context.index.sigma
    if declared is not None and not LEAST_OFF_WALLS <= declared <= LOOSE_WALLS:
        return found
    if answer.estimated.free or answer.estimated.degenerate:
        return found
    distortion = fit_distortion(context, answer.best, answer.estimated, sensor, to_scale=found.factor is not None)
    if distortion is None:
        return found
    answer = _moved(context, answer, distortion.pose, distortion.covariance)
    return replace(found, explanations=replace(found.explanations, answer=answer), distortion=distortion)
