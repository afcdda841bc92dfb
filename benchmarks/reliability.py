"""How well the probability that an answer states agrees with how often such answers are right."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from association import Status

from .outcomes import Outcome
from .table import Row, at_most, mean, print_table

BINS = 10
TELLING = 100  # answers in a bin from which its share is judged


def reliability_row(what: str, outcomes: Sequence[Outcome]) -> Row:
    """Judge the probability: its greatest distance from the observed share, over bins of 100 answers and more."""
    gaps = [100.0 * abs(p - share) for count, p, share in reliability(outcomes) if count >= TELLING]
    return at_most(what, max(gaps, default=math.nan), None, 3.0, ".1f")


def reliability(outcomes: Sequence[Outcome]) -> list[tuple[int, float, float]]:
    """Return for ten bins of `probability` the count of answers, the mean probability and the share that is right."""
    answered = [o for o in outcomes if o.result.status is not Status.NO_MATCH]
    p = np.array([o.result.probability for o in answered])
    right = np.array([o.right for o in answered], dtype=float)
    bins = np.minimum((p * BINS).astype(int), BINS - 1)
    return [(int(inside.sum()), mean(p[inside]), mean(right[inside])) for inside in (bins == b for b in range(BINS))]


def print_reliability(title: str, outcomes: Sequence[Outcome]) -> None:
    cells = [
        (f"{b / BINS:.1f} to {(b + 1) / BINS:.1f}", str(count), f"{p:.3f}", f"{share:.3f}", f"{100 * (share - p):+.1f}")
        for b, (count, p, share) in enumerate(reliability(outcomes))
    ]
    print_table(title, ("probability", "answers", "mean", "observed", "points off"), cells)
