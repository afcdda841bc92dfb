"""Why an answer is not usable is reported where it is so, and only there, the weightiest first."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import pytest

from association import AssociationResult, Deadline, HardPrior, Status, associate
from association.verdict import reasons
from association.verdict.features import Features
from association.verdict.models import USUAL, as_model
from association.verdict.reasons import REASON_MESSAGES, Doubts, reasons_of
from association.verdict.roles import FEATURES_OF, ROLES
from association.verdict.tuning import NO_ALTERNATIVE, TELLING_REASON
from association.verdict.vetoes import Findings, applied, counted

from ..scenes import CORRIDOR, INSIDE, ROOM, answer_of, equal_rooms, index_of, maze, pose, scan_of, seen

USUAL_ONE = Features(*([0.0] * len(Features._fields)))
# One feature of each reason, from which every unit takes a nat.
MODEL = as_model({name: [-1.0] for name in ("lead", "critical_displacement", "inlier_fraction", "root_length", "null")})
ONE_OF = {
    "similar_place": "lead",
    "single_wall": "critical_displacement",
    "map_mismatch": "inlier_fraction",
    "insufficient_evidence": "root_length",
}
ONE_OF["not_on_map"] = "null"
NOTHING: Mapping[str, float] = {}


@pytest.fixture(autouse=True)
def usual_answer() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(reasons, "USUAL", USUAL_ONE)
        yield


def codes_of(
    status: Status = Status.AMBIGUOUS,
    taken: Mapping[str, float] = NOTHING,
    *,
    complete: bool = True,
    contradicted: bool = False,
    strange: bool = False,
    thin: bool = False,
    twin: bool = False,
) -> list[str]:
    """Return the codes of an answer of which these reasons take so many nats."""
    findings = Findings(complete, prior=-100.0 if contradicted else 0.0, unobservable=True, few_walls=thin)
    vetoes = counted(applied(findings), status)
    standing = Doubts(status, vetoes, not_on_map=strange, similar_place=twin)
    features = USUAL_ONE._replace(**{ONE_OF[code]: nats for code, nats in taken.items()})
    told = reasons_of(standing, features, MODEL)
    assert all(reason.message == REASON_MESSAGES[reason.code] for reason in told)
    return [reason.code for reason in told]


@pytest.mark.parametrize("code", sorted(ONE_OF))
def test_what_takes_from_the_odds_is_the_reason(code: str) -> None:
    """Alone, whether it is much or little: something has to be."""
    assert codes_of(taken={code: 5.0}) == [code]
    assert codes_of(taken={code: 0.1}) == [code]


def test_the_weightiest_comes_first_and_what_weighs_little_is_not_told() -> None:
    just, less = TELLING_REASON + 0.01, TELLING_REASON - 0.01
    taken = {
        "similar_place": 2.0,
        "map_mismatch": 7.0,
        "insufficient_evidence": just,
        "single_wall": less,
        "not_on_map": -4.0,
    }
    assert codes_of(taken=taken) == ["map_mismatch", "similar_place", "insufficient_evidence"]


def test_several_features_of_a_reason_count_together() -> None:
    """Each of the features has a role."""
    assert set(ROLES) == set(Features._fields) - {"constant"}
    model = as_model({"lead": [-1.0], "solitude": [-1.0], "inlier_fraction": [-1.0]})
    features = USUAL_ONE._replace(lead=0.8, solitude=0.8, inlier_fraction=1.2)
    told = reasons_of(Doubts(Status.AMBIGUOUS), features, model)
    assert [reason.code for reason in told] == ["similar_place", "map_mismatch"]


def test_what_is_far_behind_is_no_twin() -> None:
    model = as_model({"solitude": [1.0], "root_length": [1.0]})
    standing = Doubts(Status.AMBIGUOUS)

    def codes_at(lead: float, *, alone: bool = False) -> list[str]:
        features = USUAL_ONE._replace(lead=lead, solitude=-3.0, root_length=-2.0)
        return [reason.code for reason in reasons_of(replace(standing, alone=alone), features, model)]

    assert codes_at(NO_ALTERNATIVE) == ["similar_place", "insufficient_evidence"]
    assert codes_at(NO_ALTERNATIVE + 0.01) == ["insufficient_evidence"]
    assert codes_at(NO_ALTERNATIVE, alone=True) == ["insufficient_evidence"]


def test_what_the_verdict_is_comes_before_what_is_weighed() -> None:
    """The prior, the deadline, another building, a thin answer; nothing twice."""
    everything = codes_of(
        complete=False,
        contradicted=True,
        strange=True,
        thin=True,
        taken={"similar_place": 3.0, "insufficient_evidence": 4.0},
    )
    thin = ["insufficient_evidence", "single_wall"]
    assert everything == ["prior_contradicted", "search_incomplete", "not_on_map", *thin, "similar_place"]
    assert codes_of(thin=True, taken={"map_mismatch": 3.0}) == [*thin, "map_mismatch"]
    assert codes_of(strange=True, taken={"not_on_map": 9.0}) == ["not_on_map"]
    assert codes_of(twin=True, taken={"map_mismatch": 3.0}) == ["similar_place", "map_mismatch"], (
        "whatever the models make of it"
    )


@pytest.mark.parametrize("status", [Status.OK, Status.NO_MATCH])
def test_where_the_models_do_not_decide_they_are_not_asked(status: Status) -> None:
    assert codes_of(status, taken={"similar_place": 9.0}) == []
    assert codes_of(status, complete=False, taken={"similar_place": 9.0}) == ["search_incomplete"]
    assert codes_of(status, contradicted=True, taken={"similar_place": 9.0}) == ["prior_contradicted"]


def test_a_free_direction_is_told_instead_of_what_is_weighed() -> None:
    assert codes_of(Status.DEGENERATE, taken={"single_wall": 9.0}) == ["unobservable_direction"]
    assert codes_of(Status.DEGENERATE, strange=True) == ["not_on_map", "unobservable_direction"]
    for status in set(Status) - {Status.DEGENERATE}:
        assert "unobservable_direction" not in codes_of(status, taken={"single_wall": 9.0})


def test_without_an_answer_there_is_nothing_to_weigh() -> None:
    told = reasons_of(Doubts(Status.NO_MATCH, not_on_map=True), None, None)
    assert [reason.code for reason in told] == ["not_on_map"]


# In drawn worlds, by the fitted models.


@pytest.fixture
def fitted(usual_answer: None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reasons, "USUAL", USUAL)


def codes(result: AssociationResult) -> list[str]:
    assert (result.reasons == ()) is result.usable
    return [reason.code for reason in result.reasons]


ROOM_SCAN = scan_of(seen(ROOM, INSIDE, noise=0.01, seed=1)[0])


@pytest.mark.usefixtures("fitted")
def test_a_room_that_is_seen_whole_needs_no_reason() -> None:
    assert codes(answer_of(index_of(ROOM), ROOM_SCAN)) == []


@pytest.mark.usefixtures("fitted")
def test_equal_rooms_are_twins() -> None:
    assert codes(answer_of(index_of(equal_rooms(2)), ROOM_SCAN)) == ["similar_place"]


@pytest.mark.usefixtures("fitted")
def test_a_corridor_is_free_along_itself() -> None:
    told = codes(answer_of(index_of(CORRIDOR), scan_of(seen(CORRIDOR, pose(4.0, 0.8, 0.05))[0])))
    assert "unobservable_direction" in told
    assert set(told) <= {"unobservable_direction", "not_on_map"}


@pytest.mark.usefixtures("fitted")
def test_a_corner_is_too_little() -> None:
    """Two walls of a room, of which either alone holds the pose along the other."""
    told = codes(answer_of(index_of(ROOM), scan_of([[-3, -1, 5.5, -1], [5.5, -1, 5.5, 2.5]])))
    assert {"insufficient_evidence", "single_wall"} <= set(told)
    assert "unobservable_direction" not in told


@pytest.mark.usefixtures("fitted")
def test_a_scan_of_another_building_is_elsewhere() -> None:
    """Most of it does not fit, wherever it is laid: most have this reason, and none is usable."""
    told = 0
    for seed in range(2, 18):
        ends = seen(maze(seed), pose(15.0, 14.0, 0.5), noise=0.01, radius=7.0, seed=seed)[0]
        result = answer_of(index_of(maze(1)), scan_of(ends))
        assert not result.usable
        if result.status is Status.AMBIGUOUS:
            assert "map_mismatch" in codes(result)
        told += result.status is Status.NO_MATCH or codes(result)[0] == "not_on_map"
    assert told > 8


@pytest.mark.usefixtures("fitted")
def test_a_deadline_is_told() -> None:
    result = associate(index_of(ROOM), ROOM_SCAN, deadline=Deadline(at=0.0))
    assert codes(result)[0] == "search_incomplete"


@pytest.mark.usefixtures("fitted")
def test_a_prior_that_the_scan_contradicts_is_told() -> None:
    """A window in which the room does not fit as well as it does outside."""
    for away in (pose(6.0, 2.0), pose(-30.0, 0.0)):
        assert codes(answer_of(index_of(ROOM), ROOM_SCAN, HardPrior(away, 0.5, 0.3)))[0] == "prior_contradicted"
    assert codes(answer_of(index_of(ROOM), ROOM_SCAN, HardPrior(INSIDE, 0.5, 0.3))) == []


def test_every_reason_has_a_sentence_of_its_own() -> None:
    assert set(FEATURES_OF) <= set(REASON_MESSAGES)
    assert len(set(REASON_MESSAGES.values())) == len(REASON_MESSAGES)
    assert all(sentence.endswith((".", "?")) for sentence in REASON_MESSAGES.values())
