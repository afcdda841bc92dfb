"""Fits the verdict's models, reports them by cross-validation over buildings, writes `association.verdict.models`.

The chance that the best explanation is right is a logistic function of `association.verdict.features`, shared between
explanations that are about as good. Scans of floor plans (three levels of clutter), of logs and of drawn worlds, as
segments and with their raw ranges, and scans that were searched in the map of another building or of another part of
it, where nothing is right: these count next to nothing for the one probability, which is about scans of this map, and
fully for the cautious one, which an answer has to pass too before a robot goes by it. The report of an answer
comes from a fit without its building, its log or its world; the coefficients come from all of these. The drawn worlds
that ``python -m benchmarks worlds`` reports on are never fitted on.

The tables are about the number that is answered: alternatives are compared again with walls off by more where an answer
would be usable, and vetoes apply. The fit itself takes the alternatives as they were scored.

``python -m benchmarks.calibration [--stride 1] [--form segments] [--keep FOLDER] [--write [FILE]]``
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from association.verdict.features import Features
from association.verdict.models import MODELS, USUAL, Model
from association.verdict.roles import ROLES
from association.verdict.tuning import ALTERNATIVE_TEMPERATURE, USABLE_CAUTIOUS

from .curves import Fitted, Task, fit, log_loss
from .examples import DRAWN, DRAWN_STRANGERS, RANGES, SEGMENTS, STRANGERS, Example, cases, collected
from .full_path import answered, veto_rows
from .manifest import MODELS_FILE, data_of, manifest_of
from .reliability import TELLING, bins, print_bins
from .table import print_table

TEMPERATURES = (0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0)  # nats
THRESHOLDS = (0.8, 0.85, 0.9, 0.92, 0.94, 0.95, 0.96, 0.97, 0.98, 0.985, 0.99)
GROUPS = ("scan", "scan_30", "scan_50", "logs", DRAWN, STRANGERS)
AWAY = (
    "unmapped", "other_type", "sister", "mirrored", "rough_unmapped", "rough_sister", "rough_mirrored",
)  # fmt: skip
KEPT = ("clean", "clutter_33", "clutter_66", "changed", "scaled_1", "walls_5cm", "rough")
"""Conditions of drawn worlds that are shown by themselves: of out-of-map scans, and of scans in the map."""


BEAMS = tuple(name for name, role in ROLES.items() if role.needs_beams)
# Chosen one after the other by what each takes off the cross-validated log-loss, until none takes off 0.0002 more.
LIKELY = (
    "constant", "deviation", "lead", "blocked", "agreement", "root_length", "inverse_count", "longest_unmatched",
    "log_significance",
)  # fmt: skip
LIKELY_WITH_BEAMS = ("constant", "solitude", "deviation", "agreement", "root_unmatched", "read", "root_count")
CAREFUL = (
    "constant", "null", "null_better", "longest_unmatched", "lead", "blocked", "root_unmatched", "inlier_fraction",
    "misfit_of_many", "root_length", "deviation", "solitude", "critical_deviation", "critical_displacement",
)  # fmt: skip
CAREFUL_WITH_BEAMS = (
    "constant", "null_gap", "longest_unmatched", "root_length", "passed", "inlier_fraction", "deviation", "null",
    "null_better", "read", "solitude", "lead", "root_unmatched", "agreement", "misfit_of_many", "critical_deviation",
    "critical_displacement",
    "root_farther", "root_nearer",
)  # fmt: skip
# Chosen likewise, each of the 45 pairs that promised most tried in both kinds, until none takes off 0.0003 more.
# Without deviations and critical walls: the map of the scan does not depend on free directions.
PAIRS = (
    ("least", "+misfit", "+root_count"), ("most", "-longest_unmatched", "+misfit_of_many"),
    ("least", "-blocked", "-misfit_of_many"), ("most", "-null", "-root_length"), ("most", "+lead", "+root_length"),
)  # fmt: skip
PAIRS_WITH_BEAMS = (
    ("least", "+misfit", "+root_count"), ("most", "+agreement", "+inlier_fraction"),
    ("most", "+root_length", "+solitude"),
    ("least", "-misfit", "+misfit_of_many"), ("least", "-null", "+solitude"), ("most", "-root_farther", "-root_nearer"),
)  # fmt: skip
BENDS = (0.2, 0.5, 0.8)  # quantiles of a feature at which its curve may bend
TASKS = {
    SEGMENTS: (
        Task("probability", 0.01, MODELS["probability"], LIKELY, ()),
        Task("cautious", 1.0, MODELS["cautious"], CAREFUL, BENDS, PAIRS),
    ),
    RANGES: (
        Task("probability_with_beams", 0.01, MODELS["probability_with_beams"], LIKELY_WITH_BEAMS, ()),
        Task("cautious_with_beams", 1.0, MODELS["cautious_with_beams"], CAREFUL_WITH_BEAMS, BENDS, PAIRS_WITH_BEAMS),
    ),
}


def cross_validated(examples: Sequence[Example], task: Task, temperature: float) -> np.ndarray:
    """Return for each answer the probability by a fit to the other folds."""
    folds = np.array([e.fold for e in examples])
    out = np.zeros(len(examples))
    for here in np.unique(folds):
        fitted = fit([e for e in examples if e.fold != here], task, temperature)
        out[folds == here] = fitted.probabilities([e for e in examples if e.fold == here])
    return out


def told_loss(probabilities: np.ndarray, examples: Sequence[Example], task: Task) -> float:
    """Return the log-loss over those answers that could be told."""
    of_those = [k for k, e in enumerate(examples) if e.told or not e.stranger]
    return log_loss(probabilities[of_those], [examples[k] for k in of_those], task.strangers)


def print_thresholds(title: str, p: np.ndarray, careful: np.ndarray, examples: Sequence[Example]) -> None:
    """Print for several thresholds of the cautious model the usable share by group and how many of those are wrong.

    Of drawn out-of-map scans, the share that is usable although the scan shows that it is wrong.
    """
    cells, kept = [], []
    for threshold in THRESHOLDS:
        usable = answered(examples, p, careful, threshold).usable
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
        kept.append([f"{threshold:g}"])
        for condition in KEPT:
            passed = [usable[k] for k, e in enumerate(examples) if e.condition == condition and e.group == DRAWN]
            kept[-1].append(f"{100.0 * np.mean(passed):.1f} %" if passed else "")
    print_table(title, ("usable from", *GROUPS, *AWAY), cells)
    print_table(f"{title}, drawn worlds", ("usable from", *KEPT), kept)


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
    print_table(f"Answers over {USABLE_CAUTIOUS:g}, next to the present model", ("", *GROUPS, DRAWN_STRANGERS), cells)


def report(form: str, tasks: Sequence[Task], examples: Sequence[Example]) -> dict[str, dict[str, float]]:
    """Print how present and new models do on one form of scans; return by model the metrics of the new ones."""
    print(f"\n## Scans as {form}: {len(examples)} answers")
    cells: list[tuple[str, ...]] = []
    for temperature in TEMPERATURES:
        losses = [told_loss(cross_validated(examples, t, temperature), examples, t) for t in tasks]
        cells.append((f"{temperature:g}", *(f"{v:.4f}" for v in losses)))
    print_table("Temperature of similar places, cross-validated log-loss", ("nats", *(t.name for t in tasks)), cells)
    tried = [cross_validated(examples, t, ALTERNATIVE_TEMPERATURE) for t in tasks]
    present = [Fitted(t.current, ALTERNATIVE_TEMPERATURE).probabilities(examples) for t in tasks]
    metrics: dict[str, dict[str, float]] = {}
    for title, found in (("present", present), ("cross-validated", tried)):
        metrics = {t.name: {"log_loss": told_loss(p, examples, t)} for t, p in zip(tasks, found, strict=True)}
        told = (f"{name} {some['log_loss']:.4f}" for name, some in metrics.items())
        print(f"\nLog-loss, {title}: {', '.join(told)}")
        metrics[tasks[0].name] |= print_answered(form, title, found, examples, tasks[-1].current)
        print_thresholds(f"Usable share of scans as {form}, {title}", found[0], found[-1], examples)
    print_changes(present[-1], tried[-1], examples)
    return metrics


def print_answered(
    form: str, title: str, found: Sequence[np.ndarray], examples: Sequence[Example], model: Model
) -> dict[str, float]:
    """Print how often the probability that is answered is right, and what each veto alone rejects; return metrics."""
    verdicts = answered(examples, found[0], found[-1], USABLE_CAUTIOUS, model)
    stated = np.array([not e.stranger for e in examples]) & ~np.isnan(verdicts.probability)
    right = np.array([e.right for e in examples])
    probability = verdicts.probability[stated]
    print_bins(f"Scans as {form} in their own map, as answered, {title}", probability, right[stated])
    print_table(
        f"Rejected by one veto alone, scans as {form}, {title}",
        ("veto", "right", "wrong", "out of map"),
        veto_rows(examples, verdicts.passes),
    )
    off = [abs(p - observed) for count, p, observed in bins(probability, right[stated]) if count >= TELLING]
    return {
        "worst_bin_points": 100.0 * max(off, default=float("nan")),
        "usable": float(verdicts.usable.sum()),
        "usable_wrong_in_map": float((verdicts.usable & ~right)[[not e.stranger for e in examples]].sum()),
        "usable_out_of_map": float(verdicts.usable[[e.stranger for e in examples]].sum()),
    }


def as_document(model: Model) -> dict[str, list[float]]:
    """Do the opposite of `association.verdict.models.as_model`."""
    numbers = {name: (curve.slope, *(v for bend in curve.bends for v in bend)) for name, curve in model.curves.items()}
    for pair in model.pairs:
        numbers[pair.key] = (pair.nats, *pair.from_to[0], *pair.from_to[1])
    return {key: [float(f"{value:.4g}") for value in values] for key, values in numbers.items()}


def write(path: Path, models: dict[str, Model], manifest: dict[str, Any], usual: Features) -> None:
    """Write the file that `association.verdict.models` reads."""
    document = {
        "manifest": manifest,
        "usual": {name: float(f"{value:.4g}") for name, value in usual._asdict().items()},
        "models": {name: as_document(model) for name, model in models.items()},
    }
    path.write_text(json.dumps(document, indent=2) + "\n")


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
    parser.add_argument(
        "--write",
        type=Path,
        nargs="?",
        const=MODELS_FILE,
        metavar="FILE",
        help="write the models with their manifest; by default to the file that the verdict reads",
    )
    args = parser.parse_args()
    models, usual, data = dict(MODELS), USUAL, {}
    tasks: list[Task] = []
    metrics: dict[str, dict[str, float]] = {}
    for form in (args.form,) if args.form else TASKS:
        path = None if args.keep is None else args.keep / f"{form}.pickle"
        examples = collected(path, cases(form, args.stride))
        metrics |= report(form, TASKS[form], examples)
        models |= {t.name: fit(examples, t, ALTERNATIVE_TEMPERATURE).model for t in TASKS[form]}
        usual = usual_of(examples, usual, form)
        data[form] = data_of(examples)
        tasks += TASKS[form]
    if args.write is None:
        for name, model in models.items():
            print(f"\n{name}: {as_document(model)}")
        return
    command = " ".join(["python -m benchmarks.calibration", *sys.argv[1:]])
    write(args.write, models, manifest_of(command, data, tasks, metrics), usual)
    print(f"\nWritten: {args.write}")


if __name__ == "__main__":
    main()
