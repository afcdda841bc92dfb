"""Answers whose verdict changes without a jump, beside what the twin says of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from association import HardPrior, SoftPrior
from association.context import SearchContext
from association.explain import Explanations
from association.options import Prior
from association.verdict import Verdict, judge

from .answers import answer_with, explanations_of, ranked, registered_corridor, registered_room, room
from .reference import verdict as twin
from .scenes import INSIDE, pose

AROUND, BESIDE = HardPrior(INSIDE, 1.0, 0.5), HardPrior(pose(5.0, 2.5, 0.7), 0.5, 0.5)
SOFT = SoftPrior(INSIDE, np.eye(3))


class Numbers(NamedTuple):
    """What an answer depends on without a jump.

    Attributes
    ----------
    score, rival : nats, of the best and of its first rival
    share : of the scan's length that is matched
    agreement : share of directions
    misfit
    deviation : of the position, metres
    chance : log10 of the significance
    """

    score: float = 110.0
    rival: float = 70.0
    share: float = 0.95
    agreement: float = 0.95
    misfit: float = 1.0
    deviation: float = 0.01
    chance: float = -9.0


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
        Of the other rivals, over that of the first.
    prior : float
        What it says of the best.
    degenerate, complete : bool
    """

    context: SearchContext
    numbers: Numbers = LIKELY
    matched: int = 8
    beyond: tuple[tuple[float, bool], ...] = ()
    prior: float = 0.0
    degenerate: bool = False
    complete: bool = True

    @property
    def explanations(self) -> Explanations:
        n = self.numbers
        spread = np.diag([n.deviation**2, 1e-6, 1e-6])
        best = ranked(n.score, self.prior, matched=self.matched, share=n.share, misfit=n.misfit, covariance=spread)
        registered = registered_corridor() if self.degenerate else registered_room()
        answer = answer_with(best, registered, agreement=n.agreement, significance=10.0**n.chance)
        scores = [(n.rival, True), *((n.rival + more, inside) for more, inside in self.beyond)]
        # Within the window the best has the greatest value, whatever the prior says of a rival.
        others = [ranked(s, min(0.0, best.value - s) if inside else 0.0, inside=inside) for s, inside in scores]
        return explanations_of(answer, *others, complete=self.complete)

    @property
    def verdict(self) -> Verdict:
        return judge(self.context, self.explanations)

    @property
    def expected(self) -> twin.Judged:
        return twin.judge(self.context, self.explanations, degenerate=self.degenerate)

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
    low, high = [5.0, 0.0, 0.2, 0.3, 0.3, 0.003, -12.0], [120.0, 110.0, 1.0, 1.0, 9.0, 0.45, 0.0]
    numbers = Numbers(*rng.uniform(low, high).tolist())
    numbers = numbers._replace(rival=min(numbers.rival, numbers.score + float(rng.choice([0.0, 0.0, 7.0]))))
    if rng.random() < 0.5:
        numbers = numbers._replace(share=0.9, agreement=0.9, misfit=1.2, deviation=0.02)  # likely, or nearly
    windowed = isinstance(prior, HardPrior)
    beyond = [(float(rng.normal() * 5.0), not windowed or rng.random() < 0.5) for _ in range(rng.integers(0, 4))]
    said = float(rng.choice([0.0, -1.0, -8.0, -10.0])) if isinstance(prior, SoftPrior) else 0.0
    context = room(bool(rng.random() < 0.4), prior)
    matched, degenerate = int(rng.integers(1, 9)), bool(rng.random() < 0.1)
    return Drawn(context, numbers, matched, tuple(beyond), said, degenerate, bool(rng.random() < 0.9))


def crossing(value: Callable[[float], object], high: float = 1.0, halvings: int = 40) -> tuple[float, float]:
    """Return two numbers from 0 to `high`, close to each other, between which a value changes."""
    low, below = 0.0, value(0.0)
    assert value(high) != below
    for _ in range(halvings):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if value(middle) == below else (low, middle)
    return low, high


def sought(wanted: Callable[[Drawn], bool], **how: Any) -> Drawn:
    """Draw until an answer is as wanted."""
    rng = np.random.default_rng(0)
    every: Iterator[Drawn] = (replace(drawn(rng, (None,)), **how) for _ in range(20_000))
    return next(one for one in every if wanted(one))
