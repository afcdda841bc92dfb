"""The probabilities that are answered, by a model and among the alternatives, with the vetoes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from association.verdict.features import Features
from association.verdict.models import USUAL, Model
from association.verdict.tuning import NO_MATCH_PROBABILITY
from association.verdict.vetoes import VETOES

from . import curves
from .curves import Answers, Floats, logistic, logits
from .examples import Example


@dataclass(frozen=True, slots=True)
class Probabilities:
    """Probabilities of some answers, (n,) float64 each.

    Attributes
    ----------
    likely : float64
        That the answer is right, for a scan that is known to be of the map.
    fitted : float64
        The same, with out-of-map scans included.
    careful : float64
        The same, where the least comparison with the alternatives counts: it decides.
    explained : float64
        That this place or a similar one is right.
    """

    likely: Floats
    fitted: Floats
    careful: Floats
    explained: Floats


def by_model(model: Model, answers: Answers) -> Probabilities:
    """Return the probabilities by a model."""
    fixed = answers.before_null.copy()
    fixed[:, Features._fields.index("deviation")] = USUAL.deviation
    return Probabilities(
        curves.likely(model, answers),
        curves.fitted_to(model, answers),
        curves.careful(model, answers),
        logistic(logits(model, fixed)),
    )


@dataclass(frozen=True, slots=True)
class Answered:
    """The verdicts on some answers, (n,) each.

    Attributes
    ----------
    probability : float64
        As answered; nan where nothing matches, or along an unobservable direction: there is none.
    passes : bool
        True if the cautious probability reaches its threshold.
    usable : bool
        The same, and that no veto applies.
    """

    probability: np.ndarray
    passes: np.ndarray
    usable: np.ndarray


def answered(examples: Sequence[Example], by: Probabilities, threshold: float) -> Answered:
    """Return the verdicts by the probabilities of each answer; `threshold` is of the careful one."""
    found = np.where(by.explained < NO_MATCH_PROBABILITY, np.nan, by.likely)
    found[[e.degenerate for e in examples]] = np.nan
    passes = by.careful >= threshold
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
