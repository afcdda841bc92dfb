"""The features are the numbers that their names say, up to where they say no more."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from association.consensus.consensus_set import ConsensusSet
from association.consensus.sight import BeamFractions
from association.explanations import Answer
from association.verdict import tuning
from association.verdict.alternatives import compare_alternatives, probability_among
from association.verdict.chance import NullScore
from association.verdict.features import FEATURES, Features, add_null_score, depends_on_one_wall, facts_of
from registration.layout import Records

from ..answers import answer_with, estimated_of, features_of, leverages_of, ranked, registered_room, room
from ..reference import verdict as twin

CONTEXT = room()
LENGTHS = CONTEXT.lines.rows["length"].tolist()  # 9, 5.5, 4, 4, 3, 3, 2, 1.5: the longest first

SCORES = st.floats(1.0, 150.0)


def features_beside(answer: Answer, rivals: Sequence[ConsensusSet]) -> Features:
    return features_of(CONTEXT, answer, rivals)


def with_null_score(features: Features, best: ConsensusSet, null: NullScore) -> Features:
    described = np.array([features], FEATURES)
    add_null_score(described, best, null)
    return Features(*described.item())


def hinging(leverages: Records | None = None, weakest: float = 0.01, score: float = 100.0, **scores: Any) -> Answer:
    return answer_with(ranked(score, **scores), estimated=estimated_of(registered_room(), leverages, weakest))


def test_features_of_an_answer_beside_two_rivals() -> None:
    best = ranked(80.0, -2.0, matched=5, length=25.0, misfit=2.0, read=0.5, passed=0.04, blocked=4.0)
    rivals = [ranked(74.0, matched=5), ranked(70.0, -4.0, matched=5)]
    crowd = math.exp(-4.0 / 4.0) + math.exp(-12.0 / 4.0) + math.exp(-12.0)
    expected = Features(
        constant=1.0,
        lead=4.0,
        solitude=-math.log(crowd),
        inlier_fraction=0.9,
        root_length=5.0,
        deviation=0.3,
        misfit=math.log(2.0),
        longest_unmatched=3.0,
        agreement=0.85,
        root_passed=0.2,
        root_farther=0.3,
        root_nearer=0.4,
        root_passed_any=0.3,
        critical_displacement=0.25,
        critical_deviation=0.4,
        null=0.7,
        null_gap=math.sqrt(0.3 * 80.0),
        null_better=0.0,
        blocked=2.0,
        walls=math.sqrt(3.0),
        misfit_of_many=math.log(2.0) * 5.0 / 8.0,
        root_unmatched_walls=math.sqrt(3.0 + 2.0 + 0.875 * 1.5),
        squared_solitude=math.log(crowd) ** 2,
    )
    estimated = estimated_of(registered_room(), leverages_of((1, 0.25, 0.1), (4, 0.05, 0.4), (5, 0.0, 0.0)), 0.3)
    got = features_beside(
        answer_with(best, estimated=estimated, agreement=0.85, beams=BeamFractions(0.09, 0.16, 0.09)), rivals
    )
    assert got._asdict() == pytest.approx(expected._asdict())


def test_features_say_no_more_beyond_their_limits() -> None:
    """A lone answer, or a much better one; a worse one; nothing matched; all of it; a position that is not fixed."""
    alone = features_beside(answer_with(ranked(30.0)), [])
    assert (alone.lead, alone.solitude, alone.squared_solitude) == pytest.approx((30.0, 12.0, 144.0))
    assert features_beside(answer_with(ranked(90.0)), []).lead == tuning.MAX_LEAD
    assert features_beside(answer_with(ranked(90.0)), [ranked(30.0)]).lead == tuning.MAX_LEAD
    worse = features_beside(answer_with(ranked(30.0)), [ranked(50.0)])
    assert (worse.lead, worse.solitude) == pytest.approx((-20.0, 0.0), abs=1e-5)
    nothing = features_beside(answer_with(ranked(matched=0, fraction=0.0, misfit=0.0), significance=1e-300), [])
    assert nothing.misfit == math.log(tuning.LEAST_MISFIT)
    assert (nothing.longest_unmatched, nothing.root_unmatched_walls) == (tuning.LONGEST_UNMATCHED, 4.0)
    assert (nothing.critical_displacement, nothing.critical_deviation, nothing.walls) == (0.0, 0.0, 0.0)
    whole = features_beside(answer_with(ranked(fraction=1.0, misfit=1e9)), [])
    assert (whole.longest_unmatched, whole.root_unmatched_walls) == (0.0, 0.0)
    assert whole.misfit == whole.misfit_of_many == math.log(tuning.MOST_MISFIT)
    loose = features_beside(hinging(leverages_of((0, 3.0, 0.0), (1, 0.0, 10.0)), 2.0), [])
    assert (loose.deviation, loose.critical_displacement, loose.critical_deviation) == (tuning.MOST_DEVIATION,) * 3


@given(
    st.lists(SCORES, min_size=1, max_size=6),
    st.integers(0, 8),
    st.floats(0.0, 1.0),
    st.floats(1e-4, 1e5),
    st.floats(0.0, 1.0),
    st.tuples(st.floats(0.0, 200.0), st.floats(0.0, 1.0)),
)
@settings(deadline=None)
def test_features_are_those_of_the_twin(
    scores: list[float], matched: int, share: float, misfit: float, agreement: float, null: tuple[float, float]
) -> None:
    parts: dict[str, Any] = {"fraction": share, "misfit": misfit}
    best, *rivals = (
        ranked(score, matched=max(0, matched - k), chi_square=5.0 * abs(k - 2), **parts)
        for k, score in enumerate(scores)
    )
    answer = answer_with(best, agreement=agreement)
    got = features_beside(answer, rivals)
    assert got._asdict() == pytest.approx(twin.features(CONTEXT, answer, rivals), abs=1e-9)
    mirrored = with_null_score(got, best, NullScore(*null))
    assert mirrored._asdict() == pytest.approx(twin.features(CONTEXT, answer, rivals, NullScore(*null)), abs=1e-9)


@pytest.mark.parametrize(
    ("score", "symmetry", "null", "gap", "better"),
    [
        (0.0, 0.0, 0.7, 0.3, 0.0),
        (69.0, 0.0, 0.7, 0.3, 0.0),
        (80.0, 0.0, 0.8, 0.2, 0.0),
        (110.0, 0.0, 1.1, -0.1, 0.1),
        (150.0, 0.0, 1.2, -0.2, 0.2),
        (110.0, 0.7, 1.1, -0.1, 0.1),
        (110.0, 0.825, 0.9, 0.1, 0.1),
        (110.0, 0.95, 0.7, 0.3, 0.1),
        (110.0, 1.0, 0.7, 0.3, 0.1),
    ],
)
def test_the_mirrored_scan_says_less_the_more_the_map_is_symmetric(
    score: float, symmetry: float, null: float, gap: float, better: float
) -> None:
    """Of an answer with 100 nats: from 70 on, and up to 120; but for what it scores more than the answer."""
    before = features_beside(answer_with(ranked(100.0)), [])
    got = with_null_score(before, ranked(100.0), NullScore(score, symmetry))
    assert (got.null, got.null_better) == pytest.approx((null, better))
    assert math.copysign(got.null_gap**2, got.null_gap) == pytest.approx(100.0 * gap)
    unmoved = {name: value for name, value in got._asdict().items() if not name.startswith("null")}
    assert unmoved == {name: value for name, value in before._asdict().items() if not name.startswith("null")}


def test_the_gap_to_the_mirrored_scan_has_an_end_and_an_answer_without_score_none() -> None:
    strong = ranked(300.0)
    assert features_beside(answer_with(strong), []).null_gap ** 2 == pytest.approx(tuning.MAX_GAP)
    none = ranked(0.0)
    assert with_null_score(features_beside(answer_with(none), []), none, NullScore(5.0, 0.0)).null == tuning.MOST_NULL


def test_twins_share_the_chance() -> None:
    """One that scores a nat less is one to e as likely; one that scores more is as likely and no more."""
    best = ranked(50.0)
    assert probability_among(compare_alternatives(best, [])) == 1.0
    assert probability_among(compare_alternatives(best, [ranked(50.0)] * 3)) == pytest.approx(0.25)
    assert probability_among(compare_alternatives(best, [ranked(80.0)])) == pytest.approx(0.5)
    assert probability_among(compare_alternatives(best, [ranked(49.0)])) == pytest.approx(1.0 / (1.0 + math.exp(-1.0)))
    assert probability_among(compare_alternatives(best, [ranked(52.0, -3.0)])) == pytest.approx(
        1.0 / (1.0 + math.exp(-1.0))
    ), "with the prior"


@pytest.mark.parametrize(("cost", "lead"), [(0.0, 11.99), (6.0, 6.26), (60.0, 1.40)])
def test_the_farther_walls_are_off_the_less_centimetres_tell_rivals_apart(cost: float, lead: float) -> None:
    """An alternative that explains 10 nats less at a cost of 20 more, next to an answer whose walls fit well, or badly.

    With 8 matches, and 2 walls for what was supposed: ``10 - 20 / 2 + 5 log((cost + 22) / (cost + 2))``.
    """
    answer, rival = answer_with(ranked(50.0, chi_square=cost)), ranked(40.0, chi_square=cost + 20.0)
    features = features_beside(answer, [rival])
    assert features.lead == pytest.approx(lead, abs=0.01)
    assert features.solitude == pytest.approx(lead / tuning.CROWD_TEMPERATURE, abs=0.01)
    assert probability_among(compare_alternatives(answer.best, [rival])) == pytest.approx(
        1.0 / (1.0 + math.exp(-lead)), abs=0.002
    )
    assert features_beside(answer, [ranked(40.0, chi_square=cost)]).lead == pytest.approx(10.0)
    nearest = features_beside(answer, [ranked(42.0, chi_square=cost), rival])
    assert nearest.lead == pytest.approx(min(lead, 8.0), abs=0.01)


def test_scan() -> None:
    """What the numbers above rest on."""
    assert pytest.approx([9.0, 5.5, 4.0, 4.0, 3.0, 3.0, 2.0, 1.5]) == LENGTHS


@pytest.mark.parametrize(
    ("walls", "deviation", "offset", "thin"),
    [
        (3, 0.51, 0.0021, True), (3, 0.51, -0.0021, True), (3, 0.51, 0.0019, False), (2, 0.51, 0.0, True),
        (1, 0.51, 0.0, True), (3, 0.49, 0.1, False), (4, 0.51, 0.1, False),
    ],
)  # fmt: skip
def test_few_walls_of_which_one_alone_decides_are_thin(walls: int, deviation: float, offset: float, thin: bool) -> None:
    """Three of them only where they are farther from where the map has them than three sides of other rooms are."""
    leverages = leverages_of(*((k, 0.0, deviation if k == 0 else 0.01) for k in range(walls)))
    best = ranked(matched=walls)
    best.matches["offset"] = np.where(best.matched, offset, 9.0)
    answer = answer_with(best, estimated=estimated_of(registered_room(), leverages))
    facts = facts_of(CONTEXT, answer)
    assert depends_on_one_wall(CONTEXT, answer, facts) is thin
    assert depends_on_one_wall(room(with_beams=True), answer, facts) is (walls <= 3 and deviation > 0.5), (
        "beams move poses to where they fit"
    )
