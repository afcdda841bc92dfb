"""Fits the verdict's models, reports them by cross-validation over buildings, writes `association.verdict.models`.

The probability that the best explanation is right is a logistic function of `association.verdict.features`, shared
between explanations that are about as good. Scans of floor plans (three levels of clutter), of logs and of drawn
worlds, as segments and with their raw ranges, and scans that were searched in the map of another building or of another
part of it, where nothing is right. A robot goes by an answer only if it is probable with these. The probability that is
answered holds for scans that are known to be of this map: it has the same log odds and a constant more. The report of
an answer comes from a fit without its building, its log or its world; the coefficients come from all of these. The
drawn worlds that ``python -m benchmarks worlds`` reports on are never fitted on.

The tables are about the number that is answered, and vetoes apply.

The features and pairs are those of the present models; ``--select`` selects them again.

``python -m benchmarks.calibration [--stride 1] [--form segments] [--keep FOLDER] [--select] [--write [FILE]]``
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
from association.verdict.models import MANIFEST, MODELS, ON_MAP, USUAL, Model
from association.verdict.roles import ROLES
from association.verdict.tuning import USABLE_CAUTIOUS

from .curves import Answers, Task, fit, log_loss
from .examples import DRAWN, DRAWN_STRANGERS, RANGES, SEGMENTS, STRANGERS, Example, collected
from .full_path import Answered, Probabilities, answered, by_model, veto_rows
from .manifest import MODELS_FILE, data_of, manifest_of
from .outcomes import progress
from .reliability import TELLING, bins, print_bins
from .selection import Selected, candidates, select
from .table import print_table

FORMS = (SEGMENTS, RANGES)
THRESHOLDS = (0.8, 0.85, 0.9, 0.92, 0.94, 0.95, 0.96, 0.97, 0.98, 0.985, 0.99)
GROUPS = ("scan", "scan_30", "scan_50", "logs", DRAWN, STRANGERS)
AWAY = (
    "unmapped", "other_type", "sister", "mirrored", "rough_unmapped", "rough_sister", "rough_mirrored",
)  # fmt: skip
KEPT = ("clean", "clutter_33", "clutter_66", "changed", "scaled_1", "walls_5cm", "rough")
"""Conditions of drawn worlds that are shown by themselves: of out-of-map scans, and of scans in the map."""


def present_task(form: str) -> Task:
    """Return the features and pairs of the present model."""
    part = MANIFEST["models"][form]
    pairs = tuple((str(kind), str(one), str(other)) for kind, one, other in part["pairs"])
    return Task(form, tuple(part["features"]), pairs, tuple(part["bends"]))


def cross_validated(answers: Answers, task: Task) -> Probabilities:
    """Return the probabilities of each answer by a fit to the other folds."""
    out = np.zeros((4, len(answers.right)))
    folds = np.unique(answers.folds)
    for k, here in enumerate(folds):
        mine = answers.folds == here
        one = by_model(fit(answers.where(~mine), task), answers.where(mine))
        out[:, mine] = one.likely, one.fitted, one.careful, one.explained
        progress(f"cross-validated as {task.form}", k + 1, len(folds))
    return Probabilities(*out)


def print_thresholds(title: str, p: Probabilities, examples: Sequence[Example]) -> None:
    """Print for several thresholds of the cautious probability the usable share by group and how many are wrong.

    Of drawn out-of-map scans, the share that is usable although the scan shows that it is wrong.
    """
    cells, kept = [], []
    for threshold in THRESHOLDS:
        usable = answered(examples, p, threshold).usable
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


def report(task: Task, examples: Sequence[Example]) -> dict[str, float]:
    """Print how the present and the new model do on one form of scans; return the metrics of the new one."""
    print(f"\n## Scans as {task.form}: {len(examples)} answers")
    answers = Answers.of(examples)
    metrics: dict[str, float] = {}
    found = {"present": by_model(MODELS[task.form], answers), "cross-validated": cross_validated(answers, task)}
    for title, p in found.items():
        here = answers.where(~answers.away)
        metrics = {
            "log_loss": log_loss(p.fitted, answers),
            "log_loss_on_map": log_loss(p.likely[~answers.away], here),
        }
        print(f"\nLog-loss, {title}: {metrics['log_loss']:.4f}; on the map {metrics['log_loss_on_map']:.4f}")
        metrics |= print_answered(task.form, title, answered(examples, p, USABLE_CAUTIOUS), answers, examples)
        print_thresholds(f"Usable share of scans as {task.form}, {title}", p, examples)
    return metrics


def print_answered(
    form: str, title: str, verdicts: Answered, answers: Answers, examples: Sequence[Example]
) -> dict[str, float]:
    """Print how often the probability that is answered is right, and what each veto alone rejects; return metrics."""
    stated = ~answers.away & ~np.isnan(verdicts.probability)
    probability, right = verdicts.probability[stated], answers.right
    print_bins(f"Scans as {form} in their own map, as answered, {title}", probability, right[stated])
    print_table(
        f"Rejected by one veto alone, scans as {form}, {title}",
        ("veto", "right", "wrong", "out of map"),
        veto_rows(examples, verdicts.passes),
    )
    off = [abs(p - observed) for count, p, observed in bins(probability, right[stated]) if count >= TELLING]
    return {
        "worst_bin_points": 100.0 * max(off, default=float("nan")),
        "usable_right": float((verdicts.usable & right).sum()),
        "usable_wrong_in_map": float((verdicts.usable & ~right & ~answers.away).sum()),
        "usable_out_of_map": float((verdicts.usable & answers.away).sum()),
        "usable_out_of_map_told": float((verdicts.usable & answers.away & answers.told).sum()),
    }


def as_document(model: Model) -> dict[str, list[float]]:
    """Do the opposite of `association.verdict.models.as_model`."""
    numbers = {name: (curve.slope, *(v for bend in curve.bends for v in bend)) for name, curve in model.curves.items()}
    for pair in model.pairs:
        numbers[pair.key] = (pair.nats, *pair.from_to[0], *pair.from_to[1])
    numbers[ON_MAP] = (model.on_map,)
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
    if form == SEGMENTS:
        beams = {name: getattr(before, name) for name, role in ROLES.items() if role.needs_beams}
        return Features(**medians | beams)
    return before._replace(**{name: medians[name] for name, role in ROLES.items() if role.needs_beams})


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.calibration", description=__doc__)
    parser.add_argument("--stride", type=int, default=1, help="take one in so many queries")
    parser.add_argument("--form", choices=FORMS, help="only these scans; by default both")
    parser.add_argument("--keep", type=Path, metavar="FOLDER", help="keep answers there, and read those that are")
    parser.add_argument("--select", action="store_true", help="select the features and pairs again")
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
    fitted: list[tuple[Task, list[Selected], dict[str, float]]] = []
    for form in (args.form,) if args.form else FORMS:
        examples = collected(args.keep, form, args.stride)
        answers, task = Answers.of(examples), present_task(form)
        steps: list[Selected] = []
        if args.select:
            task, steps = select(answers, form, candidates(form))
            print_table(
                f"Selected for scans as {form}", ("added", "log-loss"), [(s.added, f"{s.loss:.4f}") for s in steps]
            )
        fitted.append((task, steps, report(task, examples)))
        models[form] = fit(answers, task)
        usual = usual_of(examples, usual, form)
        data[form] = data_of(examples)
    if args.write is None:
        for name, model in models.items():
            print(f"\n{name}: {as_document(model)}")
        return
    command = " ".join(["python -m benchmarks.calibration", *sys.argv[1:]])
    write(args.write, models, manifest_of(command, data, fitted), usual)
    print(f"\nWritten: {args.write}")


if __name__ == "__main__":
    main()
