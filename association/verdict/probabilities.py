"""Work out the probabilities of an answer: models of its features, its alternatives, and the null score."""

from __future__ import annotations

from registration.layout import Records
from registration.values import value

from ..context import SearchContext
from ..explanations import Answer, Explanations
from .alternatives import compare_alternatives, probability_among, probability_with_loose_walls
from .chance import find_null_score
from .features import Features, add_null_score, depends_on_one_wall, describe, facts_of
from .kernels.null_features import allowed_null
from .kernels.odds import probability
from .models import MODELS, USUAL, Model
from .tuning import (
    MIRRORED_BETTER,
    USABLE_CAUTIOUS,
    USABLE_CAUTIOUS_DRIVE,
    USABLE_CAUTIOUS_WITH_BEAMS,
    USABLE_PROBABILITY,
)


@value(frozen=True, slots=True)
class Probabilities:
    """Probabilities of an answer, 0 to 1.

    Attributes
    ----------
    right : float
        That the pose is right, given that the robot is on this map.
    cautious : float
        The same where other buildings are included.
    explained : float
        That this place or a similar one is right, wherever along an unobservable direction, other buildings included.
    among_alternatives : float
        Of the answer among the explanations that are about as good; it is in `right` and `cautious`.
    few_walls : bool
        True if few walls fix the pose, and one of them alone decides.
    described : (1,) of `FEATURES`
        The features; with the null score where it was needed and matters.
    model : Model
        That of `cautious`.
    """

    right: float
    cautious: float
    explained: float
    among_alternatives: float
    few_walls: bool
    described: Records
    model: Model

    @property
    def features(self) -> Features:
        """The features by name."""
        return Features(*self.described.item())

    @property
    def mirrored(self) -> bool:
        """Return whether the scan fits the map better with left and right exchanged."""
        return bool(self.described["null_better"][0] >= MIRRORED_BETTER)


def work_out_probabilities(
    context: SearchContext, explanations: Explanations, answer: Answer, *, capped: bool, certain: bool
) -> Probabilities:
    """Work out the probabilities of an answer.

    1. Compare it with its alternatives, and describe it by features.
    2. Evaluate the fitted models.
    3. If it would be usable, compare again with walls off by more, and search the mirrored scan.

    Parameters
    ----------
    context : SearchContext
    explanations : Explanations
    answer : Answer
        Theirs.
    capped : bool
        True if no probability makes the answer usable.
    certain : bool
        True if the answer is usable once the probabilities suffice.

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    best, others = answer.best, tuple(explanations.alternatives)
    alternatives, facts = compare_alternatives(best, others), facts_of(context, answer)
    described, among = describe(best, facts, alternatives), probability_among(alternatives)
    usual, model = _models(context)
    right, cautious = probability(usual.odds, described), probability(model.odds, described)
    explained = probability(model.odds, _as_if_fixed(described))
    few_walls, bar = depends_on_one_wall(context, answer, facts), least_cautious(context)
    decidable = right * among >= USABLE_PROBABILITY and not (capped or answer.estimated.degenerate or few_walls)
    if decidable and cautious * among >= bar:
        among = min(among, probability_with_loose_walls(context, answer, others))
    if decidable and cautious * among >= bar:
        # Only an answer that would be usable is compared with the mirrored scan, which costs another search. If it is
        # usable, the null score is not reported; if it is not, the reasons go by it.
        certain = certain and right * among >= USABLE_PROBABILITY
        least = allowed_null(model.odds, described.copy(), best.score, bar / among) if certain else 0.0
        add_null_score(described, best, find_null_score(context, best, least))
        cautious = probability(model.odds, described)
    return Probabilities(right * among, cautious * among, explained, among, few_walls, described, model)


def _models(context: SearchContext) -> tuple[Model, Model]:
    """Return the model for scans of this map, and the cautious one, which includes other buildings."""
    form = "_with_beams" if context.with_beams else ""
    return MODELS["probability" + form], MODELS["cautious" + form]


def _as_if_fixed(described: Records) -> Records:
    """Return features as if the position was as well fixed as usual.

    Two questions are separate: whether the scan is of this map, and whether it fixes the position there, and where.
    """
    fixed = described.copy()
    fixed["deviation"] = USUAL.deviation
    return fixed


def least_cautious(context: SearchContext) -> float:
    """Return the least cautious probability of a usable answer."""
    if context.scan.views is not None and context.scan.views.uncertain:
        return USABLE_CAUTIOUS_DRIVE
    return USABLE_CAUTIOUS_WITH_BEAMS if context.with_beams else USABLE_CAUTIOUS
