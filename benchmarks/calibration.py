"""Fits the verdict's models, reports them by cross-validation over buildings, and writes them for `association.models`.

The chance that the best explanation is right is a logistic function of `association.features`, shared between
explanations that are about as good. Scans of floor plans (three levels of clutter), of logs and of drawn worlds, as
segments and with their raw ranges, and scans that were searched in the map of another building or of another part of
it, where nothing is right: these count next to nothing for the one probability, which is about scans of this map, and
fully for the cautious one, which an answer has to pass too before a robot goes by it. What is reported of an answer
comes from a fit without its building, its log or its world; the coefficients come from all of these. The drawn worlds
that ``python -m benchmarks worlds`` reports on are never fitted on.

``python -m benchmarks.calibration [--stride 1] [--form segments] [--keep FOLDER] [--write]``
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import minimize

import association
from association.features import Features
from association.models import FILE, FITTED_ON, MODELS, USUAL, Curve, Model, as_document
from association.tuning import TWIN_TEMPERATURE, USABLE_CAUTIOUS, USABLE_PROBABILITY

from .examples import DRAWN, DRAWN_STRANGERS, RANGES, SEGMENTS, STRANGERS, Example, cases, collected
from .reliability import print_bins
from .table import print_table

RIDGE = 0.5  # on slopes of standardised features, in units of one answer; cross-validated
TEMPERATURES = (0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0)  # nats
THRESHOLDS = (0.8, 0.85, 0.9, 0.92, 0.94, 0.95, 0.96, 0.97, 0.98, 0.985, 0.99)
GROUPS = ("scan", "scan_30", "scan_50", "logs", DRAWN, STRANGERS)
AWAY = ("unmapped", "other_type", "sister", "mirrored")  # conditions of drawn strangers


@dataclass(frozen=True, slots=True)
class Task:
    """A model to be fitted.

    Attributes
    ----------
    name : str
        As in the file.
    strangers : float
        Weight of a scan of another building.
    current : Model
        The one in the file.
    names : tuple of str
        The features of the new one.
    bends : tuple of float
        Quantiles of each at which its curve may bend.
    """

    name: str
    strangers: float
    current: Model
    names: tuple[str, ...]
    bends: tuple[float, ...]


BEAMS = ("read", "passed", "root_farther", "root_nearer")
# Chosen one after the other by what each takes off the cross-validated log-loss, until none takes off 0.0002 more.
LIKELY = (
    "constant", "deviation", "lead", "blocked", "agreement", "root_length", "inverse_count", "longest_unmatched",
    "chance",
)  # fmt: skip
LIKELY_WITH_BEAMS = ("constant", "solitude", "deviation", "agreement", "root_unmatched", "read", "root_count")
CAREFUL = (
    "constant", "null", "null_better", "longest_unmatched", "lead", "blocked", "root_unmatched", "share",
    "misfit_of_many", "root_length", "deviation", "solitude", "hinge_deviation", "hinge_moves",
)  # fmt: skip
CAREFUL_WITH_BEAMS = (
    "constant", "null_gap", "longest_unmatched", "root_length", "passed", "share", "deviation", "null", "null_better",
    "read", "solitude", "lead", "root_unmatched", "agreement", "misfit_of_many", "hinge_deviation", "hinge_moves",
    "root_farther", "root_nearer",
)  # fmt: skip
BENDS = (0.2, 0.5, 0.8)  # quantiles of a feature at which its curve may bend
TASKS = {
    SEGMENTS: (
        Task("probability", 0.02, MODELS["probability"], LIKELY, ()),
        Task("cautious", 1.0, MODELS["cautious"], CAREFUL, BENDS),
    ),
    RANGES: (
        Task("probability_with_beams", 0.02, MODELS["probability_with_beams"], LIKELY_WITH_BEAMS, ()),
        Task("cautious_with_beams", 1.0, MODELS["cautious_with_beams"], CAREFUL_WITH_BEAMS, BENDS),
    ),
}


@dataclass(frozen=True, slots=True)
class Fitted:
    """A model with the temperature of the twins, nats."""

    model: Model
    temperature: float

    def probabilities(self, examples: Sequence[Example]) -> np.ndarray:
        """Return the chance that each answer is right."""
        logits = np.array([self.model.logit(e.features) for e in examples])
        return np.asarray(_shares(examples, self.temperature) / (1.0 + np.exp(-logits)))


def _shares(examples: Sequence[Example], temperature: float) -> np.ndarray:
    return np.array([1.0 / (1.0 + (e.counted * np.exp(e.gaps / temperature)).sum()) for e in examples])


def _weights(examples: Sequence[Example], strangers: float) -> np.ndarray:
    return np.array([strangers if e.stranger else 1.0 for e in examples])


def log_loss(probabilities: np.ndarray, examples: Sequence[Example], strangers: float) -> float:
    """Return the mean of minus the log of the chance given to what happened, nats."""
    p = np.clip(probabilities, 1e-12, 1.0 - 1e-12)
    right = np.array([e.right for e in examples])
    weights = _weights(examples, strangers)
    return float(-(weights * np.where(right, np.log(p), np.log1p(-p))).sum() / weights.sum())


def knots(values: np.ndarray, quantiles: Sequence[float]) -> tuple[float, ...]:
    """Return where the curve of a feature may bend: at quantiles of its values, if it has so many."""
    found = np.unique(np.quantile(values, quantiles))
    return tuple(float(k) for k in found if values.min() < k < values.max())


def fit(examples: Sequence[Example], task: Task, temperature: float) -> Fitted:
    """Find the curves of greatest likelihood, with a pull towards 0 on the slopes of standardised features."""
    columns: list[np.ndarray] = []
    whose: list[tuple[str, float | None]] = []
    for name in task.names:
        values = np.array([getattr(e.features, name) for e in examples])
        columns.append(values)
        whose.append((name, None))
        for knot in knots(values, task.bends):
            columns.append(np.maximum(0.0, values - knot))
            whose.append((name, knot))
    raw = np.array(columns).T
    middle, scale = raw.mean(axis=0), raw.std(axis=0)
    constant = scale < 1e-12
    middle[constant], scale[constant] = 0.0, 1.0
    z, shares = (raw - middle) / scale, _shares(examples, temperature)
    right = np.array([e.right for e in examples])
    weights = _weights(examples, task.strangers)
    first = [name for name, _ in whose].index("constant")

    def loss(w: np.ndarray) -> tuple[float, np.ndarray]:
        s = 1.0 / (1.0 + np.exp(-np.clip(z @ w, -500.0, 500.0)))
        p = np.clip(s * shares, 1e-12, 1.0 - 1e-12)
        total = -(weights * np.where(right, np.log(p), np.log1p(-p))).sum() + RIDGE * (w[~constant] ** 2).sum()
        # With p = s share: d log(p) = 1 - s, d log(1 - p) = -p (1 - s) / (1 - p), by the logit.
        slope = -weights * np.where(right, 1.0 - s, -p * (1.0 - s) / (1.0 - p))
        return float(total), z.T @ slope + 2.0 * RIDGE * np.where(constant, 0.0, w)

    w = minimize(loss, np.zeros(z.shape[1]), jac=True, method="L-BFGS-B", options={"maxiter": 500}).x / scale
    # What standardising took off goes to the constant feature.
    w[constant & (np.arange(len(w)) != first)] = 0.0
    w[first] -= float(w[~constant] @ middle[~constant])
    curves = {
        name: Curve(
            float(w[whose.index((name, None))]),
            tuple((knot, float(w[k])) for k, (n, knot) in enumerate(whose) if n == name and knot is not None),
        )
        for name in task.names
    }
    return Fitted(Model(curves), temperature)


def cross_validated(examples: Sequence[Example], task: Task, temperature: float) -> np.ndarray:
    """Return for each answer the probability by a fit to the other folds."""
    folds = np.array([e.fold for e in examples])
    out = np.zeros(len(examples))
    for here in np.unique(folds):
        fitted = fit([e for e in examples if e.fold != here], task, temperature)
        out[folds == here] = fitted.probabilities([e for e in examples if e.fold == here])
    return out


def print_thresholds(title: str, p: np.ndarray, careful: np.ndarray, examples: Sequence[Example]) -> None:
    """Print for several thresholds of the cautious model the usable share by group and how many of those are wrong.

    Of drawn strangers, the share that is usable although the scan shows that it is wrong.
    """
    cells = []
    for threshold in THRESHOLDS:
        usable = (p >= USABLE_PROBABILITY) & (careful >= threshold) & ~np.array([e.degenerate for e in examples])
        row = [f"{threshold:g}"]
        for group in GROUPS:
            mine = [k for k, e in enumerate(examples) if e.group == group]
            passed = [k for k in mine if usable[k]]
            wrong = sum(not examples[k].right for k in passed)
            row.append(f"{len(passed) / len(mine):.3f} ({wrong} wrong)" if mine else "")
        for condition in AWAY:
            mine = [k for k, e in enumerate(examples) if e.condition == condition and e.group == DRAWN_STRANGERS]
            told = [usable[k] and examples[k].told for k in mine]
            row.append(f"{100.0 * np.mean(told):.2f} %" if mine else "")
        cells.append(row)
    print_table(title, ("usable from", *GROUPS, *AWAY), cells)


def print_changes(old: np.ndarray, new: np.ndarray, examples: Sequence[Example]) -> None:
    """Print which answers would become usable and which would no longer be, the rest of the verdict apart."""
    cells = []
    for what, gained in (("gained", True), ("lost", False)):
        row = [what]
        for group in (*GROUPS, DRAWN_STRANGERS):
            changed = [
                e.right
                for e, before, after in zip(examples, old, new, strict=True)
                if e.group == group
                and not e.degenerate
                and (before >= USABLE_CAUTIOUS) != (after >= USABLE_CAUTIOUS)
                and (after >= USABLE_CAUTIOUS) == gained
            ]
            row.append(f"{len(changed)} ({changed.count(False)} wrong)")
        cells.append(row)
    print_table(f"Answers over {USABLE_CAUTIOUS:g}, beside the present model", ("", *GROUPS, DRAWN_STRANGERS), cells)


def report(form: str, tasks: Sequence[Task], examples: Sequence[Example]) -> dict[str, Model]:
    """Print how present and new models do on one form of scans; return the new ones."""
    print(f"\n## Scans as {form}: {len(examples)} answers")
    cells: list[tuple[str, ...]] = []
    for temperature in TEMPERATURES:
        losses = [log_loss(cross_validated(examples, t, temperature), examples, t.strangers) for t in tasks]
        cells.append((f"{temperature:g}", *(f"{v:.4f}" for v in losses)))
    print_table("Temperature of the twins, cross-validated log-loss", ("nats", *(t.name for t in tasks)), cells)
    own = np.array([not e.stranger for e in examples])
    right = np.array([e.right for e in examples])
    tried = [cross_validated(examples, t, TWIN_TEMPERATURE) for t in tasks]
    present = [Fitted(t.current, TWIN_TEMPERATURE).probabilities(examples) for t in tasks]
    for title, found in (("cross-validated", tried), ("present", present)):
        told = (f"{t.name} {log_loss(p, examples, t.strangers):.4f}" for t, p in zip(tasks, found, strict=True))
        print(f"\nLog-loss, {title}: {', '.join(told)}")
        print_bins(f"Scans as {form} in their own map, {title}", found[0][own], right[own])
        print_thresholds(f"Usable share of scans as {form}, {title}", found[0], found[-1], examples)
    print_changes(present[-1], tried[-1], examples)
    return {t.name: fit(examples, t, TWIN_TEMPERATURE).model for t in tasks}


def write(models: dict[str, Model], fitted_on: dict[str, str], usual: Features) -> Path:
    """Write the file that `association.models` reads; return where it is."""
    path = Path(association.__file__).with_name(FILE)
    document = {
        "fitted_on": fitted_on,
        "usual": {name: float(f"{value:.4g}") for name, value in usual._asdict().items()},
        "models": {name: as_document(model) for name, model in models.items()},
    }
    path.write_text(json.dumps(document, indent=2) + "\n")
    return path


def usual_of(examples: Sequence[Example], before: Features, form: str) -> Features:
    """Return the medians of the features of right answers; those of segments, and of ranges what only these have."""
    right = np.array([e.features for e in examples if e.right])
    medians = dict(zip(Features._fields, np.median(right, axis=0).tolist(), strict=True))
    return Features(**medians) if form == SEGMENTS else before._replace(**{name: medians[name] for name in BEAMS})


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--stride", type=int, default=1, help="take one in so many queries")
    parser.add_argument("--form", choices=tuple(TASKS), help="only these scans; by default both")
    parser.add_argument("--keep", type=Path, metavar="FOLDER", help="keep answers there, and read those that are")
    parser.add_argument("--write", action="store_true", help="write the models to the file that the verdict reads")
    args = parser.parse_args()
    models, fitted_on, usual = dict(MODELS), dict(FITTED_ON), USUAL
    for form in (args.form,) if args.form else TASKS:
        path = None if args.keep is None else args.keep / f"{form}.pickle"
        examples = collected(path, cases(form, args.stride))
        fitted = report(form, TASKS[form], examples)
        models |= fitted
        usual = usual_of(examples, usual, form)
        away = sum(e.stranger for e in examples)
        for task in TASKS[form]:
            fitted_on[task.name] = (
                f"{len(examples) - away} scans as {form} in their own map, {away} in that of another building or part "
                f"of it at a weight of {task.strangers:g}"
            )
    if args.write:
        print(f"\nWritten: {write(models, fitted_on, usual)}")
    else:
        for name, model in models.items():
            print(f"\n{name}: {as_document(model)}")


if __name__ == "__main__":
    main()
