"""The verdict on drawn answers is that of the reference, and changes where the reference's does."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given, settings

from association import Status
from association.verdict import tuning

from .judged import PLAIN, Drawn, drawn, judged_by
from .kernels.drawn import SEEDS


@pytest.fixture(autouse=True, scope="module")
def plain_models() -> Iterator[None]:
    with judged_by(PLAIN):
        yield


def assert_judged(one: Drawn) -> None:
    got, expected = one.verdict, one.expected
    for name in ("status", "usable", "contradicted"):
        assert getattr(got, name) == getattr(expected, name), name
    for name in ("probability", "margin", "runner_up"):
        assert getattr(got, name) == pytest.approx(getattr(expected, name)), name
    assert (got.reasons == ()) is got.usable
    codes = [reason.code for reason in got.reasons]
    assert ("not_on_map" in codes) >= (expected.explained < tuning.ELSEWHERE_PROBABILITY)
    assert ("search_incomplete" in codes) is not one.complete
    assert ("prior_contradicted" in codes) is expected.contradicted


@given(SEEDS)
@settings(max_examples=300, deadline=None)
def test_the_verdict_is_that_of_the_twin(seed: int) -> None:
    assert_judged(drawn(np.random.default_rng(seed)))


def test_the_verdict_changes_where_that_of_the_twin_does() -> None:
    """On both sides of every change of status between two answers; all kinds of changes come up."""
    rng, kinds = np.random.default_rng(1), set()
    for _ in range(200):
        one, other = drawn(rng, (None,)), drawn(rng, (None,))
        if one.expected.status is not one.towards(other, 1.0).expected.status:
            sides = one.border(other)
            for side in sides:
                assert_judged(side)
            kinds.add(kind_of(*sides))
    decided = {f"{kind}{beams}" for kind in ("explained", "careful", "null") for beams in ("", " with beams")}
    assert kinds >= decided | {"deviation", "mirrored with beams"}


def kind_of(one: Drawn, other: Drawn) -> str:
    """Say what decides between two answers that are next to each other."""
    a, b = one.expected, other.expected
    beams = " with beams" if one.context.with_beams else ""
    if Status.NO_MATCH in (a.status, b.status):
        return f"explained{beams}"
    if Status.DEGENERATE in (a.status, b.status):
        return "deviation"
    if a.mirrored is not b.mirrored and max(a.careful, b.careful) >= tuning.USABLE_CAUTIOUS:
        return f"mirrored{beams}"
    assert min(a.careful, b.careful) < tuning.USABLE_CAUTIOUS <= max(a.careful, b.careful)
    return f"null{beams}" if a.asked and b.asked else f"careful{beams}"
