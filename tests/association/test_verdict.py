"""Every part of the verdict, on explanations made by hand: at its limits, and drawn beside its twin."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings

from association import HardPrior, SoftPrior, Status, tuning
from association.context import SearchContext
from association.explain import Explanations
from association.options import Prior
from association.verdict import Verdict, judge

from .answers import answer_with, explanations_of, ranked, registered_corridor, registered_room, room
from .kernels.drawn import SEEDS
from .reference import verdict as twin
from .scenes import INSIDE, pose, same_pose

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


def assert_judged(one: Drawn) -> None:
    got, expected = one.verdict, one.expected
    for name in ("status", "usable", "contradicted"):
        assert getattr(got, name) == getattr(expected, name), name
    for name in ("probability", "margin", "runner_up"):
        assert getattr(got, name) == pytest.approx(getattr(expected, name)), name


@given(SEEDS)
@settings(max_examples=300, deadline=None)
def test_the_verdict_is_that_of_the_twin(seed: int) -> None:
    assert_judged(drawn(np.random.default_rng(seed)))


def test_the_verdict_changes_where_that_of_the_twin_does() -> None:
    """On both sides of every change of status between two answers; all kinds of changes come up."""
    rng, kinds = np.random.default_rng(5), set()
    for _ in range(200):
        one, other = drawn(rng, (None,)), drawn(rng, (None,))
        if one.expected.status is not one.towards(other, 1.0).expected.status:
            sides = one.border(other)
            for side in sides:
                assert_judged(side)
            kinds.add(kind_of(*sides))
    assert kinds >= {"explained", "right", "careful", "right with beams"}


def crossing(value: Callable[[float], object], high: float = 1.0, halvings: int = 40) -> tuple[float, float]:
    """Return two numbers from 0 to `high`, close to each other, between which a value changes."""
    low, below = 0.0, value(0.0)
    assert value(high) != below
    for _ in range(halvings):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if value(middle) == below else (low, middle)
    return low, high


def kind_of(one: Drawn, other: Drawn) -> str:
    """Say which chance decides between two answers that are next to each other."""
    a, b = one.expected, other.expected
    beams = " with beams" if one.context.with_beams else ""
    if Status.NO_MATCH in (a.status, b.status):
        return "explained"
    if min(a.right, b.right) < tuning.USABLE_PROBABILITY <= max(a.right, b.right):
        return f"right{beams}"
    for bar, kind in ((tuning.USABLE_CAUTIOUS, "careful"), (tuning.USABLE_BY_CHANCE, "careful by chance")):
        if min(a.careful, b.careful) < bar <= max(a.careful, b.careful):
            return f"{kind}{beams}"
    return "significance"


@pytest.mark.parametrize(("chance", "bar"), [(-9.0, tuning.USABLE_PROBABILITY), (-0.3, tuning.USABLE_BY_CHANCE)])
def test_an_answer_is_usable_from_the_limit_on(chance: float, bar: float) -> None:
    """With beams one probability decides alone, and it is told: the least that is enough is enough."""

    def leading(lead: float) -> Verdict:
        numbers = LIKELY._replace(rival=LIKELY.score - lead, chance=chance)
        return Drawn(room(with_beams=True), numbers).verdict

    low, high = crossing(lambda lead: leading(lead).probability >= bar, 40.0, 60)
    assert leading(low).status is Status.AMBIGUOUS
    assert leading(high).status is Status.OK
    assert leading(high).probability == pytest.approx(bar)


def sought(wanted: Callable[[Drawn], bool], **how: Any) -> Drawn:
    """Draw until an answer is as wanted."""
    rng = np.random.default_rng(0)
    every: Iterator[Drawn] = (replace(drawn(rng, (None,)), **how) for _ in range(20_000))
    return next(one for one in every if wanted(one))


def told(one: Drawn, chance: float) -> Status:
    """Return the status of an answer of another significance."""
    explanations = one.explanations
    assert explanations.answer is not None
    answer = replace(explanations.answer, significance=chance)
    return judge(one.context, replace(explanations, answer=answer)).status


def test_where_chance_scores_as_high_other_buildings_are_reckoned_with() -> None:
    """Beyond the limit an answer that would match strangers as well is none."""

    def is_doubtful(one: Drawn) -> bool:
        surer = replace(one, numbers=one.numbers._replace(chance=-9.0))
        return one.expected.status is Status.NO_MATCH is not surer.expected.status

    doubtful = sought(is_doubtful, context=room())
    assert told(doubtful, tuning.CHANCE) is not Status.NO_MATCH
    assert told(doubtful, math.nextafter(tuning.CHANCE, 1.0)) is Status.NO_MATCH


@pytest.mark.parametrize(("with_beams", "bar"), [(False, tuning.USABLE_CAUTIOUS), (True, tuning.USABLE_PROBABILITY)])
def test_where_chance_is_likely_to_score_as_high_an_answer_must_be_surer(with_beams: bool, bar: float) -> None:
    def is_unsure(one: Drawn) -> bool:
        return one.expected.status is Status.OK and bar <= one.expected.careful < tuning.USABLE_BY_CHANCE

    unsure = sought(is_unsure, context=room(with_beams))
    assert told(unsure, tuning.LIKELY_BY_CHANCE) is Status.OK
    assert told(unsure, math.nextafter(tuning.LIKELY_BY_CHANCE, 1.0)) is Status.AMBIGUOUS


@pytest.mark.parametrize(
    ("matched", "share", "status"),
    [
        (2, 0.69, Status.AMBIGUOUS),
        (2, 0.7, Status.OK),
        (3, 0.69, Status.OK),
        (1, 0.69, Status.AMBIGUOUS),
    ],
)
def test_a_corner_is_not_enough_where_most_of_the_scan_does_not_fit(matched: int, share: float, status: Status) -> None:
    numbers = LIKELY._replace(score=140.0, rival=40.0, share=share)
    assert Drawn(room(with_beams=True), numbers, matched).verdict.status is status


def test_nothing_found() -> None:
    """Outside of the window there may be something."""
    nothing = judge(room(), explanations_of(None))
    assert nothing == Verdict(Status.NO_MATCH, 0.0, False, None, None, None, False)
    assert judge(room(), explanations_of(None, ranked(inside=False))) == replace(nothing, contradicted=True)


def test_an_incomplete_search_is_never_usable() -> None:
    sure = Drawn(room())
    assert sure.verdict.usable
    stopped = replace(sure, complete=False).verdict
    assert (stopped.status, stopped.usable, stopped.contradicted) == (Status.OK, False, False)
    assert stopped.probability == sure.verdict.probability


@pytest.mark.parametrize(("more", "contradicted"), [(6.0, False), (6.01, True)])
@pytest.mark.parametrize("inside", [False, True])
def test_a_clearly_better_pose_elsewhere_contradicts(more: float, contradicted: bool, inside: bool) -> None:
    """By its score alone; the answer is then at most as likely as not, and no better than ambiguous."""
    best, prior = ranked(100.0), HardPrior(INSIDE, 1.0, 0.5)
    other = ranked(100.0 + more, -90.0, inside=inside)
    got = judge(room(with_beams=True, prior=prior), explanations_of(answer_with(best), other))
    assert got.contradicted is contradicted
    assert got.usable is not contradicted
    assert got.status is (Status.AMBIGUOUS if contradicted else Status.OK)
    assert (got.probability == 0.5) is contradicted


@pytest.mark.parametrize(("said", "contradicted"), [(-9.0, False), (-9.01, True)])
def test_a_prior_that_is_far_off_contradicts(said: float, contradicted: bool) -> None:
    """The status stays."""
    got = replace(Drawn(room(with_beams=True, prior=SOFT)), prior=said).verdict
    assert (got.status, got.contradicted, got.usable) == (Status.OK, contradicted, not contradicted)


def test_a_contradicted_answer_may_be_less_likely_than_a_half() -> None:
    unlikely = replace(Drawn(room(with_beams=True), LIKELY._replace(rival=109.9)), prior=-12.0)
    assert unlikely.verdict.contradicted
    assert unlikely.verdict.probability == pytest.approx(unlikely.expected.right)
    assert unlikely.verdict.probability < 0.5


def test_a_pose_that_left_its_window_contradicts() -> None:
    for prior, contradicted in ((AROUND, False), (BESIDE, True)):
        got = Drawn(room(with_beams=True, prior=prior)).verdict
        assert (got.status, got.contradicted, got.usable) == (Status.OK, contradicted, not contradicted)
        assert got.pose == registered_room().pose, "it is told all the same"
    nowhere = Numbers(6.0, 5.9, share=0.2, agreement=0.3, misfit=9.0, deviation=0.4, chance=-1e-3)
    nothing = Drawn(room(with_beams=True, prior=BESIDE), nowhere, matched=1).verdict
    assert (nothing.status, nothing.contradicted) == (Status.NO_MATCH, False)


def test_the_window_is_that_of_the_family_member_that_is_answered() -> None:
    """Of a corridor's poses the one nearest the prior lies in the window where the registered one does not."""
    beside = registered_corridor().pose
    assert beside is not None
    window = HardPrior(pose(beside.x + 5.0, beside.y, beside.theta), 1.0, 0.5)
    got = replace(Drawn(room(prior=window)), degenerate=True).verdict
    assert got.status is Status.DEGENERATE
    assert got.pose is not None
    assert same_pose(got.pose, window.pose, 1e-6, 1e-9)
    assert not got.contradicted


def test_margin_and_runner_up() -> None:
    """Both by value, and of rivals within the window."""
    best, outside = answer_with(ranked(80.0, -2.0)), ranked(79.0, inside=False)
    got = judge(room(), explanations_of(best, ranked(60.0, -3.0), ranked(40.0), outside))
    assert [got.margin, got.runner_up] == pytest.approx([21.0, 57.0 / 78.0])
    alone = judge(room(), explanations_of(best, outside))
    assert (alone.margin, alone.runner_up) == (None, None)
    below = judge(room(), explanations_of(best, ranked(2.0, -5.0)))
    assert [below.margin, below.runner_up] == pytest.approx([81.0, 0.0])
    spoken_against = judge(room(), explanations_of(answer_with(ranked(5.0, -6.0)), ranked(2.0, -4.0)))
    assert spoken_against.margin == pytest.approx(1.0)
    assert spoken_against.runner_up is None
