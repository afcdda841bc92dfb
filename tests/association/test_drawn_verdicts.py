"""The verdict on drawn answers is that of the twin, and changes where the twin's does."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings

from association import Status, tuning

from .judged import Drawn, drawn
from .kernels.drawn import SEEDS


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
    for _ in range(100):
        one, other = drawn(rng, (None,)), drawn(rng, (None,))
        if one.expected.status is not one.towards(other, 1.0).expected.status:
            sides = one.border(other)
            for side in sides:
                assert_judged(side)
            kinds.add(kind_of(*sides))
    assert kinds >= {"explained", "right", "careful", "right with beams"}


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
