"""Answers whose verdict changes without a jump, and the verdict of the reference, by models that are not fitted."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import pytest

from association import HardPrior, SoftPrior
from association.context import SearchContext
from association.explanations import Explanations
from association.options import Prior
from association.verdict import alternatives, probabilities, reasons, verdict
from association.verdict.models import USUAL, as_model
from association.verdict.verdict import Verdict, judge

from .answers import (
    answer_with,
    estimated_of,
    explanations_of,
    leverages_of,
    ranked,
    registered_corridor,
    registered_room,
    room,
    walls_of_lines,
)
from .reference import verdict as twin
from .scenes import INSIDE, pose

AROUND, BESIDE = HardPrior(INSIDE, 1.0, 0.5), HardPrior(pose(5.0, 2.5, 0.7), 0.5, 0.5)
SOFT = SoftPrior(INSIDE, np.eye(3))

USUAL_DEVIATION = 0.03

# Of every kind of feature some; of one answer each of the two says something else.
PLAIN: dict[str, dict[str, list[float]]] = {
    "segments": {
        "constant": [-6.0], "lead": [0.1, 20.0, -0.05], "solitude": [0.02], "inlier_fraction": [5.0, 0.85, -4.0],
        "root_length": [0.31], "agreement": [3.5], "deviation": [-7.0], "misfit": [-0.7], "walls": [0.1],
        "critical_displacement": [-1.0], "null": [-1.0, 0.8, -6.0],
        "null_gap": [0.05], "null_better": [-3.0], "on_map": [1.0],
    },
    "ranges": {
        "constant": [-6.0], "lead": [0.1, 30.0, -0.1], "inlier_fraction": [6.0], "root_length": [1.0],
        "root_nearer": [-6.0], "root_passed": [-8.0], "deviation": [-4.0], "misfit": [-0.4], "null": [-2.0, 0.9, -9.0],
        "on_map": [1.5],
    },
}  # fmt: skip


@contextmanager
def judged_by(models: dict[str, dict[str, list[float]]], **bars: float) -> Iterator[None]:
    """Let these models decide, and these bars in place of those of `association.verdict`.

    Without the comparison with loose walls, which scores alternatives again: these are made by hand.
    """
    usual = USUAL._replace(deviation=USUAL_DEVIATION)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(probabilities, "MODELS", {name: as_model(curves) for name, curves in models.items()})
        for module in (probabilities, reasons):
            patch.setattr(module, "USUAL", usual)
        patch.setattr(alternatives, "probability_with_loose_walls", lambda *_: None)
        for name, value in bars.items():
            for module in (probabilities, verdict):
                patch.setattr(module, name, value, raising=module is verdict and not hasattr(probabilities, name))
        yield


class Numbers(NamedTuple):
    """Numbers on which an answer depends continuously.

    Attributes
    ----------
    score, rival : nats, of the best and of its first alternative
    share : of the scan's length that is matched
    agreement : share of directions
    misfit
    deviation : of the position, metres
    chance : log10 of the significance
    moves : by how much the pose would move without one wall, metres
    read, passed : shares of the beams
    wall_error : of the walls, as it turned out, metres
    cost : of the alternatives, over that of the best
    """

    score: float = 110.0
    rival: float = 70.0
    share: float = 0.95
    agreement: float = 0.95
    misfit: float = 1.0
    deviation: float = 0.01
    chance: float = -9.0
    moves: float = 0.02
    read: float = 0.0
    passed: float = 0.0
    wall_error: float = 0.015
    cost: float = 0.0


LIKELY = Numbers()


@dataclass(frozen=True)
class Drawn:
    """An answer.

    Attributes
    ----------
    context : SearchContext
    numbers : Numbers
    matched : int
        Of 8 segments.
    beyond : tuple of (score, inside)
        Of the other alternatives, over that of the first.
    prior : float
        What it says of the best.
    degenerate, thin, complete : bool
    """

    context: SearchContext
    numbers: Numbers = LIKELY
    matched: int = 8
    beyond: tuple[tuple[float, bool], ...] = ()
    prior: float = 0.0
    degenerate: bool = False
    thin: bool = False
    complete: bool = True

    @property
    def explanations(self) -> Explanations:
        n = self.numbers
        best = ranked(
            n.score,
            self.prior,
            matched=self.matched,
            walls=walls_of_lines(),
            fraction=n.share,
            misfit=n.misfit,
            read=n.read,
            passed=n.passed,
        )
        registered = registered_corridor() if self.degenerate else registered_room()
        leverages = leverages_of((0, n.moves, 0.01), (3, 0.001, 1.0 if self.thin else 0.02))
        estimated = estimated_of(registered, leverages, n.deviation, n.wall_error)
        chance = 10.0**n.chance
        answer = answer_with(best, registered, estimated=estimated, agreement=n.agreement, significance=chance)
        scores = [(n.rival, True), *((n.rival + more, inside) for more, inside in self.beyond)]
        # Within the window the best has the greatest value, whatever the prior says of an alternative.
        others = [
            ranked(
                s, min(0.0, best.posterior - s) if inside else 0.0, inside=inside, chi_square=best.chi_square + n.cost
            )
            for s, inside in scores
        ]
        return explanations_of(answer, *others, complete=self.complete)

    @property
    def verdict(self) -> Verdict:
        return judge(self.context, self.explanations)

    @property
    def expected(self) -> twin.Judged:
        return twin.judge(self.context, self.explanations, PLAIN, USUAL_DEVIATION)

    def towards(self, other: Drawn, share: float) -> Drawn:
        """Return the same answer with numbers between those of the two."""
        pairs = zip(self.numbers, other.numbers, strict=True)
        return replace(self, numbers=Numbers(*((1.0 - share) * a + share * b for a, b in pairs)))

    def border(self, other: Drawn) -> tuple[Drawn, Drawn]:
        """Return two answers between this and another one, next to each other, whose status should differ."""
        low, high = crossing(lambda share: self.towards(other, share).expected.status)
        return self.towards(other, low), self.towards(other, high)


def drawn(rng: np.random.Generator, priors: tuple[Prior | None, ...] = (None, SOFT, AROUND, BESIDE)) -> Drawn:
    prior = priors[int(rng.integers(len(priors)))]
    low = [5.0, 0.0, 0.2, 0.3, 0.3, 0.003, -12.0, 0.0, 0.0, 0.0, 0.003, -6.0]
    high = [120.0, 110.0, 1.0, 1.0, 9.0, 0.55, 0.0, 1.2, 1.0, 0.2, 0.08, 30.0]
    numbers = Numbers(*rng.uniform(low, high).tolist())
    numbers = numbers._replace(rival=min(numbers.rival, numbers.score + float(rng.choice([0.0, 0.0, 7.0]))))
    if rng.random() < 0.5:  # likely, or nearly
        numbers = numbers._replace(share=0.9, agreement=0.9, misfit=1.2, deviation=0.02, moves=0.05, passed=0.01)
    windowed, with_beams = isinstance(prior, HardPrior), bool(rng.random() < 0.4)
    if not with_beams:
        numbers = numbers._replace(read=0.0, passed=0.0)
    beyond = [(float(rng.normal() * 5.0), not windowed or rng.random() < 0.5) for _ in range(rng.integers(0, 4))]
    said = float(rng.choice([0.0, -1.0, -8.0, -10.0])) if isinstance(prior, SoftPrior) else 0.0
    matched, degenerate, thin = int(rng.integers(1, 9)), bool(rng.random() < 0.1), bool(rng.random() < 0.1)
    complete = bool(rng.random() < 0.9)
    return Drawn(room(with_beams, prior), numbers, matched, tuple(beyond), said, degenerate, thin, complete)


def crossing(value: Callable[[float], object], high: float = 1.0, halvings: int = 40) -> tuple[float, float]:
    """Return two numbers from 0 to `high`, close to each other, between which a value changes."""
    low, below = 0.0, value(0.0)
    assert value(high) != below
    for _ in range(halvings):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if value(middle) == below else (low, middle)
    return low, high
