"""Fits the verdict's model, reports it by cross-validation over buildings, writes `association.verdict.models`.

An answer is right, a wrong pose of its map, or the scan was taken elsewhere. The model has the logarithm of the odds
against each of the latter two: a constant and a curve for each feature, which rises or falls throughout where the
feature speaks so. An answer is right with the probability ``m / (1 + exp(-a) + exp(-b))``, where m is its probability
among its alternatives. All three kinds are fitted at once, by their likelihood: scans of floor plans (three levels of
clutter), of logs and of drawn worlds, as segments and with their raw ranges, and scans of parts of drawn buildings that
their map does not show, of buildings of the same style, and mirrored ones. Out-of-map scans that no scan could tell are
left out, since the model would learn no more from them than to mistrust a scan that fits without fault. Those of other
kinds of buildings are reported only: the others would seem rare among them.

The report of an answer comes from a fit without its building, its log or its world; the coefficients come from all of
these. The drawn worlds that ``python -m benchmarks worlds`` reports on are never fitted on.

``python -m benchmarks.calibration [--stride 1] [--form segments] [--keep FOLDER] [--write [FILE]] [--held-out]``
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from association.verdict.features import AGAINST, FOR, ROLES, Features
from association.verdict.model import ELSEWHERE, MODELS, USUAL, WRONG, Curve, Model, Odds

from .examples import DRAWN, DRAWN_STRANGERS, RANGES, SEGMENTS, Example, collected
from .manifest import MODELS_FILE, data_of, manifest_of
from .outcomes import progress
from .table import print_table

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

FORMS = (SEGMENTS, RANGES)
BENDS = (0.2, 0.5, 0.8, 0.95)  # quantiles of a feature at which its curve may bend
RIDGE = 1.0  # on slopes of standardised pieces, in units of one answer
LEAST_BESIDE = 0.02  # fraction of the examples that lies on either side of a bend,
LEAST_PIECE = 0.01  # and of what the values come to in all that lies between two
REAL = 3.0  # a scan of a real plan or log counts as that many of drawn buildings
ON_MAPS = (0.5, 0.9, 1.0)
THRESHOLDS = (0.8, 0.85, 0.9, 0.95, 0.98, 0.99)
GROUPS = ("scan", "scan_30", "scan_50", "logs", DRAWN)
AWAY = (
    "unmapped", "sister", "rough_unmapped", "rough_sister", "narrow_unmapped", "narrow_sister",
    "other_type", "mirrored", "rough_mirrored",
)  # fmt: skip
BINS, TELLING = 10, 100  # bins of the probability, and answers that a bin has at least


@dataclass(frozen=True, slots=True)
class Answers:
    """Some examples as arrays, (n,) if not stated otherwise.

    Attributes
    ----------
    features, before_null : (n, d) float64
        In the order of `Features`, with the null score and with the least one.
    among : float64
        Probability of the answer among its alternatives.
    right, away, told, fixed : bool
        True if the answer is right; if the scan is of another building; if it is right, of this map, or the scan shows
        that it is not; if the walls fix the pose and no veto applies.
    weights : float64
    folds : str
    """

    features: Floats
    before_null: Floats
    among: Floats
    right: Flags
    away: Flags
    told: Flags
    fixed: Flags
    weights: Floats
    folds: NDArray[np.str_]

    @classmethod
    def of(cls, examples: Sequence[Example]) -> Answers:
        """Return the arrays of some examples."""
        drawn = np.array([e.group in (DRAWN, DRAWN_STRANGERS) for e in examples])
        return cls(
            np.array([e.features for e in examples], np.float64).reshape(len(examples), -1),
            np.array([e.before_null for e in examples], np.float64).reshape(len(examples), -1),
            np.array([e.among for e in examples]),
            np.array([e.right for e in examples], bool),
            np.array([e.stranger for e in examples], bool),
            np.array([e.told or not e.stranger for e in examples], bool),
            np.array([not e.degenerate and not e.vetoes for e in examples], bool),
            np.where(drawn, 1.0, REAL),
            np.array([e.fold for e in examples]),
        )

    def where(self, mask: Flags) -> Answers:
        """Return some of the answers."""
        return Answers(**{field.name: getattr(self, field.name)[mask] for field in fields(self)})


def features_of(form: str) -> tuple[str, ...]:
    """Return the features that a model may have: those of beams with ranges only."""
    return tuple(name for name, role in ROLES.items() if not (form == SEGMENTS and role.needs_beams))


def pieces(values: Floats, bends: Sequence[float]) -> Floats:
    """Return how far values go into each piece of the axis between bends: (n, bends + 1), their sum the value."""
    edges = np.array([-np.inf, *bends, np.inf])
    starts = np.where(np.isfinite(edges[:-1]), edges[:-1], 0.0)
    return np.asarray(np.clip(values[:, None], edges[:-1], edges[1:]) - starts)


def knots(values: Floats) -> tuple[float, ...]:
    """Return where the curve of a feature may bend: at quantiles of its values that have enough on either side."""
    least, greatest = float(values.min()), float(values.max())
    apart, found = LEAST_PIECE * (greatest - least), [least]
    for k in np.unique(np.quantile(values, BENDS)).tolist():
        enough = min(np.mean(values < k), np.mean(values > k)) >= LEAST_BESIDE
        if enough and k - found[-1] >= apart and greatest - k >= apart:
            found.append(k)
    return tuple(found[1:])


def fit(answers: Answers, names: Sequence[str]) -> Model:
    """Find the curves of greatest likelihood, with a pull towards 0 on the slopes of standardised pieces."""
    answers = answers.where(answers.told)
    bends = {name: knots(answers.features[:, Features._fields.index(name)]) for name in names}
    columns, bounds = [np.ones((len(answers.right), 1))], [(-np.inf, np.inf)]
    for name in names:
        values = answers.features[:, Features._fields.index(name)]
        columns.append(pieces(values, bends[name]))
        sign = ROLES[name].sign
        own = [(0.0 if sign == FOR else -np.inf, 0.0 if sign == AGAINST else np.inf)] * (len(bends[name]) + 1)
        bounds += own
    w = _most_likely(answers, np.hstack(columns), bounds * 2)
    odds = []
    for half in np.split(w, 2):
        curves, at = {}, 1
        for name in names:
            slopes = half[at : at + len(bends[name]) + 1]
            if np.any(slopes):
                changes = np.diff(slopes).tolist()
                curves[name] = Curve(float(slopes[0]), tuple(zip(bends[name], changes, strict=True)))
            at += len(slopes)
        odds.append(Odds(float(half[0]), curves))
    on_map = float(answers.weights @ ~answers.away) / float(answers.weights.sum())
    return Model(odds[0], odds[1], on_map)


def _most_likely(answers: Answers, raw: Floats, bounds: list[tuple[float, float]]) -> Floats:
    """Return the coefficients of some columns, (2 k,), of both odds; the first is constant."""
    middle, scale = raw.mean(axis=0), raw.std(axis=0)
    middle[0], scale[0] = 0.0, 1.0
    scale[scale < 1e-9] = np.inf  # what never changes says nothing
    z = (raw - middle) / scale
    k, n = z.shape[1], answers.weights
    pulled = np.arange(k) > 0
    right, away = answers.right, answers.away
    wrong = ~right & ~away
    rest = np.maximum(1e-9, 1.0 - answers.among)

    def loss(w: Floats) -> tuple[float, Floats]:
        a, b = np.clip(z @ w[:k], -40.0, 40.0), np.clip(z @ w[k:], -40.0, 40.0)
        by_a, by_b = np.exp(-a), np.exp(-b)
        total = 1.0 + by_a + by_b
        nats = -np.log(total) + np.where(right, np.log(np.maximum(1e-12, answers.among)), 0.0)
        nats += np.where(away, -b, 0.0) + np.where(wrong, np.log(rest + by_a), 0.0)
        of_a = by_a / total - np.where(wrong, by_a / (rest + by_a), 0.0)
        of_b = by_b / total - away
        value = -(n * nats).sum() + RIDGE * ((w[:k][pulled] ** 2).sum() + (w[k:][pulled] ** 2).sum())
        slope = np.concatenate([z.T @ (-n * of_a), z.T @ (-n * of_b)])
        return float(value), slope + 2.0 * RIDGE * np.where(np.tile(pulled, 2), w, 0.0)

    start = np.zeros(2 * k)
    options = {"maxiter": 2000, "maxfun": 5000}
    w = minimize(
        loss,
        start,
        jac=True,
        method="L-BFGS-B",
        bounds=bounds,
        options=options,  # type: ignore[call-overload]
    ).x
    halves = []
    for half in np.split(w, 2):
        half = half / scale
        half[0] -= half[1:] @ middle[1:]
        halves.append(half)
    return np.concatenate(halves)


def log_odds(odds: Odds, features: Floats) -> Floats:
    """Return the logarithm of the odds for each row of features, (n,)."""
    total = np.full(len(features), odds.constant)
    for name, curve in odds.curves.items():
        values = features[:, Features._fields.index(name)]
        total += curve.slope * values
        for start, more in curve.bends:
            total += more * np.maximum(0.0, values - start)
    return total


def probability(model: Model, answers: Answers, on_map: float) -> Floats:
    """Return the probability of each answer, with the null score only where it would be usable without."""
    prior = (1.0 - on_map) / on_map * model.on_map / (1.0 - model.on_map)

    def by(features: Floats) -> Floats:
        a, b = (np.clip(log_odds(odds, features), -500, 500) for odds in (model.wrong, model.elsewhere))
        return np.asarray(answers.among / (1.0 + np.exp(-a) + prior * np.exp(-b)))

    return np.minimum(by(answers.before_null), by(answers.features))


def log_loss(model: Model, answers: Answers) -> float:
    """Return the mean of minus the log of the probability of what happened, nats; of those that could be told."""
    here = answers.where(answers.told)
    prior = model.on_map
    p = np.clip(probability(model, replace(here, before_null=here.features), prior), 1e-12, 1.0 - 1e-12)
    return float(-(here.weights * np.where(here.right, np.log(p), np.log1p(-p))).sum() / here.weights.sum())


def cross_validated(answers: Answers, names: Sequence[str], on_maps: Sequence[float]) -> dict[float, Floats]:
    """Return the probabilities of each answer, by prior, by a fit to the other folds."""
    folds = np.unique(answers.folds)
    out = {on_map: np.zeros(len(answers.right)) for on_map in on_maps}
    for k, here in enumerate(folds):
        mine = answers.folds == here
        model = fit(answers.where(~mine), names)
        for on_map, values in out.items():
            values[mine] = probability(model, answers.where(mine), on_map)
        progress("cross-validated", k + 1, len(folds))
    return out


def report(form: str, examples: Sequence[Example], answers: Answers, by: dict[float, Floats]) -> dict[str, float]:
    """Print how often answers are usable, right and wrong; return metrics of the usual prior."""
    for on_map, p in by.items():
        cells = []
        for threshold in THRESHOLDS:
            usable = (p >= threshold) & answers.fixed
            row = [f"{threshold:g}"]
            for group in GROUPS:
                mine = np.array([e.group == group for e in examples])
                count = int(mine.sum())
                wrong = int((usable & mine & ~answers.right).sum())
                row.append(f"{(usable & mine).sum() / count:.3f} ({wrong} wrong)" if count else "")
            for condition in AWAY:
                mine = np.array([e.condition == condition and e.group == DRAWN_STRANGERS for e in examples])
                told = usable & mine & np.array([e.told for e in examples])
                row.append(f"{100.0 * told.sum() / mine.sum():.2f} %" if mine.any() else "")
            cells.append(row)
        print_table(f"Usable scans as {form}, on_map {on_map:g}", ("usable from", *GROUPS, *AWAY), cells)
    p, here = by[1.0], ~answers.away & answers.fixed
    order = np.flatnonzero(here)[np.argsort(p[here], kind="stable")]
    rows = [
        (f"{len(some)}", f"{p[some].mean():.3f}", f"{answers.right[some].mean():.3f}")
        for some in np.array_split(order, BINS)
    ]
    print_table(f"Probability, scans as {form} in their map, on_map 1", ("answers", "stated", "right"), rows)
    usable = (by[0.9] >= 0.95) & answers.fixed
    return {
        "usable_right": float((usable & answers.right).sum()),
        "usable_wrong_in_map": float((usable & ~answers.right & ~answers.away).sum()),
        "usable_out_of_map": float((usable & answers.away).sum()),
        "usable_out_of_map_told": float((usable & answers.away & answers.told).sum()),
    }


def as_document(model: Model) -> dict[str, Any]:
    """Do the opposite of `association.verdict.model.as_model`."""

    def odds(one: Odds) -> dict[str, list[float]]:
        numbers: dict[str, tuple[float, ...]] = {"constant": (one.constant,)}
        numbers |= {name: (c.slope, *(v for bend in c.bends for v in bend)) for name, c in one.curves.items()}
        return {key: [float(f"{value:.4g}") for value in values] for key, values in numbers.items()}

    return {"on_map": round(model.on_map, 4), WRONG: odds(model.wrong), ELSEWHERE: odds(model.elsewhere)}


def usual_of(examples: Sequence[Example], before: Features, form: str) -> Features:
    """Return the medians of the features of right answers; those of segments, and of ranges what only these have."""
    right = np.array([e.features for e in examples if e.right])
    medians = dict(zip(Features._fields, np.median(right, axis=0).tolist(), strict=True))
    if form == SEGMENTS:
        beams = {name: getattr(before, name) for name, role in ROLES.items() if role.needs_beams}
        return Features(**medians | beams)
    return before._replace(**{name: medians[name] for name, role in ROLES.items() if role.needs_beams})


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.calibration", description=__doc__)
    parser.add_argument("--stride", type=int, default=1, help="take one in so many queries")
    parser.add_argument("--form", choices=FORMS, help="only these scans; by default both")
    parser.add_argument("--keep", type=Path, metavar="FOLDER", help="keep answers there, and read those that are")
    parser.add_argument(
        "--write",
        type=Path,
        nargs="?",
        const=MODELS_FILE,
        metavar="FILE",
        help="write the models with their manifest; by default to the file that the verdict reads",
    )
    parser.add_argument("--held-out", action="store_true", help="fit nothing: report on the drawn worlds kept for it")
    args = parser.parse_args()
    if args.held_out:
        for form in (args.form,) if args.form else FORMS:
            examples = collected(args.keep, form, args.stride, kept_for_report=True)
            answers = Answers.of(examples)
            report(form, examples, answers, {one: probability(MODELS[form], answers, one) for one in ON_MAPS})
        return
    models, usual, data, metrics = dict(MODELS), USUAL, {}, {}
    for form in (args.form,) if args.form else FORMS:
        examples = collected(args.keep, form, args.stride)
        answers, names = Answers.of(examples), features_of(form)
        print(f"\n## Scans as {form}: {len(examples)} answers")
        models[form] = fit(answers, names)
        print(f"\nLog-loss, fitted: {log_loss(models[form], answers):.4f}")
        metrics[form] = report(form, examples, answers, cross_validated(answers, names, ON_MAPS))
        usual = usual_of(examples, usual, form)
        data[form] = data_of(examples)
    document = {
        "manifest": manifest_of(" ".join(["python -m benchmarks.calibration", *sys.argv[1:]]), data, metrics),
        "usual": {name: float(f"{value:.4g}") for name, value in usual._asdict().items()},
        "models": {name: as_document(model) for name, model in models.items()},
    }
    if args.write is None:
        print(json.dumps(document["models"], indent=2))
        return
    args.write.write_text(json.dumps(document, indent=2) + "\n")
    print(f"\nWritten: {args.write}")


if __name__ == "__main__":
    main()
