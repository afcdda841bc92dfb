"""Every part of the verdict at its limits, on explanations made by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from association import HardPrior, Status, tuning
from association.verdict import Verdict, judge

from .answers import answer_with, explanations_of, ranked, registered_corridor, registered_room, room
from .judged import AROUND, BESIDE, LIKELY, SOFT, Drawn, Numbers, crossing, sought
from .scenes import INSIDE, pose, same_pose


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
