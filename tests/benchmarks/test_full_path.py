"""The verdict: as the product decides, with the vetoes."""

from __future__ import annotations

import math

import numpy as np
import pytest

from association.verdict.models import MODELS, USUAL
from association.verdict.tuning import USABLE_CAUTIOUS
from benchmarks.curves import Answers
from benchmarks.full_path import Probabilities, answered, by_model, veto_rows

from .answered import example

ONE = np.ones(1)


def both(likely: float = 0.99, careful: float = 0.99) -> Probabilities:
    return Probabilities(likely * ONE, careful * ONE, careful * ONE, ONE)


SURE = both()


@pytest.mark.parametrize(
    ("careful", "vetoes", "usable"),
    [
        (USABLE_CAUTIOUS, (), True),
        (USABLE_CAUTIOUS - 0.01, (), False),
        (0.99, ("off_scale",), False),
        (0.99, ("few_walls",), False),
    ],
)
def test_an_answer_is_judged_as_by_the_verdict(careful: float, vetoes: tuple[str, ...], usable: bool) -> None:
    """The cautious probability decides, and the vetoes; the other is answered."""
    got = answered([example(right=True, vetoes=vetoes)], both(0.97, careful), USABLE_CAUTIOUS)
    assert got.probability.tolist() == [0.97]
    assert got.passes.tolist() == [careful >= USABLE_CAUTIOUS]
    assert got.usable.tolist() == [usable]


def test_without_a_pose_that_is_fixed_there_is_no_probability() -> None:
    (open_,) = answered([example(degenerate=True, vetoes=("unobservable_direction",))], SURE, 0.9).probability
    assert math.isnan(open_)


def test_without_a_match_there_is_no_probability() -> None:
    poor = USUAL._replace(inlier_fraction=0.0, lead=0.0, solitude=-3.0, longest_unmatched=4.0, blocked=5.0)
    for features, matched in ((poor, False), (USUAL, True)):
        one = [example(before_null=features)]
        (found,) = answered(one, by_model(MODELS["segments"], Answers.of(one)), 0.9).probability
        assert math.isnan(found) is not matched


def test_a_veto_is_charged_with_what_it_alone_rejects() -> None:
    examples = [
        example(right=True, vetoes=("few_walls",)),
        example(right=False, vetoes=("few_walls",)),
        example(stranger=True, vetoes=("few_walls",)),
        example(right=True, vetoes=("few_walls", "off_scale")),
        example(right=True, vetoes=("few_walls",)),
        example(right=True),
    ]
    passes = np.array([True, True, True, True, False, True])
    rows = {name: numbers for name, *numbers in veto_rows(examples, passes)}
    assert rows.pop("few_walls") == ["1", "1", "1"]
    assert all(numbers == ["0", "0", "0"] for numbers in rows.values())
