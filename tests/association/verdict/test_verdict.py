"""Every part of the verdict at its limits, on explanations made by hand, by models that are not fitted."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import replace
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from association import AssociationOptions, Deadline, HardPrior, Reason, Status, associate, report
from association.consensus.consensus_set import ConsensusSet
from association.context import SearchContext
from association.search import candidates
from association.verdict import alternatives, chance, probabilities, tuning, verdict, vetoes
from association.verdict.verdict import Verdict, judge

from ..answers import answer_with, estimated_of, explanations_of, ranked, registered_corridor, registered_room, room
from ..judged import AROUND, BESIDE, LIKELY, PLAIN, SOFT, Drawn, Numbers, crossing, judged_by
from ..scenes import INSIDE, ROOM, equal_rooms, index_of, pose, same_pose, scan_of, seen

SURE = {name: {"constant": [30.0], "on_map": [0.0]} for name in PLAIN}  # by which every answer is right
THROUGH = AssociationOptions(exhaustive=True)
WITH_LOOSE_WALLS = alternatives.probability_with_loose_walls  # as it is before the models are replaced


@pytest.fixture(autouse=True)
def plain_models() -> Iterator[None]:
    with judged_by(PLAIN):
        yield


def leading(lead: float, *, with_beams: bool = False) -> Drawn:
    return Drawn(room(with_beams), LIKELY._replace(rival=LIKELY.score - lead))


@pytest.mark.parametrize(("form", "with_beams"), [("segments", False), ("ranges", True)])
def test_an_answer_is_usable_from_the_limit_on(form: str, with_beams: bool) -> None:
    """By the model for scans with beams, or that for scans without; however probable it is on a map that is known."""
    with judged_by({**SURE, form: {"constant": [-3.0], "lead": [0.2], "on_map": [30.0]}}, USABLE_CAUTIOUS=0.6):
        low, high = crossing(lambda lead: leading(lead, with_beams=with_beams).verdict.status, 40.0, 60)
        assert leading(low, with_beams=with_beams).verdict.status is Status.AMBIGUOUS
        usable = leading(high, with_beams=with_beams).verdict
    assert usable.usable
    # At the limit a similar place that is so far behind takes from the chance what is left of it.
    share = 1.0 / (1.0 + math.exp(-high))
    assert share / (1.0 + math.exp(3.0 - 0.2 * high)) == pytest.approx(0.6)
    assert usable.probability == pytest.approx(share)


def test_a_rival_that_a_second_look_finds_as_good_is_a_twin(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its stated score is 40 nats less, at the same place: scored again, it counts as much, in one of three looks.

    The mean of the three is the probability, and the least decides.
    """
    with judged_by(SURE):
        assert leading(40.0).verdict.usable
        monkeypatch.setattr(alternatives, "probability_with_loose_walls", WITH_LOOSE_WALLS)
        got = leading(40.0).verdict
    assert (got.status, got.usable) == (Status.AMBIGUOUS, False)
    assert got.probability == pytest.approx(0.5**0.1)
    assert "similar_place" in [reason.code for reason in got.reasons]


def test_alone_an_answer_has_no_twin_however_little_it_is_worth() -> None:
    """By a prior that likes the place little, it leads by less than similar places do, but there is none."""
    best, other = ranked(9.0, prior=-4.0), ranked(8.0, prior=-4.0, at=pose(9.0, 9.0))
    with judged_by({**SURE, "segments": {"constant": [-1.5], "lead": [0.2], "on_map": [30.0]}}):
        alone, beside = (judge(room(), explanations_of(answer_with(best), *others)) for others in ((), (other,)))
    assert alone.status is beside.status is Status.AMBIGUOUS
    assert (alone.margin, beside.margin) == (None, 1.0)
    assert [reason.code for reason in alone.reasons] == ["insufficient_evidence"]
    assert [reason.code for reason in beside.reasons] == ["similar_place"]


