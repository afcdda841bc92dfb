"""Fits the verdict's models, reports them by cross-validation over buildings, and writes them for `association.models`.

The chance that the best explanation is right is a logistic function of `association.features`, shared between
explanations that are about as good. Scans of floor plans (three levels of clutter) and logs, as segments and with their
raw ranges, and scans that were searched in the map of another building, where nothing is right: these count next to
nothing for the one probability, which is about scans of this map, and more for the cautious one, which an answer has to
pass too before a robot goes by it. What is reported of an answer comes from a fit without its building, or without its
log; the coefficients come from all.

``python -m benchmarks.calibration [--stride 1] [--write]``
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
from association.models import CAUTIOUS, FILE, PROBABILITY, WITH_BEAMS, Model
from association.tuning import TWIN_TEMPERATURE, USABLE_PROBABILITY

from .examples import STRANGERS, Example, collect, range_cases, segment_cases
from .reliability import print_bins
from .table import print_table

RIDGE = 1e-2  # on standardised coefficients, in units of one answer
TEMPERATURES = (0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0)  # nats
THRESHOLDS = (0.8, 0.85, 0.88, 0.9, 0.92, 0.94, 0.96)
GROUPS = ("scan", "scan_30", "scan_50", "logs", STRANGERS)


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
        The one in the file; the new one has the same terms.
    """

    name: str
    strangers: float
    current: Model


OF_SEGMENTS = (Task("probability", 0.02, PROBABILITY), Task("cautious", 0.3, CAUTIOUS))
OF_RANGES = (Task("with_beams", 0.3, WITH_BEAMS),)


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
    return np.array([1.0 / (1.0 + np.exp(e.gaps / temperature).sum()) for e in examples])


def _weights(examples: Sequence[Example], strangers: float) -> np.ndarray:
    return np.array([strangers if e.group == STRANGERS else 1.0 for e in examples])


def log_loss(probabilities: np.ndarray, examples: Sequence[Example], strangers: float) -> float:
    """Return the mean of minus the log of the chance given to what happened, nats."""
    p = np.clip(probabilities, 1e-12, 1.0 - 1e-12)
    right = np.array([e.right for e in examples])
    weights = _weights(examples, strangers)
    return float(-(weights * np.where(right, np.log(p), np.log1p(-p))).sum() / weights.sum())


def fit(examples: Sequence[Example], task: Task, temperature: float) -> Fitted:
    """Find the coefficients of greatest likelihood, with a small pull towards 0 on the standardised features."""
    names = task.current.names
    raw = np.array([[getattr(e.features, name) for name in names] for e in examples])
    middle, scale = raw.mean(axis=0), raw.std(axis=0)
    constant = scale < 1e-12
    middle[constant], scale[constant] = 0.0, 1.0
    z, shares = (raw - middle) / scale, _shares(examples, temperature)
    right = np.array([e.right for e in examples])
    weights = _weights(examples, task.strangers)

    def loss(w: np.ndarray) -> tuple[float, np.ndarray]:
        s = 1.0 / (1.0 + np.exp(-np.clip(z @ w, -500.0, 500.0)))
        p = np.clip(s * shares, 1e-12, 1.0 - 1e-12)
        total = -(weights * np.where(right, np.log(p), np.log1p(-p))).sum() + RIDGE * (w[~constant] ** 2).sum()
        # With p = s share: d log(p) = 1 - s, d log(1 - p) = -p (1 - s) / (1 - p), by the logit.
        slope = -weights * np.where(right, 1.0 - s, -p * (1.0 - s) / (1.0 - p))
        return float(total), z.T @ slope + 2.0 * RIDGE * np.where(constant, 0.0, w)

    w = minimize(loss, np.zeros(z.shape[1]), jac=True, method="BFGS").x / scale
    # What standardising took off goes to the constant feature.
    w[np.flatnonzero(constant)[0]] -= float(w[~constant] @ middle[~constant])
    return Fitted(Model(names, w), temperature)


