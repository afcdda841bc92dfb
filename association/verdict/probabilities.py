"""Work out the probabilities of an answer: a model of its features, its alternatives, and the null score."""

from __future__ import annotations

from dataclasses import replace

from registration.layout import Records
from registration.values import value

from ..context import SearchContext
from .alternatives import AmongAlternatives, compare_three_ways
from .chance import NullScore, find_null_score
from .features import Description, Features, add_null_score
from .kernels.odds import probability
from .models import MODELS, USUAL, Model
from .tuning import FITTED_ON_MAP
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
    by_model : float
        By the model, before the alternatives.
        among : AmongAlternatives
    null : NullScore or None
        Of the mirrored scan; None where that was not searched.
    """

    model: Model
    features: Features
    explained: float
    by_model: float
    among: AmongAlternatives
    null: NullScore | None

    @property
    def right(self) -> float:
        """Return the probability that the pose is right, with the prior probability `options.on_map`."""
        return self.by_model * self.among.least


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
    if found.right < context.options.usable_from or any(veto.settles for veto in vetoes):
        return found
    # Only an answer that would be usable is compared with the mirrored scan, which costs another search.
    return _with_null_score(context, description, found)


def _at_first(context: SearchContext, description: Description) -> Probabilities:
    """Return the probabilities by the features and the alternatives."""
    described, model = description.features, MODELS["ranges" if context.with_beams else "segments"]
    return Probabilities(
        model=model,
        features=Features(*described.item()),
        explained=probability(model.odds, _as_if_fixed(described), 0.0),
        by_model=_by_model(model, described, context.options.on_map),
        among=compare_three_ways(context, description.answer, description.others, description.alternatives),
        null=None,
    )


def _with_null_score(context: SearchContext, description: Description, found: Probabilities) -> Probabilities:
    """Search the mirrored scan."""
    described, best = description.features.copy(), description.answer.best
    null = find_null_score(context, best)
    add_null_score(described, best, null)
    by_model = _by_model(found.model, described, context.options.on_map)
    return replace(found, features=Features(*described.item()), by_model=by_model, null=null)


def _by_model(model: Model, described: Records, on_map: float) -> float:
    """Return the probability of an answer by the model and the prior probability that the scan is of this map.

    The model states the log odds L where a fraction f of scans is of this map, and L + c for scans that are: so the
    odds against the answer are ``exp(-L - c)`` on this map and ``exp(-L) - exp(-L - c)`` elsewhere, and the prior
    changes the latter by the ratio of the prior odds.
    """
    by_all = probability(model.odds, described, 0.0)
    by_map = probability(model.odds, described, model.on_map)
    on_this, in_all = 1.0 / by_map - 1.0, 1.0 / by_all - 1.0
    ratio = (1.0 - on_map) / on_map * FITTED_ON_MAP / (1.0 - FITTED_ON_MAP)
    return 1.0 / (1.0 + on_this + max(0.0, in_all - on_this) * ratio)


def _as_if_fixed(described: Records) -> Records:
    """Return features as if the position was as well fixed as usual.

    Two questions are separate: whether the scan is of this map, and whether it fixes the position there, and where.
    """
    fixed = described.copy()
    fixed["deviation"] = USUAL.deviation
    return fixed
