"""Work out the probabilities of an answer: models of its features, its alternatives, and the null score."""

from __future__ import annotations

from dataclasses import replace

from registration.layout import Records
from registration.values import value

from ..context import SearchContext
from .alternatives import probability_among, probability_by_shown, probability_with_loose_walls
from .chance import NullScore, find_null_score
from .features import Description, Features, add_null_score
from .kernels.null_features import allowed_null
from .kernels.odds import probability
from .models import MODELS, USUAL, Model
from .tuning import (
    USABLE_CAUTIOUS,
    USABLE_CAUTIOUS_DRIVE,
    USABLE_PROBABILITY,
)
from .vetoes import Veto


@value(frozen=True, slots=True)
class Probabilities:
    """Probabilities of an answer, 0 to 1, and what they were worked out from.

    Attributes
    ----------
    usual, model : Model
        For scans that are known to be of this map, and the cautious one, which includes out-of-map scans.
    features : Features
        With the null score where it was needed and matters.
    explained : float
        That this place or a similar one is right, wherever along an unobservable direction; out-of-map scans included.
    by_usual, by_model : float
        By either model, before the alternatives.
    among_as_scored : float
        Of the answer among its alternatives, as these were scored.
    among_by_shown : float
        The same where what the scan does not show counts little.
    among_with_loose_walls : float or None
        The same where walls may be off by more; None where it was not compared.
    null : NullScore or None
        Of the mirrored scan; None where that was not searched.
    null_above : float
        Fraction of the answer's score below which the mirrored scan was not searched; 0 where all was.
    least_cautious : float
        The threshold of `cautious`.
    """

    usual: Model
    model: Model
    features: Features
    explained: float
    by_usual: float
    by_model: float
    among_as_scored: float
    among_by_shown: float
    among_with_loose_walls: float | None
    null: NullScore | None
    null_above: float
    least_cautious: float

    @property
    def among_alternatives(self) -> float:
        """Return the probability of the answer among the explanations that are about as good."""
        loose = 1.0 if self.among_with_loose_walls is None else self.among_with_loose_walls
        return min(self.among_as_scored, self.among_by_shown, loose)

    @property
    def right(self) -> float:
        """Return the probability that the pose is right, given that the robot is on this map."""
        return self.by_usual * self.among_alternatives

    @property
    def cautious(self) -> float:
        """Return the same where out-of-map scans are included."""
        return self.by_model * self.among_alternatives

    @property
    def suffice(self) -> bool:
        """Return whether both probabilities reach their thresholds."""
        return self.right >= USABLE_PROBABILITY and self.cautious >= self.least_cautious


def work_out_probabilities(context: SearchContext, description: Description, vetoes: tuple[Veto, ...]) -> Probabilities:
    """Work out the probabilities of an answer.

    1. Evaluate the fitted models on its features, and its probability among its alternatives.
    2. If it would be usable, compare it again with its alternatives, with walls off by more.
    3. If it would still be usable, search the mirrored scan.

    Parameters
    ----------
    context : SearchContext
    description : Description
    vetoes : tuple of Veto
        Those that apply before any probability is known.

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    found = _at_first(context, description)
    if not found.suffice or any(veto.settles for veto in vetoes):
        return found
    loose = probability_with_loose_walls(context, description.answer, description.others)
    found = replace(found, among_with_loose_walls=loose)
    if not found.cautious >= found.least_cautious:
        return found
    # Only an answer that would be usable is compared with the mirrored scan, which costs another search. If it is
    # usable, the null score is not reported; if it is not, the reasons go by it.
    certain = not vetoes and context.window is None and found.right >= USABLE_PROBABILITY
    return _with_null_score(context, description, found, certain=certain)


def _at_first(context: SearchContext, description: Description) -> Probabilities:
    """Return the probabilities by the features alone, and by the alternatives as they were scored."""
    described, (usual, model) = description.features, _models(context)
    return Probabilities(
        usual=usual,
        model=model,
        features=Features(*described.item()),
        explained=probability(model.odds, _as_if_fixed(described)),
        by_usual=probability(usual.odds, described),
        by_model=probability(model.odds, described),
        among_as_scored=probability_among(description.alternatives),
        among_by_shown=probability_by_shown(context, description.answer.best, description.others),
        among_with_loose_walls=None,
        null=None,
        null_above=0.0,
        least_cautious=least_cautious(context),
    )


def _with_null_score(
    context: SearchContext, description: Description, found: Probabilities, *, certain: bool
) -> Probabilities:
    """Search the mirrored scan; if the answer is `certain` otherwise, only as far as the null score may change that."""
    described, best, least = description.features.copy(), description.answer.best, 0.0
    if certain:
        bar = found.least_cautious / found.among_alternatives
        least = allowed_null(found.model.odds, described.copy(), best.score, bar)
    null = find_null_score(context, best, least)
    add_null_score(described, best, null)
    by_model = probability(found.model.odds, described)
    return replace(found, features=Features(*described.item()), by_model=by_model, null=null, null_above=least)


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
    return USABLE_CAUTIOUS
