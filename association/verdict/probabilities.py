"""Work out the probabilities of an answer: a model of its features, its alternatives, and the null score."""

from __future__ import annotations

from dataclasses import replace

from registration.layout import Records
from registration.values import value

from ..context import SearchContext
from .alternatives import AmongAlternatives, compare_three_ways
from .chance import NullScore, find_null_score
from .features import Description, Features, add_null_score
from .kernels.null_features import allowed_null
from .kernels.odds import probability
from .models import MODELS, USUAL, Model
from .tuning import USABLE_CAUTIOUS
from .vetoes import Veto


@value(frozen=True, slots=True)
class Probabilities:
    """Probabilities of an answer, 0 to 1, and what they were worked out from.

    Attributes
    ----------
    model : Model
        Of scans of this form.
    features : Features
        With the null score where it was needed and matters.
    explained : float
        That this place or a similar one is right, wherever along an unobservable direction; out-of-map scans included.
    by_model_on_map, by_model : float
        By the model, before the alternatives: for a scan that is known to be of this map, without the null score; and
        with out-of-map scans included.
    among : AmongAlternatives
    null : NullScore or None
        Of the mirrored scan; None where that was not searched.
    null_above : float
        Fraction of the answer's score below which the mirrored scan was not searched; 0 where all was.
    """

    model: Model
    features: Features
    explained: float
    by_model_on_map: float
    by_model: float
    among: AmongAlternatives
    null: NullScore | None
    null_above: float

    @property
    def right(self) -> float:
        """Return the probability that the pose is right, given that the robot is on this map."""
        return self.by_model_on_map * self.among.mean

    @property
    def cautious(self) -> float:
        """Return the same where out-of-map scans are included, and the least comparison with alternatives counts."""
        return self.by_model * self.among.least

    @property
    def suffice(self) -> bool:
        """Return whether the cautious probability reaches its threshold; `right` is never less."""
        return self.cautious >= USABLE_CAUTIOUS


def work_out_probabilities(context: SearchContext, description: Description, vetoes: tuple[Veto, ...]) -> Probabilities:
    """Work out the probabilities of an answer.

    1. Evaluate the fitted model on its features, and its probability among its alternatives.
    2. If it would be usable, search the mirrored scan.

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
    # Only an answer that would be usable is compared with the mirrored scan, which costs another search. If it is
    # usable, the null score is not reported; if it is not, the reasons go by it.
    return _with_null_score(context, description, found, certain=not vetoes and context.window is None)


def _at_first(context: SearchContext, description: Description) -> Probabilities:
    """Return the probabilities by the features and the alternatives."""
    described, model = description.features, MODELS["ranges" if context.with_beams else "segments"]
    return Probabilities(
        model=model,
        features=Features(*described.item()),
        explained=probability(model.odds, _as_if_fixed(described), 0.0),
        by_model_on_map=probability(model.odds, described, model.on_map),
        by_model=probability(model.odds, described, 0.0),
        among=compare_three_ways(context, description.answer, description.others, description.alternatives),
        null=None,
        null_above=0.0,
    )


def _with_null_score(
    context: SearchContext, description: Description, found: Probabilities, *, certain: bool
) -> Probabilities:
    """Search the mirrored scan; if the answer is `certain` otherwise, only as far as the null score may change that."""
    described, best, least = description.features.copy(), description.answer.best, 0.0
    if certain:
        bar = USABLE_CAUTIOUS / found.among.least
        least = allowed_null(found.model.odds, described.copy(), best.score, bar)
    null = find_null_score(context, best, least)
    add_null_score(described, best, null)
    by_model = probability(found.model.odds, described, 0.0)
    return replace(found, features=Features(*described.item()), by_model=by_model, null=null, null_above=least)


def _as_if_fixed(described: Records) -> Records:
    """Return features as if the position was as well fixed as usual.

    Two questions are separate: whether the scan is of this map, and whether it fixes the position there, and where.
    """
    fixed = described.copy()
    fixed["deviation"] = USUAL.deviation
    return fixed
