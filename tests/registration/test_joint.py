"""Joint sums: adding, removing and costs."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from registration import JointSums

from .scenes import POSE, correspondences, fitted, noisy_pairs, random_segments, scanned_points

SEEDS = st.integers(0, 2**32 - 1)


@given(SEEDS)
@settings(max_examples=20, deadline=None)
def test_sums_add_up(seed: int) -> None:
    rng = np.random.default_rng(seed)
    pairs = correspondences(*noisy_pairs(rng, 9))
    weights = rng.uniform(0.1, 5.0, 9)
    a = JointSums.of_set(pairs.take(slice(0, 4)), weights[:4])
    b = JointSums.of_set(pairs.take(slice(4, 9)), weights[4:])
    both = JointSums.of_set(pairs, weights)
    np.testing.assert_allclose((a + b).values, both.values, rtol=1e-15)
    np.testing.assert_allclose((both - b).values, a.values, rtol=1e-15)
    np.testing.assert_allclose(a.add(pairs, 7, 2.5).remove(pairs, 7, 2.5).values, a.values, rtol=1e-15)
    assert (a.count, a.add(pairs, 7, 2.5).count, both.count) == (4, 5, 9)


def test_a_distant_pair_leaves_no_trace() -> None:
    pairs = correspondences(*noisy_pairs(np.random.default_rng(1), 5))
    far = pairs.about(np.array([1e8, -1e8]), np.array([1e8, 0.0]))
    sums = JointSums.of_set(pairs, np.ones(5))
    np.testing.assert_allclose(sums.add(far, 0, 1.0).remove(far, 0, 1.0).values, sums.values, rtol=1e-12)


def test_sums_are_read_only() -> None:
    sums = JointSums.of_set(correspondences(*noisy_pairs(np.random.default_rng(1), 3)), np.ones(3))
    with pytest.raises(ValueError, match="read-only"):
        sums.values[0] = 1.0


def test_the_cost_is_that_of_all_points_behind_the_segments() -> None:
    rng = np.random.default_rng(4)
    map_segments = random_segments(rng, 8)
    points = scanned_points(rng, map_segments, POSE, 0.01, 30)
    pairs = correspondences(map_segments, fitted(points, 0.01))
    sums = JointSums.of_set(pairs, np.full(8, 30 / 0.01**2))

    moved = POSE.apply(points)
    distances = np.einsum("nj,npj->np", map_segments.normals, moved) - map_segments.offsets[:, None]
    # What the fit left, the scatter of the points about their own segments, is no matter of the pose.
    own = np.einsum("nj,npj->np", np.stack([-pairs.directions[:, 1], pairs.directions[:, 0]], axis=1), points)
    scatter = np.sum((own - own.mean(axis=1, keepdims=True)) ** 2)
    expected = (np.sum(distances**2) - scatter) / 0.01**2
    assert sums.cost(POSE.theta, (POSE.x, POSE.y)) == pytest.approx(expected, rel=1e-3)