def cross_validated(examples: Sequence[Example], task: Task, temperature: float) -> np.ndarray:
    """Return for each answer the probability by a fit to the other folds."""
    folds = np.array([e.fold for e in examples])
    out = np.zeros(len(examples))
    for here in np.unique(folds):
        fitted = fit([e for e in examples if e.fold != here], task, temperature)
        out[folds == here] = fitted.probabilities([e for e in examples if e.fold == here])
    return out


def print_thresholds(title: str, p: np.ndarray, careful: np.ndarray, examples: Sequence[Example]) -> None:
    """Print for several thresholds of the cautious model the usable share by group and how many of those are wrong."""
    cells = []
    for threshold in THRESHOLDS:
        row = [f"{threshold:g}"]
        for group in GROUPS:
            mine = [k for k, e in enumerate(examples) if e.group == group]
            passed = [k for k in mine if p[k] >= USABLE_PROBABILITY and careful[k] >= threshold]
            usable = [examples[k].right for k in passed if not examples[k].degenerate]
            row.append(f"{len(usable) / len(mine):.3f} ({usable.count(False)} wrong)" if mine else "")
        cells.append(row)
    print_table(title, ("usable from", *GROUPS), cells)


def print_changes(old: np.ndarray, new: np.ndarray, examples: Sequence[Example]) -> None:
    """Print which answers would become usable and which would no longer be, the rest of the verdict apart."""
    cells = []
    for what, gained in (("gained", True), ("lost", False)):
        row = [what]
        for group in GROUPS:
            changed = [
                e.right
                for e, before, after in zip(examples, old, new, strict=True)
                if e.group == group
                and not e.degenerate
                and (before >= USABLE_PROBABILITY) != (after >= USABLE_PROBABILITY)
                and (after >= USABLE_PROBABILITY) == gained
            ]
            row.append(f"{len(changed)} ({changed.count(False)} wrong)")
        cells.append(row)
    print_table(f"Answers over {USABLE_PROBABILITY:g}, beside the present model", ("", *GROUPS), cells)


def report(form: str, tasks: Sequence[Task], examples: Sequence[Example]) -> dict[str, Model]:
    """Print how present and new models do on one form of scans; return the new ones."""
    print(f"\n## Scans as {form}: {len(examples)} answers")
    cells: list[tuple[str, ...]] = []
    for temperature in TEMPERATURES:
        losses = [log_loss(cross_validated(examples, t, temperature), examples, t.strangers) for t in tasks]
        cells.append((f"{temperature:g}", *(f"{v:.4f}" for v in losses)))
    print_table("Temperature of the twins, cross-validated log-loss", ("nats", *(t.name for t in tasks)), cells)
    own = np.array([e.group != STRANGERS for e in examples])
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


def write(models: dict[str, Model], fitted_on: dict[str, str]) -> Path:
    """Write the file that `association.models` reads; return where it is."""
    path = Path(association.__file__).with_name(FILE)
    document = {
        "fitted_on": fitted_on,
        "models": {
            name: {term: float(f"{value:.4g}") for term, value in zip(m.names, m.coefficients.tolist(), strict=True)}
            for name, m in models.items()
        },
    }
    path.write_text(json.dumps(document, indent=2) + "\n")
    return path


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--stride", type=int, default=1, help="take one in so many queries")
    parser.add_argument("--write", action="store_true", help="write the models to the file that the verdict reads")
    args = parser.parse_args()
    models: dict[str, Model] = {}
    fitted_on: dict[str, str] = {}
    for form, tasks, cases in (
        ("segments", OF_SEGMENTS, segment_cases(args.stride)),
        ("ranges", OF_RANGES, range_cases(args.stride)),
    ):
        examples = collect(cases)
        models |= report(form, tasks, examples)
        own = sum(e.group != STRANGERS for e in examples)
        for task in tasks:
            fitted_on[task.name] = (
                f"{own} scans as {form} in their own map, {len(examples) - own} in that of another building at a "
                f"weight of {task.strangers:g}"
            )
    if args.write:
        print(f"\nWritten: {write(models, fitted_on)}")
    else:
        for name, model in models.items():
            terms = zip(model.names, model.coefficients, strict=True)
            print(f"\n{name}: " + ", ".join(f"{term} {value:.4g}" for term, value in terms))


if __name__ == "__main__":
    main()
