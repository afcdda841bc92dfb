"""Select the features of the verdict's models: one after the other, by the cross-validated log-loss.

Starting from the constant, each step adds the feature that takes most off the loss, until none takes off enough. The
result is printed for the lists of `benchmarks.calibration`; pairs are not selected.

``python -m benchmarks.selection --keep FOLDER [--form segments] [--least 0.0002]``, with the answers that
``python -m benchmarks.calibration --keep FOLDER`` stored.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from association.verdict.features import Features
from association.verdict.roles import FEATURES_OF
from association.verdict.tuning import ALTERNATIVE_TEMPERATURE

from .calibration import BEAMS, TASKS, cross_validated, told_loss
from .curves import Task
from .examples import SEGMENTS, Example, cases, collected

LEAST = 0.0002  # by which a feature has to lower the loss
OF_THE_NULL = FEATURES_OF["not_on_map"]  # known only of answers that would be usable


def candidates(form: str, task: Task) -> list[str]:
    """Return the features that a model may have: beams only with ranges, the null score only in the cautious one."""
    left_out = {"constant"}
    if form == SEGMENTS:
        left_out |= set(BEAMS)
    if task.strangers < 1.0:
        left_out |= set(OF_THE_NULL)
    return [name for name in Features._fields if name not in left_out]


def select(
    examples: Sequence[Example], task: Task, names: Sequence[str], least: float = LEAST
) -> list[tuple[str, float]]:
    """Return the selected features in order, each with the cross-validated log-loss that it leaves.

    Parameters
    ----------
    examples : sequence of Example
    task : Task
        Its features are not used, nor are its pairs.
    names : sequence of str
        The candidates.
    least : float
        By which each has to lower the loss, nats.
    """
    chosen, left = ["constant"], list(names)
    found = [("constant", _loss(examples, task, chosen))]
    while left:
        losses = {name: _loss(examples, task, [*chosen, name]) for name in left}
        best = min(left, key=lambda name: losses[name])
        if not losses[best] < found[-1][1] - least:
            break
        chosen.append(best)
        left.remove(best)
        found.append((best, losses[best]))
    return found


def _loss(examples: Sequence[Example], task: Task, names: Sequence[str]) -> float:
    tried = replace(task, names=tuple(names), pairs=())
    return told_loss(cross_validated(examples, tried, ALTERNATIVE_TEMPERATURE), examples, tried)


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.selection", description=__doc__)
    parser.add_argument("--keep", type=Path, metavar="FOLDER", required=True, help="read the stored answers from there")
    parser.add_argument("--form", choices=tuple(TASKS), help="only these scans; by default both")
    parser.add_argument("--least", type=float, default=LEAST, help="by which a feature has to lower the loss, nats")
    args = parser.parse_args()
    for form in (args.form,) if args.form else TASKS:
        examples = collected(args.keep / f"{form}.pickle", cases(form, 1))
        for task in TASKS[form]:
            print(f"\n{task.name}, {len(examples)} answers:")
            for name, loss in select(examples, task, candidates(form, task), args.least):
                print(f"{name}: {loss:.4f}", flush=True)


if __name__ == "__main__":
    main()
