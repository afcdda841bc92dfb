"""The probabilities that are answered: a model's, its alternatives' compared twice, with the vetoes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from association.verdict.models import USUAL, Model
from association.verdict.tuning import NO_MATCH_PROBABILITY, USABLE_PROBABILITY
from association.verdict.vetoes import VETOES

from .examples import Example

SETTLING = frozenset(veto.name for veto in VETOES if veto.settles)


@dataclass(frozen=True, slots=True)
class Answered:
    """The verdicts on some answers, (n,) each.

    Attributes
    ----------
    probability : float64
        As answered; nan where nothing matches, or along an unobservable direction: there is none.
    passes : bool
        True if both probabilities reach their thresholds.
    usable : bool
        The same, and that no veto applies.
    """

    probability: np.ndarray
    passes: np.ndarray
    usable: np.ndarray


def answered(
    examples: Sequence[Example], likely: np.ndarray, careful: np.ndarray, threshold: float, model: Model | None = None
) -> Answered:
    """Return the verdicts by two probabilities of each answer.

    Parameters
    ----------
    examples : sequence of Example
    likely, careful : (n,) float64
        Probabilities for scans of the map, and with out-of-map scans included, among the alternatives as scored.
    threshold : float
        Of `careful`.
    model : Model or None
        The cautious one, by which a scan without a match is recognized; None: none is.
    """
    settled = np.array([bool(SETTLING & set(e.vetoes)) for e in examples], bool)
    shares = np.array([e.share for e in examples])
    shown = np.minimum(shares, np.array([e.shown for e in examples]))
    likely, careful = likely * shown / shares, careful * shown / shares
    compared = (likely >= USABLE_PROBABILITY) & (careful >= threshold) & ~settled
    factor = np.where(compared, np.minimum(1.0, np.array([e.loose for e in examples]) / shown), 1.0)
    likely, careful = likely * factor, careful * factor
    found = likely.copy()
    if model is not None:
        fixed = [model.logit(e.before_null._replace(deviation=USUAL.deviation)) for e in examples]
        found[1.0 / (1.0 + np.exp(-np.array(fixed))) < NO_MATCH_PROBABILITY] = np.nan
    found[[e.degenerate for e in examples]] = np.nan
    passes = (likely >= USABLE_PROBABILITY) & (careful >= threshold)
    return Answered(found, passes, passes & np.array([not e.vetoes for e in examples], bool))


def veto_rows(examples: Sequence[Example], passes: np.ndarray) -> list[tuple[str, ...]]:
    """Return for each veto the answers that it alone rejects: right, wrong, and of out-of-map scans."""
    rows: list[tuple[str, ...]] = []
    for veto in VETOES:
        only = [e for e, passed in zip(examples, passes, strict=True) if passed and e.vetoes == (veto.name,)]
        away = sum(e.stranger for e in only)
        right = sum(e.right for e in only)
        rows.append((veto.name, str(right), str(len(only) - right - away), str(away)))
    return rows
