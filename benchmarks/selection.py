"""Select the features of a verdict's model, and then pairs of them: one after the other, by the cross-validated loss.

Starting from the constant, each step adds the feature that takes most off the log-loss; then each step adds a pair of
these features. It ends when none takes off enough. Of all that could be added, only the few are tried that promise
most: those along which the likelihood rises most. ``python -m benchmarks.calibration --select`` uses it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import TypeVar

import numpy as np

from association.verdict.features import Features
from association.verdict.models import LEAST, MOST
from association.verdict.roles import AGAINST, FOR, ROLES

from .curves import (
    Answers,
    Floats,
    SignedPair,
    Task,
    fit,
    fitted_to,
    knots,
    log_loss,
    pair_between,
    pieces,
    term_of_pair,
)
from .examples import SEGMENTS
from .outcomes import progress

Item = TypeVar("Item")

ENOUGH = 0.0001  # by which a feature or a pair has to lower the loss, nats
TRIED = 8  # that promise most
FOLDS = 6  # into which buildings, logs and worlds are put together
# The map of a scan does not depend on how well the walls fix the pose: these are in no pair.
UNPAIRED = frozenset({"deviation", "critical_deviation", "critical_displacement"})


@dataclass(frozen=True, slots=True)
class Selected:
    """A step of a selection: what was added, and the cross-validated log-loss with it, nats."""

    added: str
    loss: float


def candidates(form: str) -> list[str]:
    """Return the features that a model may have: those of beams with ranges only."""
    return [name for name in Features._fields if name in ROLES and not (form == SEGMENTS and ROLES[name].needs_beams)]


def select(answers: Answers, form: str, names: Sequence[str], enough: float = ENOUGH) -> tuple[Task, list[Selected]]:
    """Select features among some, then pairs of the selected ones.

    Parameters
    ----------
    answers : Answers
    form : str
    names : sequence of str
        The candidates.
    enough : float
        By which each has to lower the loss, nats.

    Returns
    -------
    Task
    list of Selected
        Its steps.
    """
    folded = _folded(answers.where(answers.told))
    task, steps = Task(form, ("constant",)), []
    p = cross_validated(folded, task)
    steps.append(Selected("constant", log_loss(p, folded)))

    def with_feature(before: Task, name: str) -> Task:
        return replace(before, names=(*before.names, name))

    def with_pair(before: Task, pair: SignedPair) -> Task:
        return replace(before, pairs=(*before.pairs, pair))

    def features_left(before: Task) -> Iterator[tuple[str, Floats]]:
        for name in names:
            if name not in before.names:
                values = folded.column(name)
                yield name, pieces(values, knots(values, before.bends))

    def pairs_left(before: Task) -> Iterator[tuple[SignedPair, Floats]]:
        for pair in pairs_of(before.names[1:]):
            if pair not in before.pairs:
                yield pair, term_of_pair(pair_between(folded, *pair), folded.features)[:, None]

    task, p = _added(folded, task, p, steps, features_left, with_feature, enough)
    task, p = _added(folded, task, p, steps, pairs_left, with_pair, enough)
    return task, steps


def pairs_of(names: Sequence[str]) -> Iterator[SignedPair]:
    """Yield the pairs of some features in both kinds, each name with the sign by which it speaks for an answer."""
    for one, other in combinations([name for name in names if name not in UNPAIRED], 2):
        for first in _signed(one):
            for second in _signed(other):
                yield LEAST, first, second
                yield MOST, first, second


def _signed(name: str) -> tuple[str, ...]:
    sign = ROLES[name].sign
    return tuple(way + name for way, against in (("+", AGAINST), ("-", FOR)) if sign != against)


def _added(
    answers: Answers,
    task: Task,
    p: Floats,
    steps: list[Selected],
    left: Callable[[Task], Iterator[tuple[Item, Floats]]],
    with_one: Callable[[Task, Item], Task],
    enough: float,
) -> tuple[Task, Floats]:
    """Add what lowers the loss most, until nothing lowers it enough."""
    while True:
        promising = sorted(left(task), key=lambda one: -_promise(answers, p, one[1]))[:TRIED]
        tried = [with_one(task, item) for item, _ in promising]
        found = [(log_loss(q, answers), q, one) for one, q in ((one, cross_validated(answers, one)) for one in tried)]
        if not found:
            return task, p
        loss, q, best = min(found, key=lambda one: one[0])
        if not loss < steps[-1].loss - enough:
            return task, p
        added = best.names[-1] if best.pairs == task.pairs else " ".join(best.pairs[-1])
        task, p = best, q
        steps.append(Selected(added, loss))
        progress(f"selected for {task.form}: {added}", 1, 1)


def _promise(answers: Answers, p: Floats, columns: Floats) -> float:
    """Return by how much the likelihood rises at most along some columns: the score test's statistic."""
    residual = answers.weights * np.where(answers.right, 1.0, 0.0) - answers.weights * p
    spread = answers.weights * np.maximum(1e-4, p * (1.0 - p))
    centred = columns - np.average(columns, axis=0, weights=spread)
    gradient = centred.T @ residual
    information = centred.T @ (spread[:, None] * centred)
    information += np.diag(1e-6 + 1e-6 * np.diag(information))
    return float(gradient @ np.linalg.solve(information, gradient))


def cross_validated(answers: Answers, task: Task) -> Floats:
    """Return for each answer the probability by a fit to the other folds, out-of-map scans included."""
    out = np.zeros(len(answers.right))
    for here in np.unique(answers.folds):
        mine = answers.folds == here
        out[mine] = fitted_to(fit(answers.where(~mine), task), answers.where(mine))
    return out


def _folded(answers: Answers) -> Answers:
    """Return the same answers with few folds, of several buildings, logs or worlds each."""
    names = np.unique(answers.folds)
    fold_of = {name: str(k % FOLDS) for k, name in enumerate(names)}
    return replace(answers, folds=np.array([fold_of[name] for name in answers.folds]))
