"""The verdict by two probabilities: as the product decides, with the vetoes."""

from __future__ import annotations

import math

import numpy as np
import pytest

from association.verdict.models import MODELS, USUAL
from association.verdict.tuning import USABLE_CAUTIOUS, USABLE_PROBABILITY
from benchmarks.full_path import answered, veto_rows

from .answered import example

SURE = np.array([0.99])


@pytest.mark.parametrize(
    ("more", "probability", "usable"),
    [
        ({}, 0.99, True),
        ({"loose": 0.5}, 0.495, False),
        ({"loose": 0.97}, 0.99 * 0.97, True),
        ({"share": 0.99, "loose": 1.0}, 0.99, True),
        ({"vetoes": ("off_scale",)}, 0.99, False),
        ({"vetoes": ("off_scale",), "loose": 0.5}, 0.495, False),
        ({"vetoes": ("few_walls",), "loose": 0.5}, 0.99, False),
    ],
)
def test_an_answer_is_judged_as_by_the_verdict(more: dict[str, float], probability: float, usable: bool) -> None:
    """A veto that settles an answer leaves its alternatives as they were scored."""
    got = answered([example(right=True, **more)], SURE, SURE, USABLE_CAUTIOUS)
    assert got.probability.tolist() == pytest.approx([probability])
    assert got.usable.tolist() == [usable]


def test_only_what_would_be_usable_is_compared_again() -> None:
    one = [example(right=True, loose=0.5)]
    for likely, careful in ((USABLE_PROBABILITY - 0.01, 0.99), (0.99, USABLE_CAUTIOUS - 0.01)):
        got = answered(one, np.array([likely]), np.array([careful]), USABLE_CAUTIOUS)
        assert got.probability.tolist() == [likely]
        assert got.usable.tolist() == [False]


def test_without_a_pose_that_is_fixed_there_is_no_probability() -> None:
    (open_,) = answered([example(degenerate=True, vetoes=("unobservable_direction",))], SURE, SURE, 0.9).probability
    assert math.isnan(open_)
    poor = USUAL._replace(inlier_fraction=0.0, lead=0.0, solitude=-3.0, longest_unmatched=4.0, blocked=5.0)
    got = answered([example(before_null=poor)], SURE, SURE, 0.9, MODELS["cautious"])
    assert math.isnan(got.probability[0])
    usual = answered([example(before_null=USUAL)], SURE, SURE, 0.9, MODELS["cautious"])
    assert usual.probability.tolist() == [0.99]


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