def test_the_probability_is_that_for_scans_of_the_map() -> None:
    """The cautious probability decides whether the answer is usable, and is not returned."""
    with judged_by({**SURE, "segments": {"constant": [0.0], "on_map": [3.0]}}):
        got = leading(40.0).verdict
    assert (got.status, got.usable) == (Status.AMBIGUOUS, False)
    assert got.probability == pytest.approx(1.0 / (1.0 + math.exp(-3.0)))


def test_twins_share_both_probabilities() -> None:
    with judged_by(SURE):
        assert leading(0.0).verdict.probability == pytest.approx(0.5)
        assert leading(0.0).verdict.status is Status.AMBIGUOUS
        with judged_by(SURE, USABLE_CAUTIOUS=0.6):
            assert leading(0.0).verdict.status is Status.AMBIGUOUS
        with judged_by(SURE, USABLE_CAUTIOUS=0.4):
            assert leading(0.0).verdict.status is Status.OK


@pytest.mark.parametrize(("explained", "status"), [(0.031, Status.AMBIGUOUS), (0.029, Status.NO_MATCH)])
def test_what_explains_the_scan_no_better_than_other_buildings_is_no_match(explained: float, status: Status) -> None:
    """Neither a similar place next to it nor a loose position makes it one; those are other questions."""
    constant = math.log(explained / (1.0 - explained))
    loose = {"constant": [constant + 100.0 * 0.03], "deviation": [-100.0, 0.03, 0.0], "on_map": [3.0]}
    with judged_by({**SURE, "segments": loose}):
        for numbers in (LIKELY, LIKELY._replace(rival=LIKELY.score), LIKELY._replace(deviation=0.4)):
            got = Drawn(room(), numbers).verdict
            assert got.status is status
            assert got.reasons[0].code == "not_on_map"
        free = Drawn(room(), LIKELY, degenerate=True).verdict
        assert free.status is (Status.DEGENERATE if status is Status.AMBIGUOUS else status)


@pytest.mark.parametrize("with_beams", [False, True])
def test_a_position_that_is_open_has_no_probability(with_beams: bool) -> None:
    """However sure the walls are: it is one pose of a family. Contradicted or cut short it has none either."""
    with judged_by(SURE):
        free = replace(leading(40.0, with_beams=with_beams), degenerate=True)
        for one in (free, replace(free, complete=False), replace(free, beyond=((50.0, False),))):
            got = one.verdict
            assert (got.status, got.usable, got.probability) == (Status.DEGENERATE, False, None)
        assert replace(free, degenerate=False).verdict.probability == pytest.approx(1.0)


@pytest.mark.parametrize("more", [0.01, -0.01])
def test_below_a_limit_the_scan_may_be_of_another_place(more: float) -> None:
    """Whatever the status is, but never of an answer that is usable."""
    bar = tuning.ELSEWHERE_PROBABILITY + more
    cautious = {"constant": [math.log(bar / (1.0 - bar))], "on_map": [30.0]}
    with judged_by({**SURE, "segments": cautious}):
        for one in (leading(40.0), replace(leading(40.0), degenerate=True)):
            assert ("not_on_map" in [reason.code for reason in one.verdict.reasons]) is (more < 0.0)
    with judged_by({**SURE, "segments": cautious}, USABLE_CAUTIOUS=0.05):
        assert leading(40.0).verdict.reasons == ()


def test_at_every_limit_itself_an_answer_is_usable() -> None:
    """All chances are one half, and so are the limits."""
    even = {name: {"constant": [0.0], "on_map": [0.0]} for name in PLAIN}
    names = ("USABLE_CAUTIOUS", "NO_MATCH_PROBABILITY", "ELSEWHERE_PROBABILITY")
    alone = explanations_of(answer_with(ranked()))
    assert alone.answer is not None
    with judged_by(even, **dict.fromkeys(names, 0.5)):
        got = judge(room(), alone)
        assert (got.status, got.usable, got.probability) == (Status.OK, True, 0.5)
        for in_step, usable in ((tuning.LEAST_IN_STEP, True), (tuning.LEAST_IN_STEP - 1e-9, False)):
            beams = replace(alone.answer.beams, in_step=in_step)
            assert judge(room(), replace(alone, answer=replace(alone.answer, beams=beams))).usable is usable
    for name, status in (("USABLE_CAUTIOUS", Status.AMBIGUOUS), ("NO_MATCH_PROBABILITY", Status.NO_MATCH)):
        with judged_by(even, **dict.fromkeys(names, 0.5) | {name: math.nextafter(0.5, 1.0)}):
            assert judge(room(), alone).status is status


