"""The freedom that information takes from a pose is that of the reference, from nothing to a whole pose."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings

from association.layout import record
from association.scan.kernels import freedom
from registration.layout import SYMMETRIC3

from ...kernels.drawn import SEEDS
from ...records import UPPER
from ...reference import consensus as twin


@example(134217728)
@given(SEEDS)
@settings(max_examples=30, deadline=None)
def test_log_determinant(seed: int) -> None:
    rng = np.random.default_rng(seed)
    model = twin.model_of(1.0, float(rng.uniform(0.1, 2.0)), float(rng.uniform(0.01, 1.0)))
    for rank in (0, 1, 2, 3):
        root = rng.normal(size=(3, rank)) * 10.0 ** rng.uniform(-1.0, 3.0)
        matrix = root @ root.T
        information = record(SYMMETRIC3, **dict(zip(UPPER, matrix[np.triu_indices(3)], strict=True)))
        got = freedom.log_determinant(information[0], model[0], 1.0, 0.0)
        assert got == pytest.approx(twin.log_determinant(matrix, model[0]), abs=1e-7)
        assert rank > 0 or got == 0.0
