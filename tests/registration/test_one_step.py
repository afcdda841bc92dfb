"""The paper's estimator: closed forms, its errata, its sums."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from registration import Correspondences, MeasuredSegments, OneStepSums, RigidTransform, Segments
from registration.options import Rotation
from tests import reference

from .scenes import POSE, ROOM, correspondences, diagonal, directed, noisy_pairs, seen_from

IDENTITY = RigidTransform(0.0, 0.0, 0.0)
SEEDS = st.integers(0, 2**32 - 1)


def mean_angle(
    degrees: list[float], rotation: Rotation, reference_degrees: float | None = None, weights: list[float] | None = None
) -> float:
    pairs = correspondences(directed(degrees), MeasuredSegments.from_segments(directed(np.zeros(len(degrees)))))
    used = np.ones(len(degrees)) if weights is None else weights
    about = OneStepSums.of_set(pairs, used).solve("wahba")[0].theta
    if reference_degrees is not None:
        about = math.radians(reference_degrees)
    sums = OneStepSums.of_set(pairs, used, RigidTransform(0.0, 0.0, about))
    return math.degrees(sums.solve(rotation)[0].theta)


@pytest.mark.parametrize(
    ("degrees", "rotation", "expected"),
    [
        ([0, 0, 90], "mitsuta", 30.0),
        ([0, 0, 90], "wahba", math.degrees(math.atan(0.5))),
        ([10, 10, 10], "mitsuta", 10.0),
        ([10, 10, 10], "wahba", 10.0),
        ([170, -170, 175], "mitsuta", 178.0 + 1.0 / 3.0),
        ([-170, 170], "mitsuta", 180.0),
        ([-90], "wahba", -90.0),
    ],
)
def test_mean_angles_in_closed_form(degrees: list[float], rotation: Rotation, expected: float) -> None:
    assert mean_angle(degrees, rotation) == pytest.approx(expected, abs=1e-9)


def test_mean_angles_take_weights() -> None:
    assert mean_angle([0, 60], "mitsuta", weights=[3.0, 1.0]) == pytest.approx(15.0)
    assert mean_angle([0, 90], "wahba", weights=[3.0, 1.0]) == pytest.approx(math.degrees(math.atan2(1.0, 3.0)))


@pytest.mark.parametrize("about", [-40.0, 0.0, 30.0, 80.0])
def test_the_reference_angle_does_not_change_the_mean(about: float) -> None:
    assert mean_angle([0, 0, 90], "mitsuta", about) == pytest.approx(30.0, abs=1e-9)
    assert mean_angle([0, 0, 90], "wahba", about) == pytest.approx(26.565051177, abs=1e-9)


def test_the_sign_of_p_brings_the_scan_to_the_map() -> None:
    # One wall a metre up and one two metres right: as printed Eq. (1) would answer (-2, -1).
    scan = Segments.from_array([[0, 0, 1, 0], [0, 1, 0, 0]])
    map_segments = Segments.from_array([[2, 1, 3, 1], [2, 2, 2, 1]])
    pairs = correspondences(map_segments, MeasuredSegments.from_segments(scan))
    pose, observable = OneStepSums.of_set(pairs, np.ones(2)).solve("wahba")
    assert observable
    assert (pose.x, pose.y, pose.theta) == pytest.approx((2.0, 1.0, 0.0), abs=1e-12)


def test_oblique_walls_show_the_signs_of_eq_8() -> None:
    map_segments = Segments.from_array(ROOM)
    pairs = correspondences(map_segments, MeasuredSegments.from_segments(seen_from(POSE, map_segments)))
    sums = OneStepSums.of_set(pairs, np.ones(6))
    for rotation in ("wahba", "mitsuta"):
        pose, _ = sums.solve(rotation)
        assert (pose.x, pose.y, pose.theta) == pytest.approx((POSE.x, POSE.y, POSE.theta), abs=1e-12)
        assert sums.translation_cost(pose) == pytest.approx(0.0, abs=1e-12)
        assert sums.rotation_cost(pose, rotation) == pytest.approx(0.0, abs=1e-12)


@given(SEEDS)
@settings(max_examples=20, deadline=None)
def test_ambiguity_at_any_transform_is_that_of_the_definition(seed: int) -> None:
    rng = np.random.default_rng(seed)
    map_segments, scan = noisy_pairs(rng, 6, 0.1)
    weights = rng.uniform(0.2, 3.0, 6)
    pairs = correspondences(map_segments, scan)
    sums = OneStepSums.of_set(pairs, weights, RigidTransform(1.0, -2.0, 0.5))
    rows = zip(pairs.map_directions, pairs.map_midpoints, pairs.directions, pairs.midpoints, strict=True)
    lines = [reference.transformation_line(*row) for row in rows]
    optimum: dict[Rotation, RigidTransform] = {rotation: sums.solve(rotation)[0] for rotation in ("wahba", "mitsuta")}
    for at in (IDENTITY, POSE, RigidTransform(-7.0, 3.0, 0.9), *optimum.values()):
        expected = reference.translation_ambiguity(np.array([at.x, at.y]), lines, weights)
        assert sums.translation_cost(at) == pytest.approx(expected, rel=1e-9)
        squares = sum(w * (alpha - at.theta) ** 2 for (*_, alpha), w in zip(lines, weights, strict=True))
        assert sums.rotation_cost(at, "mitsuta") == pytest.approx(squares, rel=1e-9)
        error = reference.wahba_error(at.theta, pairs.map_directions, pairs.directions, weights)
        assert sums.rotation_cost(at, "wahba") == pytest.approx(error, rel=1e-9)
    for rotation, pose in optimum.items():
        for step in (-1e-3, 1e-3):
            aside = RigidTransform(pose.x + step, pose.y - step, pose.theta + step)
            assert sums.translation_cost(aside) > sums.translation_cost(pose)
            assert sums.rotation_cost(aside, rotation) > sums.rotation_cost(pose, rotation)


def test_the_printed_forms_hold_at_the_optimum() -> None:
    map_segments, scan = noisy_pairs(np.random.default_rng(2), 6, 0.1)
    sums = OneStepSums.of_set(correspondences(map_segments, scan), np.ones(6))
    pose, _ = sums.solve("mitsuta")
    sw, sx2, sy2, sxy, _, _, c, sa, sa2, *_ = sums.values
    assert sw == 6.0
    eq_17 = sa2 - pose.theta * sa
    eq_19 = c - pose.x**2 * sy2 + 2.0 * pose.x * pose.y * sxy - pose.y**2 * sx2
    assert sums.rotation_cost(pose, "mitsuta") == pytest.approx(eq_17, rel=1e-9)
    assert sums.translation_cost(pose) == pytest.approx(eq_19, rel=1e-9)


@pytest.mark.parametrize(
    ("degrees", "expected"),
    [([0, 90], 1.0), ([0, 180], 0.0), ([0, 30], 0.5), ([0, 0, 90], 2.0 * math.sqrt(2.0) / 3.0)],
)
def test_reliability_in_closed_form(degrees: list[float], expected: float) -> None:
    pairs = correspondences(directed(degrees), MeasuredSegments.from_segments(directed(degrees)))
    sums = OneStepSums.of_set(pairs, np.ones(len(degrees)))
    assert sums.reliability == pytest.approx(expected, abs=1e-7)
    assert sums.reliability == pytest.approx(
        reference.reliability(pairs.map_directions, np.ones(len(degrees))), abs=1e-7
    )
    assert sums.determinant == pytest.approx((0.5 * expected * len(degrees)) ** 2, abs=1e-12)


def test_reliability_never_exceeds_1_by_rounding() -> None:
    found = []
    for first in np.linspace(0.0, 90.0, 200):
        cross = directed([first, first + 90.0])
        pairs = correspondences(cross, MeasuredSegments.from_segments(cross))
        found.append(OneStepSums.of_set(pairs, [0.1, 0.1]).reliability)
    assert max(found) == 1.0


def test_sums_of_nothing() -> None:
    pairs = Correspondences.of(directed([0]), MeasuredSegments.from_segments(directed([0])), [])
    sums = OneStepSums.of_set(pairs, [])
    assert sums.count == 0
    assert sums.reliability == 0.0
    assert sums.solve("mitsuta") == (IDENTITY, False)


@given(SEEDS)
@settings(max_examples=20, deadline=None)
def test_sums_add_up(seed: int) -> None:
    rng = np.random.default_rng(seed)
    pairs = correspondences(*noisy_pairs(rng, 9))
    weights = rng.uniform(0.1, 5.0, 9)
    at = RigidTransform(1.0, 2.0, 0.3)
    a = OneStepSums.of_set(pairs.take(slice(0, 4)), weights[:4], at)
    b = OneStepSums.of_set(pairs.take(slice(4, 9)), weights[4:], at)
    both = OneStepSums.of_set(pairs, weights, at)
    np.testing.assert_allclose((a + b).values, both.values, rtol=1e-15)
    np.testing.assert_allclose((both - b).values, a.values, rtol=1e-15)
    np.testing.assert_allclose(a.add(pairs, 7, 2.5).remove(pairs, 7, 2.5).values, a.values, rtol=1e-15)
    assert a.add(pairs, 7, 2.5).count == 5
    # Another reference is moved to the first one's.
    np.testing.assert_allclose((a + b.about(POSE)).values, both.values, rtol=1e-9, atol=1e-9)


def test_a_distant_pair_leaves_no_trace() -> None:
    pairs = correspondences(*noisy_pairs(np.random.default_rng(1), 5))
    far = pairs.about(np.array([1e8, -1e8]), np.zeros(2))
    sums = OneStepSums.of_set(pairs, np.ones(5))
    np.testing.assert_allclose(sums.add(far, 0, 1.0).remove(far, 0, 1.0).values, sums.values, rtol=1e-12)


def test_an_angle_taken_out_across_the_wrap_is_gone() -> None:
    # With Alg. 1's principal values the sums would keep a multiple of 2 pi.
    pairs = correspondences(directed([175, -175, 178]), MeasuredSegments.from_segments(directed([0, 0, 0])))
    sums = OneStepSums.of_set(pairs, np.ones(3), RigidTransform(0.0, 0.0, math.pi)).remove(pairs, 1, 1.0)
    assert math.degrees(sums.solve("mitsuta")[0].theta) == pytest.approx(176.5, abs=1e-9)


def test_a_reference_may_be_moved_across_the_wrap() -> None:
    pairs = correspondences(directed([175, -175, 178]), MeasuredSegments.from_segments(directed([0, 0, 0])))
    here, there = RigidTransform(0.0, 0.0, 3.0), RigidTransform(0.0, 0.0, -3.0)
    sums = OneStepSums.of_set(pairs, np.ones(3), here)
    fresh = OneStepSums.of_set(pairs, np.ones(3), there)
    np.testing.assert_allclose(sums.about(there).values, fresh.values, atol=1e-12)
    rotation: Rotation
    for rotation in ("wahba", "mitsuta"):
        assert sums.rotation_cost(there, rotation) == pytest.approx(fresh.rotation_cost(there, rotation))


def test_pairs_are_chosen_by_index() -> None:
    map_segments, scan = noisy_pairs(np.random.default_rng(1), 5)
    chosen = Correspondences.of(map_segments, scan, [[3, 3], [1, 1]])
    both = correspondences(map_segments, scan)
    expected = OneStepSums.of_pair(both, 1, 1.0) + OneStepSums.of_pair(both, 3, 1.0)
    np.testing.assert_allclose(OneStepSums.of_set(chosen, np.ones(2)).values, expected.values, rtol=1e-15)
    assert len(diagonal(5)) == len(both)
