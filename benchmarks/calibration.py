"""Fits the verdict's two probabilities, and reports them by cross-validation over buildings.

The chance that the best explanation is right is a logistic function of `association.verdict.features`, shared between
explanations that are about as good. Scans of floor plans (three levels of clutter) and logs, and scans that were
searched in the map of another building, where nothing is right: these count next to nothing for the one probability,
which is about scans of this map, and more for the other, which an answer has to pass too before a robot goes by it.
What is reported of an answer comes from a fit without its building, or without its log; the coefficients come from all.

``python -m benchmarks.calibration [--stride 1]``
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from association.accept import accept, register_accepted
from association.scan_rows import scan_rows
from scipy.optimize import minimize

from association import Deadline, MapIndex
from association.candidates import find_candidates
from association.ranking import rank_candidates
from association.sight import agreement
from association.verdict import (
    CAUTIOUS,
    COEFFICIENTS,
    TWIN_TEMPERATURE,
    USABLE_PROBABILITY,
    Evidence,
    features,
    is_degenerate,
)

from .collection import Collection, MapKey, Query, fold
from .outcomes import OPTIONS, is_right, other_map, progress
from .queries import floor_plans, logs
from .reliability import print_bins
from .table import print_table

RIDGE = 1e-2  # on standardised coefficients, in units of one answer
TEMPERATURES = (0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0)  # nats
THRESHOLDS = (0.8, 0.85, 0.88, 0.9, 0.92, 0.94, 0.96)
STRANGERS = 0.02  # weight of a scan of another building
STRANGERS_CAUTIOUS = 0.3
GROUPS = ("scan", "scan_30", "scan_50", "logs", "strangers")


@dataclass(frozen=True, slots=True)
class Example:
    """An answer: what is known of it, and whether it is right.

    Attributes
    ----------
    group : str
        One of `GROUPS`.
    fold : int
        It is reported on by a fit without that one.
    x : (k,) features
    gaps : (n,) how much less than the best the other explanations are worth, nats, 0 or less
    right, degenerate : bool
    """

    group: str
    fold: int
    x: np.ndarray
    gaps: np.ndarray
    right: bool
    degenerate: bool


def explain(index: MapIndex, query: Query, group: str, collection: Collection, *, own: bool) -> Example | None:
    """Search a scan up to the point where the verdict is due; None where there is no explanation."""
    scan = query.scan
    rows = scan_rows(scan, index.sigma, OPTIONS)
    candidates = find_candidates(index, rows, None, OPTIONS, Deadline())
    ranked = rank_candidates(index, scan, rows, candidates, (None, OPTIONS))
    if not ranked:
        return None
    registered = register_accepted(index, scan, accept(index, scan, rows, ranked[0]), OPTIONS)
    if registered is None:
        return None
    right = own and is_right(registered.pose, query.pose, collection)
    gaps = np.minimum(0.0, [r.value - ranked[0].value for r in ranked[1:]])
    evidence = Evidence(rows.rows[:, 4], agreement(index, scan, rows, ranked[0]), 0.0, False)
    x = features(ranked[0], ranked[1:], evidence)
    return Example(group, fold(query.map), x, gaps, right, is_degenerate(registered))


def collect(stride: int) -> list[Example]:
    """Search everything; one in `stride` of it."""
    plans = floor_plans(stride)
    away = other_map(plans)
    found: list[Example | None] = []
    for k, query in enumerate(plans.queries):
        found.append(explain(plans.index(query.map), query, query.level, plans, own=True))
        found.append(explain(plans.index(away[k]), query, "strangers", plans, own=False))
        progress(plans.name, k + 1, len(plans.queries))
    of_logs = logs(stride)
    for k, log in enumerate(of_logs):
        other = of_logs[(k + 1) % len(of_logs)]
        key: MapKey = next(iter(other.maps))
        for n, query in enumerate(log.queries):
            found.append(explain(log.index(query.map), query, "logs", log, own=True))
            if n % 4 == 0:
                found.append(explain(other.index(key), query, "strangers", log, own=False))
        progress(log.name, len(log.queries), len(log.queries))
    return [example for example in found if example is not None]


@dataclass(frozen=True, slots=True)
class Model:
    """Coefficients in raw units, and the temperature of the twins, nats."""

    coefficients: np.ndarray
    temperature: float

    def probabilities(self, examples: Sequence[Example]) -> np.ndarray:
        """Return the chance that each answer is right."""
        logits = np.array([e.x for e in examples]) @ self.coefficients
        return _shares(examples, self.temperature) / (1.0 + np.exp(-logits))


def _shares(examples: Sequence[Example], temperature: float) -> np.ndarray:
    return np.array([1.0 / (1.0 + np.exp(e.gaps / temperature).sum()) for e in examples])


def _weights(examples: Sequence[Example], strangers: float) -> np.ndarray:
    return np.array([strangers if e.group == "strangers" else 1.0 for e in examples])


def log_loss(probabilities: np.ndarray, examples: Sequence[Example], strangers: float) -> float:
    """Return the mean of minus the log of the chance given to what happened, nats."""
    p = np.clip(probabilities, 1e-12, 1.0 - 1e-12)
    right = np.array([e.right for e in examples])
    weights = _weights(examples, strangers)
    return float(-(weights * np.where(right, np.log(p), np.log1p(-p))).sum() / weights.sum())


def fit(examples: Sequence[Example], strangers: float, temperature: float) -> Model:
    """Find the coefficients of greatest likelihood, with a small pull towards 0 on the standardised features."""
    raw = np.array([e.x for e in examples])
    middle, scale = raw.mean(axis=0), raw.std(axis=0)
    constant = scale < 1e-12
    middle[constant], scale[constant] = 0.0, 1.0
    z, shares = (raw - middle) / scale, _shares(examples, temperature)
    right = np.array([e.right for e in examples])
    weights = _weights(examples, strangers)

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
    return Model(w, temperature)


def cross_validated(examples: Sequence[Example], strangers: float, temperature: float) -> np.ndarray:
    """Return for each answer the probability by a fit to the other folds."""
    folds = np.array([e.fold for e in examples])
    out = np.zeros(len(examples))
    for here in np.unique(folds):
        model = fit([e for e in examples if e.fold != here], strangers, temperature)
        out[folds == here] = model.probabilities([e for e in examples if e.fold == here])
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


def report(title: str, p: np.ndarray, careful: np.ndarray, examples: Sequence[Example]) -> None:
    """Print how two probabilities of each answer do."""
    losses = [f"{log_loss(q, examples, w):.4f}" for q, w in ((p, STRANGERS), (careful, STRANGERS_CAUTIOUS))]
    print(f"\n{title}: log-loss {losses[0]}, cautious {losses[1]}, over {len(examples)} answers")
    own = np.array([e.group != "strangers" for e in examples])
    right = np.array([e.right for e in examples])
    print_bins(f"{title}, scans in their own map", p[own], right[own])
    print_thresholds(f"{title}, usable share", p, careful, examples)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--stride", type=int, default=1, help="take one in so many queries")
    args = parser.parse_args()
    examples = collect(args.stride)
    cells = []
    for temperature in TEMPERATURES:
        losses = [
            log_loss(cross_validated(examples, strangers, temperature), examples, strangers)
            for strangers in (STRANGERS, STRANGERS_CAUTIOUS)
        ]
        cells.append((f"{temperature:g}", *(f"{v:.4f}" for v in losses)))
    print_table("Temperature of the twins, cross-validated log-loss", ("nats", "probability", "cautious"), cells)
    for name, strangers in (("COEFFICIENTS", STRANGERS), ("CAUTIOUS", STRANGERS_CAUTIOUS)):
        model = fit(examples, strangers, TWIN_TEMPERATURE)
        print(f"\n{name} = (" + ", ".join(f"{v:.4g}" for v in model.coefficients) + ")")
    tried = [cross_validated(examples, w, TWIN_TEMPERATURE) for w in (STRANGERS, STRANGERS_CAUTIOUS)]
    report("Cross-validated", tried[0], tried[1], examples)
    current = [Model(np.array(c), TWIN_TEMPERATURE).probabilities(examples) for c in (COEFFICIENTS, CAUTIOUS)]
    report("As in association/verdict.py", current[0], current[1], examples)


if __name__ == "__main__":
    main()
