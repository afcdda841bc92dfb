"""The models are those of the file, by name."""

from __future__ import annotations

import math

import numpy as np
import pytest

from association.features import Features
from association.models import CAUTIOUS, PROBABILITY, WITH_BEAMS, Model

from .reference.verdict import models

COUNTED = Features(*(0.1 * k + 0.5 for k in range(len(Features._fields))))


@pytest.mark.parametrize(
    ("model", "name"), [(PROBABILITY, "probability"), (CAUTIOUS, "cautious"), (WITH_BEAMS, "with_beams")]
)
def test_models_are_read_by_name(model: Model, name: str) -> None:
    terms = models()[name]
    assert dict(zip(model.names, model.coefficients.tolist(), strict=True)) == terms
    assert set(terms) <= set(Features._fields)
    expected = math.fsum(factor * getattr(COUNTED, term) for term, factor in terms.items())
    assert model.logit(COUNTED) == pytest.approx(expected)


def test_the_three_models_differ() -> None:
    assert len({PROBABILITY.logit(COUNTED), CAUTIOUS.logit(COUNTED), WITH_BEAMS.logit(COUNTED)}) == 3


def test_what_a_feature_is_multiplied_with() -> None:
    model = Model(("constant", "share"), np.array([-1.0, 3.0]))
    assert (model.coefficient("share"), model.coefficient("constant"), model.coefficient("lead")) == (3.0, -1.0, 0.0)
    assert model.logit(COUNTED) == pytest.approx(-1.0 * 0.5 + 3.0 * 0.8)
