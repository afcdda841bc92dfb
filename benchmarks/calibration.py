"""Fits the verdict's probability on half of the buildings and reports it on the other half.

The chance that the best explanation is right is a logistic function of `association.verdict.features`, shared between
explanations that are about as good. Scans of floor plans (three levels of clutter), every second scan of each log, and
scans that were searched in the map of another building, where nothing is right. Buildings go to a half by a hash.

``python -m benchmarks.calibration [--stride 1] [--strangers 0.3]``
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from association import Deadline, MapIndex
from association.accept import accept, register_accepted
from association.candidates import find_candidates
from association.ranking import rank_candidates
from association.scan_rows import scan_rows
from association.verdict import COEFFICIENTS, TWIN_TEMPERATURE, features, is_degenerate

from .collection import Collection, MapKey, Query, held_out
from .outcomes import OPTIONS, is_right, other_map, progress
from .queries import floor_plans, logs
from .reliability import print_bins
from .table import print_table

RIDGE = 1e-2  # on standardised coefficients, in units of one answer
TEMPERATURES = (0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0)  # nats
THRESHOLDS = (0.9, 0.91, 0.92, 0.93, 0.94, 0.95, 0.96, 0.97, 0.98, 0.99)
GROUPS = ("scan", "scan_30", "scan_50", "logs", "strangers")


@dataclass(frozen=True, slots=True)
class Example:
    """An answer: what is known of it, and whether it is right.

    Attributes
    ----------
    group : str
        One of `GROUPS`.
    held : bool
        Of the half that is reported on.
    x : (k,) features
    gaps : (n,) how much less than the best the other explanations are worth, nats, 0 or less
    right, degenerate : bool
    """

    group: str
    held: bool
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
    x = features(ranked[0], ranked[1:])
    return Example(group, held_out(query.map), x, gaps, right, is_degenerate(registered))


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
        for n, query in enumerate(log.queries[::2]):
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


def log_loss(model: Model, examples: Sequence[Example], strangers: float) -> float:
    """Return the mean of minus the log of the chance given to what happened, nats."""
    p = np.clip(model.probabilities(examples), 1e-12, 1.0 - 1e-12)
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


def print_thresholds(title: str, model: Model, examples: Sequence[Example]) -> None:
    """Print for several thresholds the usable share by group and how many of those are wrong."""
    p = model.probabilities(examples)
    cells = []
    for threshold in THRESHOLDS:
        row = [f"{threshold:g}"]
        for group in GROUPS:
            mine = [(e, q) for e, q in zip(examples, p, strict=True) if e.group == group]
            usable = [e.right for e, q in mine if q >= threshold and not e.degenerate]
            row.append(f"{len(usable) / len(mine):.3f} ({usable.count(False)} wrong)" if mine else "")
        cells.append(row)
    print_table(title, ("usable from", *GROUPS), cells)


def report(title: str, model: Model, examples: Sequence[Example], strangers: float) -> None:
    """Print how a model does on some answers."""
    print(f"\n{title}: log-loss {log_loss(model, examples, strangers):.4f} over {len(examples)} answers")
    own = [e for e in examples if e.group != "strangers"]
    print_bins(f"{title}, scans in their own map", model.probabilities(own), np.array([e.right for e in own]))
    print_thresholds(f"{title}, usable share", model, examples)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--stride", type=int, default=1, help="take one in so many queries")
    parser.add_argument("--strangers", type=float, default=0.3, help="weight of a scan of another building")
    args = parser.parse_args()
    examples = collect(args.stride)
    half = [e for e in examples if not e.held]
    rest = [e for e in examples if e.held]
    cells = []
    models = [fit(half, args.strangers, temperature) for temperature in TEMPERATURES]
    for model in models:
        losses = [log_loss(model, part, args.strangers) for part in (half, rest)]
        cells.append((f"{model.temperature:g}", *(f"{v:.4f}" for v in losses)))
    print_table("Temperature of the twins", ("nats", "log-loss, fitted half", "log-loss, held-out half"), cells)
    best = min(models, key=lambda model: log_loss(model, half, args.strangers))
    print("\nCOEFFICIENTS = (" + ", ".join(f"{v:.4g}" for v in best.coefficients) + ")")
    print(f"TWIN_TEMPERATURE = {best.temperature:g}")
    report("Fitted, on the held-out half", best, rest, args.strangers)
    current = Model(np.array(COEFFICIENTS), TWIN_TEMPERATURE)
    if len(current.coefficients) == len(best.coefficients):
        report("As in association/verdict.py, on the held-out half", current, rest, args.strangers)


if __name__ == "__main__":
    main()
