"""A prior's score of a pose is that of the reference."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings

from association import HardPrior, SoftPrior
from association.consensus.kernels import priors
from association.tuning import INSIDE, SOFT_FLOOR
from registration.layout import Records

from ...kernels.drawn import SEEDS, prior_record
from ...records import estimate_of
from ...reference import best_poses as twin
from ...reference.geometry import moved
from ...scenes import pose


@given(SEEDS)
@settings(max_examples=100, deadline=None)
def test_prior_value(seed: int) -> None:
    rng = np.random.default_rng(seed)
    at = moved(pose(), rng.normal(size=3) * [2.0, 1.0, 1.0])
    root = rng.normal(size=(3, 3))
    poses = [moved(at, rng.normal(size=3)) for _ in range(8)]
    table = np.concatenate([estimate_of(one) for one in poses])
    for prior in (None, SoftPrior(at, root @ root.T + 0.01 * np.eye(3)), HardPrior(at, 1.0, 0.7)):
        expected = [twin.prior_value(prior, one) for one in poses]
        np.testing.assert_allclose(priors.prior_values(prior_record(prior), table), expected, rtol=1e-6, atol=1e-9)
        assert priors.prior_value(prior_record(prior)[0], table[0]) == pytest.approx(expected[0], rel=1e-6)


def test_what_priors_say_at_their_limits() -> None:
    soft = prior_record(SoftPrior(pose(2.0, 3.0, 3.1), np.diag([0.25, 1.0, 0.01])))[0]

    def value(prior: Records, x: float, y: float, theta: float) -> float:
        return priors.prior_value(prior, estimate_of(pose(x, y, theta))[0])

    assert value(soft, 2.0, 3.0, 3.1) == 0.0
    assert value(soft, 2.5, 3.0, -3.1) == pytest.approx(-0.5 * (1.0 + 100.0 * (math.tau - 6.2) ** 2))
    assert value(soft, 200.0, 3.0, 3.1) == SOFT_FLOOR
    hard = prior_record(HardPrior(pose(2.0, 3.0, 3.1), 0.5, 0.2))[0]
    assert value(hard, 2.4, 3.2, -3.1) == INSIDE
    assert value(hard, 2.4, 3.4, 3.1) == 0.0
    assert value(hard, 2.0, 3.0, 2.8) == 0.0
