"""The features are the numbers that their names say, up to where they say no more."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from association import tuning
from association.features import Features, features_of, twin_share

from .answers import answer_with, ranked, room
from .reference import verdict as twin

CONTEXT = room()
LENGTHS = CONTEXT.segments.rows["length"].tolist()  # 9, 5.5, 4, 4, 3, 3, 2, 1.5: the longest first

SCORES = st.floats(1.0, 150.0)


def test_features_of_an_answer_beside_two_rivals() -> None:
    best = ranked(80.0, -2.0, matched=5, share=0.9, length=25.0, misfit=2.0, covariance=np.diag([0.04, 0.09, 1e-4]))
    rivals = [ranked(74.0), ranked(70.0, -4.0)]
    crowd = math.exp(-4.0 / 4.0) + math.exp(-12.0 / 4.0) + math.exp(-12.0)
    expected = Features(
        constant=1.0,
        lead=4.0,
        solitude=-math.log(crowd),
        share=0.9,
        root_count=math.sqrt(5.0),
        root_length=5.0,
        deviation=0.3,
        misfit=math.log(2.0),
        inverse_count=0.2,
        longest_unmatched=3.0,
        agreement=0.85,
        misfit_of_many=math.log(2.0) * 5.0 / 8.0,
        beyond_nearly_all=0.05,
        root_unmatched=math.sqrt(6.5),
        squared_solitude=math.log(crowd) ** 2,
    )
    got = features_of(CONTEXT, answer_with(best, agreement=0.85), rivals)
    assert got._asdict() == pytest.approx(expected._asdict())


def test_features_say_no_more_beyond_their_limits() -> None:
    """A lone answer, or a much better one; a worse one; nothing matched; all of it; a position that is not fixed."""
    alone = features_of(CONTEXT, answer_with(ranked(30.0)), [])
    assert (alone.lead, alone.solitude, alone.squared_solitude) == pytest.approx((30.0, 12.0, 144.0))
    assert features_of(CONTEXT, answer_with(ranked(90.0)), []).lead == tuning.MAX_LEAD
    assert features_of(CONTEXT, answer_with(ranked(90.0)), [ranked(30.0)]).lead == tuning.MAX_LEAD
    worse = features_of(CONTEXT, answer_with(ranked(30.0)), [ranked(50.0)])
    assert (worse.lead, worse.solitude) == pytest.approx((-20.0, 0.0), abs=1e-5)
    nothing = features_of(CONTEXT, answer_with(ranked(matched=0, share=0.0, misfit=0.0)), [])
    assert (nothing.root_count, nothing.inverse_count, nothing.beyond_nearly_all) == (0.0, 1.0, 0.0)
    assert nothing.misfit == math.log(tuning.LEAST_MISFIT)
    assert (nothing.longest_unmatched, nothing.root_unmatched) == (tuning.LONGEST_UNMATCHED, 4.0)
    whole = features_of(CONTEXT, answer_with(ranked(share=1.0, misfit=1e9)), [])
    assert (whole.longest_unmatched, whole.root_unmatched) == (0.0, 0.0)
    assert whole.misfit == whole.misfit_of_many == math.log(tuning.MOST_MISFIT)
    loose = ranked(covariance=np.diag([4.0, 1.0, 1e-4]))
    assert features_of(CONTEXT, answer_with(loose), []).deviation == tuning.MOST_DEVIATION


@given(
    st.lists(SCORES, min_size=1, max_size=6),
    st.integers(0, 8),
    st.floats(0.0, 1.0),
    st.floats(1e-4, 1e5),
    st.floats(0.0, 1.0),
)
def test_features_are_those_of_the_twin(
    scores: list[float], matched: int, share: float, misfit: float, agreement: float
) -> None:
    best, *rivals = (ranked(score, matched=matched, share=share, misfit=misfit) for score in scores)
    got = features_of(CONTEXT, answer_with(best, agreement=agreement), rivals)
    assert got._asdict() == pytest.approx(twin.features(CONTEXT, best, rivals, agreement), abs=1e-9)


def test_twins_share_the_chance() -> None:
    """One that scores 1.5 nats less is one to e as likely; one that scores more is as likely and no more."""
    best = ranked(50.0)
    assert twin_share(best, []) == 1.0
    assert twin_share(best, [ranked(50.0)] * 3) == pytest.approx(0.25)
    assert twin_share(best, [ranked(80.0)]) == pytest.approx(0.5)
    assert twin_share(best, [ranked(48.5)]) == pytest.approx(1.0 / (1.0 + math.exp(-1.0)))
    assert twin_share(best, [ranked(52.0, -3.5)]) == pytest.approx(1.0 / (1.0 + math.exp(-1.0))), "with the prior"


def test_scan() -> None:
    """What the numbers above rest on."""
    assert pytest.approx([9.0, 5.5, 4.0, 4.0, 3.0, 3.0, 2.0, 1.5]) == LENGTHS
