"""Answers that each veto alone rejects, on drawn worlds that nothing was fitted to, and the probability as answered.

``python -m benchmarks.vetoes [--stride 1] [--keep FOLDER]``
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from association.verdict.models import MODELS
from association.verdict.tuning import USABLE_CAUTIOUS

from .curves import Answers
from .examples import RANGES, SEGMENTS, Example, collected
from .full_path import Answered, answered, by_model, veto_rows
from .reliability import print_bins
from .table import print_table


def verdicts(form: str, examples: Sequence[Example]) -> Answered:
    """Return the verdicts on answers by the present models, as the product gives them."""
    return answered(examples, by_model(MODELS[form], Answers.of(examples)), USABLE_CAUTIOUS)


def print_verdicts(form: str, examples: Sequence[Example]) -> None:
    """Print what each veto rejects, what is usable, and how often the answered probability is right."""
    found = verdicts(form, examples)
    right = np.array([e.right for e in examples])
    here = np.array([not e.stranger for e in examples])
    told = np.array([e.told for e in examples])
    print_table(
        f"Scans as {form}: answers with sufficient probabilities that one veto alone rejects",
        ("veto", "right", "wrong", "out of map"),
        veto_rows(examples, found.passes),
    )
    usable, away = found.usable, ~here
    print(
        f"\nOf {here.sum()} answers to scans in their map {right.sum()} are right, {(usable & here).sum()} usable, "
        f"{(usable & here & ~right).sum()} usable and wrong. Of {away.sum()} answers to out-of-map scans "
        f"{(usable & away).sum()} are usable; in {(usable & away & told).sum()} the scan shows that the pose is wrong."
    )
    stated = here & ~np.isnan(found.probability)
    print_bins(f"Scans as {form} in their own map, as answered", found.probability[stated], right[stated])


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.vetoes", description=__doc__)
    parser.add_argument("--stride", type=int, default=1, help="take one in so many cases")
    parser.add_argument("--keep", type=Path, metavar="FOLDER", help="keep answers there, and read those that are")
    args = parser.parse_args()
    for form in (RANGES, SEGMENTS):
        print_verdicts(form, collected(args.keep, form, args.stride, kept_for_report=True))


if __name__ == "__main__":
    main()