def asked_of(one: Drawn, monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """Return up to which shares of the score the mirrored scan was searched while an answer was judged."""
    asked: list[float] = []

    def find_null_score(context: SearchContext, best: ConsensusSet, share: float) -> chance.NullScore:
        asked.append(share)
        return chance.find_null_score(context, best, share)

    with monkeypatch.context() as patch:
        patch.setattr(probabilities, "find_null_score", find_null_score)
        judge(one.context, one.explanations)
    return asked


def test_only_what_would_be_usable_is_compared_with_the_mirrored_scan(monkeypatch: pytest.MonkeyPatch) -> None:
    """It costs a search: not if a similar place, a free direction, the prior or a probability forbids it already."""
    sure = leading(40.0)
    most = tuning.NULL_FRACTIONS[-1]
    assert asked_of(sure, monkeypatch) == [most], "no other null takes anything from it"
    assert asked_of(replace(sure, complete=False), monkeypatch) == [0.0], "the reasons use it"
    for matters, share in ((most + 0.01, most), (1.01, 1.0), (0.96, 0.95), (0.71, 0.0)):
        with judged_by({**SURE, "segments": {"constant": [5.0], "null": [0.0, matters, -1000.0], "on_map": [0.0]}}):
            assert asked_of(sure, monkeypatch) == [share]
    better = Drawn(room(prior=AROUND), LIKELY, beyond=((LIKELY.score - LIKELY.rival + 10.0, False),))
    loose = replace(sure, numbers=LIKELY._replace(deviation=0.51))
    for one in (leading(0.0), replace(sure, degenerate=True), replace(sure, thin=True), loose, better):
        assert asked_of(one, monkeypatch) == []
    for on_map in (0.0, 30.0):
        with judged_by({**SURE, "segments": {"constant": [0.0], "on_map": [on_map]}}):
            assert asked_of(sure, monkeypatch) == []


def test_where_the_bar_is_next_to_one_every_null_matters(monkeypatch: pytest.MonkeyPatch) -> None:
    """Also where no odds are so great that rounding leaves room for a null."""
    for lacking in (1e-8, 1e-9, 5e-10, 1e-12):
        with judged_by(SURE, USABLE_CAUTIOUS=1.0 - lacking):
            assert asked_of(leading(400.0), monkeypatch) == [tuning.NULL_FRACTIONS[-1] if lacking > 2e-9 else 0.0]


def test_where_the_mirrored_scan_scores_as_high_the_answer_is_not_usable() -> None:
    """An answer with 20 nats, which the mirrored scan of ROOM has as well; it says nothing of an answer with 110."""
    with judged_by({**SURE, "segments": {"constant": [5.0], "null": [0.0, 0.9, -100.0], "on_map": [1.0]}}):
        strong, weak = (Drawn(room(), LIKELY._replace(score=s, rival=s - 30.0)).verdict for s in (110.0, 20.0))
    assert strong.usable
    assert weak.status is Status.AMBIGUOUS
    assert weak.probability == pytest.approx(strong.probability)
    assert weak.reasons[0].code == "not_on_map"


@pytest.mark.parametrize(("better", "usable"), [(0.019, True), (0.021, False)])
def test_what_fits_better_mirrored_is_not_usable(better: float, usable: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """However sure the models are, and whether the map is symmetric or not: the laser is upside down, or elsewhere."""
    score = (1.0 + better) * LIKELY.score
    monkeypatch.setattr(probabilities, "find_null_score", lambda *_: chance.NullScore(score, 1.0))
    with judged_by(SURE):
        got = leading(40.0).verdict
    assert (got.status, got.usable) == (Status.OK if usable else Status.AMBIGUOUS, usable)
    assert usable or got.reasons[0] == Reason("not_on_map", vetoes.MIRRORED)


def test_nothing_found() -> None:
    """Outside of the window there may be something."""
    nothing = judge(room(), explanations_of(None))
    assert replace(nothing, reasons=()) == Verdict(Status.NO_MATCH, 0.0, False, None, None, None, ())
    assert [reason.code for reason in nothing.reasons] == ["not_on_map"]
    outside = judge(room(), explanations_of(None, ranked(inside=False)))
    assert replace(outside, reasons=()) == replace(nothing, reasons=(), vetoes=(vetoes.BETTER_ELSEWHERE,))
    assert [reason.code for reason in outside.reasons] == ["prior_contradicted", "not_on_map"]


def test_an_incomplete_search_is_never_usable() -> None:
    sure = Drawn(room())
    assert sure.verdict.usable
    stopped = replace(sure, complete=False).verdict
    assert (stopped.status, stopped.usable, stopped.contradicted) == (Status.OK, False, False)
    assert stopped.probability == sure.verdict.probability
    assert [reason.code for reason in stopped.reasons] == ["search_incomplete"]


@pytest.mark.parametrize(
    ("module", "during"),
    [
        (candidates, "search"),
        (probabilities, "find_null_score"),
        (alternatives, "probability_with_loose_walls"),
        (verdict, "with_lines_of_sight"),
        (report, "with_lines_of_sight"),
        (report, "missing_segments"),
    ],
)
def test_what_is_compared_after_the_deadline_is_not_usable(
    module: ModuleType, during: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The deadline passes at the end of the search, while alternatives are compared, or later."""
    index = index_of(np.vstack([ROOM, equal_rooms(2)[8:-3]]))
    sent = scan_of(seen(ROOM, INSIDE)[0])
    compared, deadline = getattr(module, during), Deadline(time.monotonic() + 60.0)

    def late(*arguments: Any) -> Any:
        if during == "search":  # it would stop if it saw the deadline
            found = compared(*arguments)
            deadline.at = 0.0
            return found
        deadline.at = 0.0
        return compared(*arguments)

    in_time = associate(index, sent, None, THROUGH, Deadline(time.monotonic() + 60.0))
    assert in_time.usable
    assert (in_time.search.complete, in_time.search.exhaustive) == (True, True)
    assert in_time.search.complete_above < 1.0
    monkeypatch.setattr(module, during, late)
    got = associate(index, sent, None, THROUGH, deadline)
    assert deadline.at == 0.0
    assert not got.usable
    assert (got.search.complete, got.search.exhaustive, got.search.complete_above) == (False, False, 1.0)
    assert got.pose == in_time.pose
    assert got.reasons[0].code == "search_incomplete"
    assert "search_incomplete" in [warning.code for warning in got.warnings]


@pytest.mark.parametrize(("weakest", "usable"), [(0.499, True), (0.501, False)])
def test_no_usable_answer_states_a_deviation_beyond_half_a_metre(weakest: float, usable: bool) -> None:
    """However sure the models are; the position is then not fixed."""
    with judged_by(SURE):
        got = Drawn(room(), LIKELY._replace(deviation=weakest)).verdict
    assert got.usable is usable
    assert got.status is (Status.OK if usable else Status.DEGENERATE)


def test_few_walls_of_which_one_decides_are_not_enough() -> None:
    """However sure the models are; any building has such a corner."""
    with judged_by(SURE):
        got = replace(leading(40.0), thin=True).verdict
    assert (got.status, got.usable) == (Status.AMBIGUOUS, False)
    assert got.reasons[0].code == "insufficient_evidence"


@pytest.mark.parametrize(("more", "contradicted"), [(6.0, False), (6.01, True)])
@pytest.mark.parametrize("inside", [False, True])
def test_a_clearly_better_pose_elsewhere_contradicts(more: float, contradicted: bool, inside: bool) -> None:
    """By its score alone; the answer is then at most as likely as not, and no better than ambiguous."""
    best, prior = ranked(100.0), HardPrior(INSIDE, 1.0, 0.5)
    other = ranked(100.0 + more, -90.0, inside=inside)
    with judged_by(SURE):
        got = judge(room(with_beams=True, prior=prior), explanations_of(answer_with(best), other))
    assert got.contradicted is contradicted
    assert got.usable is not contradicted
    assert got.status is (Status.AMBIGUOUS if contradicted else Status.OK)
    assert (got.probability == 0.5) is contradicted
    assert ([reason.code for reason in got.reasons][:1] == ["prior_contradicted"]) is contradicted


@pytest.mark.parametrize(("said", "contradicted"), [(-9.0, False), (-9.01, True)])
def test_a_prior_that_is_far_off_contradicts(said: float, contradicted: bool) -> None:
    """The status stays."""
    with judged_by(SURE):
        got = replace(Drawn(room(with_beams=True, prior=SOFT)), prior=said).verdict
    assert (got.status, got.contradicted, got.usable) == (Status.OK, contradicted, not contradicted)


def test_a_contradicted_answer_may_be_less_likely_than_a_half() -> None:
    unlikely = replace(Drawn(room(with_beams=True), LIKELY._replace(rival=109.9)), prior=-12.0)
    assert unlikely.verdict.contradicted
    assert unlikely.verdict.probability is not None
    assert unlikely.verdict.probability == pytest.approx(unlikely.expected.right)
    assert unlikely.verdict.probability < 0.5


def test_a_pose_that_left_its_window_contradicts() -> None:
    for prior, contradicted in ((AROUND, False), (BESIDE, True)):
        got = Drawn(room(prior=prior)).verdict
        assert (got.status, got.contradicted, got.usable) == (Status.OK, contradicted, not contradicted)
        assert got.pose == registered_room().pose, "it is told all the same"
    nowhere = Numbers(6.0, 5.9, share=0.2, agreement=0.3, misfit=9.0, deviation=0.4, chance=-1e-3)
    nothing = Drawn(room(prior=BESIDE), nowhere, matched=1).verdict
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
    assert [reason.code for reason in got.reasons] == ["unobservable_direction"]


def test_margin_and_runner_up() -> None:
    """Both by value, and of alternatives within the window."""
    best, outside = answer_with(ranked(80.0, -2.0)), ranked(79.0, inside=False)
    got = judge(room(), explanations_of(best, ranked(60.0, -3.0), ranked(40.0), outside))
    assert [got.margin, got.runner_up] == pytest.approx([21.0, 57.0 / 78.0])
    alone = judge(room(), explanations_of(best, outside))
    assert (alone.margin, alone.runner_up) == (None, None)
    below = judge(room(), explanations_of(best, ranked(2.0, -5.0)))
    assert [below.margin, below.runner_up] == pytest.approx([81.0, 0.0])
    spoken_against = judge(room(), explanations_of(answer_with(ranked(5.0, -5.5)), ranked(2.0, -4.0)))
    assert spoken_against.margin == pytest.approx(1.5)
    assert spoken_against.runner_up is None
    worth_nothing = judge(room(), explanations_of(answer_with(ranked(5.0, -5.0)), ranked(2.0, -4.0)))
    assert worth_nothing.runner_up is None


def test_of_a_pose_that_is_fixed_the_registered_one_is_answered() -> None:
    estimated = estimated_of(registered_room(), weakest=0.2)
    got = judge(room(), explanations_of(answer_with(ranked(), estimated=estimated)))
    assert got.pose == registered_room().pose
