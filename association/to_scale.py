"""A search where scan and map differ by a factor near one, as with a drawing that was scaled by hand.

Such a map puts far walls off by much and near ones by little. A pose makes up for part of it: the place is found, some
decimetres off, and a covariance that takes walls to be off one by one says centimetres. The sums of what matched know
the factor, if they are not held to one; with the scan's lengths multiplied by it the search finds what it missed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from .acceptance import register_accepted
from .context import SearchContext
from .explain import Explanations, explain
from .scan import scaled
from .similarity import Similarity, fit_similarity
from .tuning import (
    FACTOR_DEVIATIONS,
    FACTOR_GAP,
    FACTOR_ROUNDS,
    FACTOR_WALLS,
    LEAST_FACTOR,
    MOST_FACTOR,
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


@dataclass(frozen=True, slots=True)
class Explained:
    """What a search found, and what it searched.

    Attributes
    ----------
    context : SearchContext
        With the scan to scale.
    explanations : Explanations
    factor : Factor or None
        By which the scan was put to scale; None where it is as it was sent.
    """

    context: SearchContext
    explanations: Explanations
    factor: Factor | None = None

    @property
    def score(self) -> float:
        """Of its answer, nats; 0 where there is none."""
        return 0.0 if self.explanations.answer is None else self.explanations.answer.best.score


def explain_to_scale(context: SearchContext) -> Explained:
    """Explain a scan, put to scale where the best explanation says that it is not, and fits much better then.

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    found, factor = Explained(context, explain(context)), 1.0
    similarity = _similarity(found)
    for _ in range(FACTOR_ROUNDS):
        if similarity is None or not is_off(similarity):
            break
        factor *= similarity.factor
        if not abs(factor - 1.0) <= MOST_FACTOR:
            break
        # The scan is stretched about where it was seen from, not about the middle of the robot.
        scan = scaled(context.scan, factor, context.scan.viewpoint or (0.0, 0.0))
        again = SearchContext.of(context.index, scan, context.prior, context.options, context.deadline)
        stretched = Explained(again, explain(again), Factor(factor, similarity.deviation))
        fitted = _similarity(stretched)
        # A factor that no more walls fix than it takes lets the sides of a room fit those of any other.
        if fitted is None or fitted.more < FACTOR_WALLS or stretched.score <= found.score + FACTOR_GAP:
            break
        found, similarity = stretched, fitted
    return found if found.factor is None or similarity is None else _with_what_is_not_known(found, similarity)


def _similarity(found: Explained) -> Similarity | None:
    """Fit a similarity where nothing but the pose was solved for, and all that was."""
    context, answer = found.context, found.explanations.answer
    if answer is None or answer.settled.views is not None or context.options.estimator != "joint":
        return None
    return fit_similarity(context, answer.best)


def is_off(similarity: Similarity) -> bool:
    """Tell whether a similarity says that the scan is not to scale."""
    return abs(similarity.factor - 1.0) >= max(LEAST_FACTOR, FACTOR_DEVIATIONS * similarity.deviation)


def _with_what_is_not_known(found: Explained, similarity: Similarity) -> Explained:
    """Return what was put to scale with the pose of the similarity, and the covariance that comes with its factor."""
    answer, factor = found.explanations.answer, found.factor
    assert answer is not None
    assert factor is not None
    settled = replace(answer.settled, pose=similarity.pose, covariance=similarity.covariance)
    registered = register_accepted(found.context, answer.accepted, settled)
    assert registered is not None  # of pairs that it was registered of before
    answer = replace(answer, settled=settled, registered=registered)
    factor = Factor(factor.value * similarity.factor, similarity.deviation)
    return Explained(found.context, replace(found.explanations, answer=answer), factor)
