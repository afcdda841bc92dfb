"""A model adds up a curve for each feature; the fitted ones are those of the file, by name."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import association
from association.verdict.features import Features
from association.verdict.models import (
    FILE,
    LEAST,
    MANIFEST,
    MODELS,
    MOST,
    ON_MAP,
    USUAL,
    Curve,
    Model,
    Pair,
    as_model,
)
from association.verdict.roles import ROLES

from ..reference import verdict as twin


def names_of(model: Model) -> set[str]:
    return set(model.curves) | {name for pair in model.pairs for name in (pair.first, pair.second)}


COUNTED = Features(*(0.1 * k + 0.5 for k in range(len(Features._fields))))
NAMES = {"segments", "ranges"}


@pytest.mark.parametrize(
    ("value", "expected"), [(-1.0, -2.0), (0.0, 0.0), (1.0, 2.0), (2.0, 1.0), (3.0, 0.0), (4.0, 3.0)]
)
def test_a_curve_is_a_line_that_bends(value: float, expected: float) -> None:
    """Up by 2, from 1 on down by 1, from 3 on up by 3."""
    features = COUNTED._replace(lead=value)
    assert Model({"lead": Curve(2.0, ((1.0, -3.0), (3.0, 4.0)))}).logit(features) == pytest.approx(expected)
    assert Model({"lead": Curve(2.0)}).logit(features) == pytest.approx(2.0 * value)


def test_the_odds_are_those_of_the_curves_together() -> None:
    model = Model({"constant": Curve(-1.0), "inlier_fraction": Curve(3.0, ((0.6, -1.0),))})
    assert model.logit(COUNTED) == pytest.approx(-0.5 + 3.0 * 0.8 - 0.2)


@pytest.mark.parametrize(
    ("kind", "share", "lead", "expected"),
    [
        (LEAST, 0.9, 0.0, 2.0),  # both speak for it in full
        (LEAST, 0.6, 0.0, 1.0),
        (LEAST, 0.6, 3.0, 0.5),
        (LEAST, 0.9, 9.0, 0.0),
        (MOST, 0.6, 9.0, 1.0),
        (MOST, 0.1, 0.0, 2.0),
        (MOST, 0.1, 9.0, 0.0),
    ],
)
def test_of_a_pair_both_have_to_speak_or_one_is_enough(kind: str, share: float, lead: float, expected: float) -> None:
    """The share from 0.4 to 0.8, the lead from 4 down to 0."""
    pair = Pair(kind, "inlier_fraction", "lead", 2.0, ((0.4, 0.8), (4.0, 0.0)))
    features = USUAL._replace(inlier_fraction=share, lead=lead)
    assert Model({}, (pair,)).logit(features) == pytest.approx(expected)
    model = Model({"constant": Curve(1.0)}, (pair,))
    assert model.logit(features) == pytest.approx(1.0 + expected)


NUMBERS = st.floats(-9.999, 9.999).map(lambda x: float(f"{x:.4g}"))
CURVES = st.tuples(NUMBERS, st.lists(st.tuples(NUMBERS, NUMBERS), max_size=3)).map(lambda c: [c[0], *sum(c[1], ())])


NAMED = st.sampled_from(Features._fields)
KEYS = st.tuples(st.sampled_from((LEAST, MOST)), NAMED, NAMED).map(" ".join)
RANGES = st.tuples(NUMBERS, st.sampled_from((-1.0, 0.5, 3.0))).map(lambda r: [r[0], float(f"{r[0] + r[1]:.4g}")])
PAIRS = st.tuples(NUMBERS, RANGES, RANGES).map(lambda p: [p[0], *p[1], *p[2]])


@given(st.dictionaries(NAMED, CURVES), st.dictionaries(KEYS, PAIRS, max_size=4))
@settings(deadline=None)
def test_a_model_is_read_from_its_document(curves: dict[str, list[float]], pairs: dict[str, list[float]]) -> None:
    document = curves | pairs
    assert as_model(document).logit(COUNTED) == pytest.approx(twin.logit(document, COUNTED._asdict()))


def test_a_bend_has_a_value_and_a_change() -> None:
    with pytest.raises(ValueError, match="zip"):
        as_model({"lead": [0.1, 20.0]})


@pytest.mark.parametrize("name", sorted(NAMES))
def test_the_fitted_models_are_those_of_the_file(name: str) -> None:
    document = json.loads((Path(association.__file__).parent / "verdict" / FILE).read_text())
    assert set(MODELS) == set(document["models"]) == set(MANIFEST["models"]) == NAMES
    curves = document["models"][name]
    assert [MODELS[name].on_map] == curves[ON_MAP]
    assert MODELS[name].on_map > 0.0
    features = {name for key in curves for name in key.removeprefix(LEAST).removeprefix(MOST).split()}
    assert features - {ON_MAP} <= set(Features._fields)
    expected = twin.logit(curves, COUNTED._asdict())
    assert MODELS[name].logit(COUNTED) == pytest.approx(expected)
    assert all(math.isfinite(number) for curve in curves.values() for number in curve)
    assert USUAL._asdict() == document["usual"]


def test_beams_speak_only_where_there_are_beams() -> None:
    """A scan without has 0 for both of their shares, which is not what it read."""
    with_beams = {name for name, role in ROLES.items() if role.needs_beams}
    assert not with_beams & names_of(MODELS["segments"])
    assert with_beams & names_of(MODELS["ranges"])
