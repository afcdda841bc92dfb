"""Agreement: the probability that an answer states agrees with how often such answers are right."""

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
    row = at_most(what, max(gaps, default=math.nan), None, 3.0, ".1f")
    told = f"{row.measured} ({len(gaps)} of {BINS} bins have {TELLING} answers)"
    return Row(row.what, told, row.goal, row.met, row.aim, row.aimed)


def reliability(outcomes: Sequence[Outcome]) -> list[tuple[int, float, float]]:
    """Return the bins of all that was answered with a pose that is not one of a family."""
    answered = [
        (o.result.probability, o.right)
        for o in outcomes
        if o.result.status is not Status.NO_MATCH and o.result.probability is not None
    ]
    return bins(np.array([p for p, _ in answered]), np.array([right for _, right in answered], dtype=bool))


def bins(probabilities: np.ndarray, right: np.ndarray) -> list[tuple[int, float, float]]:
    """Return for ten bins of probability the count of answers, the mean probability and the share that is right."""
    which = np.minimum((probabilities * BINS).astype(int), BINS - 1)
    return [
        (int(inside.sum()), mean(probabilities[inside]), mean(right[inside]))
        for inside in (which == b for b in range(BINS))
    ]


def print_reliability(title: str, outcomes: Sequence[Outcome]) -> None:
    cells = [
        (f"{b / BINS:.1f} to {(b + 1) / BINS:.1f}", str(count), *_told(count, p, share))
        for b, (count, p, share) in enumerate(reliability(outcomes))
    ]
    print_table(title, ("probability", "answers", "mean", "observed", "points off"), cells)


def _told(count: int, p: float, share: float) -> tuple[str, str, str]:
    return (f"{p:.3f}", f"{share:.3f}", f"{100 * (share - p):+.1f}") if count else ("", "", "")
