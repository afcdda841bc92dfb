"""Score of random walls, bounded as by the references."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from association.verdict.chance import EXPONENTS
from association.verdict.kernels import chance

from ...kernels.drawn import GATES, INDEX, SEEDS, drawn
from ...reference import chance as twin


@given(SEEDS, st.floats(0.0, 400.0))
@settings(max_examples=60, deadline=None)
def test_chance_matches_and_log_tail(seed: int, score: float) -> None:
    d = drawn(seed)
    agreeing, area = d.rng.uniform(0.1, 1.0), 10.0 ** d.rng.uniform(0.0, 5.0)
    expected = twin.chance_matches(d.scan, INDEX.walls.longest, agreeing, area, GATES)
    walls = INDEX.wall_lengths._replace(agreeing=agreeing, area=area)
    chances = chance.chance_matches(d.scan, walls, GATES)
    np.testing.assert_allclose(chances, expected, rtol=1e-12)
    least = chance.log_tail(d.scan, chances, score, EXPONENTS)
    assert least == pytest.approx(twin.log_tail(d.scan, expected, score, EXPONENTS), rel=1e-9, abs=1e-12)
