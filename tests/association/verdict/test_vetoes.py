"""The table of vetoes: each applies at its limit and alone, and the verdict carries those that count."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import pytest

from association import Status
from association.consensus.tuning import CONTRADICTION
from association.verdict.reasons import ORDER, REASON_MESSAGES
from association.verdict.tuning import FAR_FROM_PRIOR, LEAST_IN_STEP, MIRRORED_BETTER, MOST_BEYOND, MOST_DISPLACED
from association.verdict.verdict import judge
from association.verdict.vetoes import VETOES, Findings, Origin, applied, contradict_prior, counted

from ..answers import explanations_of, ranked, room
from ..judged import BESIDE, LIKELY, PLAIN, SOFT, Drawn, judged_by

NOTHING = Findings(complete=True, score=50.0, score_elsewhere=20.0)
# For each veto findings just short of it, and just at it.
LIMITS: dict[str, tuple[Findings, Findings]] = {
    "better_elsewhere": (
        replace(NOTHING, score_elsewhere=50.0 + CONTRADICTION),
        replace(NOTHING, score_elsewhere=math.nextafter(50.0 + CONTRADICTION, 99.0)),
    ),
    "far_from_prior": (
        replace(NOTHING, prior=FAR_FROM_PRIOR),
        replace(NOTHING, prior=math.nextafter(FAR_FROM_PRIOR, -99.0)),
    ),
    "outside_window": (NOTHING, replace(NOTHING, outside_window=True)),
    "search_incomplete": (NOTHING, replace(NOTHING, complete=False)),
    "unobservable_direction": (NOTHING, replace(NOTHING, unobservable=True)),
    "few_walls": (NOTHING, replace(NOTHING, few_walls=True)),
    "imprecise": (
        replace(NOTHING, beyond_tolerance=MOST_BEYOND),
        replace(NOTHING, beyond_tolerance=math.nextafter(MOST_BEYOND, 1.0)),
    ),
    "out_of_step": (
        replace(NOTHING, in_step=LEAST_IN_STEP),
        replace(NOTHING, in_step=math.nextafter(LEAST_IN_STEP, 0.0)),
    ),
    "off_scale": (NOTHING, replace(NOTHING, off_scale=True)),
    "displaced_walls": (
        replace(NOTHING, displaced_walls=MOST_DISPLACED),
        replace(NOTHING, displaced_walls=math.nextafter(MOST_DISPLACED, 1.0)),
    ),
    "turned": (NOTHING, replace(NOTHING, turned=1e-9)),
    "mirrored": (
        replace(NOTHING, mirrored_better=math.nextafter(MIRRORED_BETTER, 0.0)),
        replace(NOTHING, mirrored_better=MIRRORED_BETTER),
    ),
}
SURE = {name: {"constant": [30.0]} for name in PLAIN}  # by which every answer is right


@pytest.fixture(autouse=True)
def sure_models() -> Iterator[None]:
    with judged_by(SURE):
        yield


def test_every_veto_has_limits_here() -> None:
    assert [veto.name for veto in VETOES] == list(LIMITS)


@pytest.mark.parametrize("name", LIMITS)
def test_a_veto_applies_from_its_limit_on_and_alone(name: str) -> None:
    short, at = LIMITS[name]
    assert applied(short) == ()
    assert [veto.name for veto in applied(at)] == [name]


def test_vetoes_apply_in_the_order_of_the_table() -> None:
    everything = Findings(False, 1.0, 99.0, -99.0, True, True, True, 0.0, True, 1.0, 1.0, 1.0, 9.0)
    assert [veto.name for veto in applied(everything)] == list(LIMITS)


def test_with_another_status_the_status_is_the_reason() -> None:
    """Vetoes of the contract count with each of them; along an open direction no wall decides."""
    every = {"better_elsewhere", "far_from_prior", "search_incomplete"}
    for status, more in (
        (Status.NO_MATCH, set[str]()),
        (Status.DEGENERATE, {"outside_window", "unobservable_direction"}),
        (
            Status.AMBIGUOUS,
            {
                "outside_window",
                "few_walls",
                "imprecise",
                "out_of_step",
                "off_scale",
                "displaced_walls",
                "turned",
                "mirrored",
            },
        ),
        (Status.OK, {"outside_window"}),
    ):
        assert {veto.name for veto in counted(VETOES, status)} == every | more


def test_a_veto_gives_reasons_that_have_messages() -> None:
    for veto in VETOES:
        assert veto.reasons
        assert set(veto.reasons) <= set(REASON_MESSAGES) & set(ORDER)
    assert {veto.name for veto in VETOES if contradict_prior((veto,))} == {
        "better_elsewhere",
        "far_from_prior",
        "outside_window",
    }
    assert {veto.name for veto in VETOES if veto.origin is Origin.CONTRACT} == {
        "better_elsewhere",
        "far_from_prior",
        "outside_window",
        "search_incomplete",
        "unobservable_direction",
    }


@pytest.mark.parametrize(
    ("one", "status", "names"),
    [
        (Drawn(room()), Status.OK, []),
        (Drawn(room(), thin=True), Status.AMBIGUOUS, ["few_walls"]),
        (Drawn(room(), thin=True, degenerate=True), Status.DEGENERATE, ["unobservable_direction"]),
        (Drawn(room(), complete=False), Status.OK, ["search_incomplete"]),
        (Drawn(room(prior=SOFT), prior=-10.0), Status.OK, ["far_from_prior"]),
        (Drawn(room(prior=BESIDE)), Status.OK, ["outside_window"]),
        (Drawn(room(), beyond=((99.0, False),)), Status.AMBIGUOUS, ["better_elsewhere"]),
        (
            Drawn(room(), thin=True, complete=False, beyond=((99.0, False),)),
            Status.AMBIGUOUS,
            ["better_elsewhere", "search_incomplete", "few_walls"],
        ),
    ],
)
def test_the_verdict_carries_the_vetoes_that_count(one: Drawn, status: Status, names: list[str]) -> None:
    """The models are sure; so an answer is usable exactly where there is none."""
    got = one.verdict
    assert got.status is status
    assert [veto.name for veto in got.vetoes] == names
    assert got.usable is (not names)
    codes = [reason.code for reason in got.reasons]
    assert {code for veto in got.vetoes for code in veto.reasons} <= set(codes)


def test_a_scale_that_was_not_corrected_is_a_veto() -> None:
    one = Drawn(room(), LIKELY)
    got = judge(one.context, one.explanations, off_scale=True)
    assert (got.status, [veto.name for veto in got.vetoes]) == (Status.AMBIGUOUS, ["off_scale"])
    assert "4 %" in got.reasons[0].message


def test_without_an_answer_the_prior_is_contradicted_where_something_fits_outside() -> None:
    assert judge(room(), explanations_of(None)).vetoes == ()
    (only,) = judge(room(), explanations_of(None, ranked(inside=False))).vetoes
    assert only.name == "better_elsewhere"


def test_a_verdict_that_is_cut_short_is_vetoed_in_the_order_of_the_table() -> None:
    cut = replace(Drawn(room(), thin=True), beyond=((99.0, False),)).verdict.cut_short()
    assert [veto.name for veto in cut.vetoes] == ["better_elsewhere", "search_incomplete", "few_walls"]
    assert cut.reasons[0].code == "search_incomplete"
    assert not cut.complete
