"""The whole of `register`: known answers, equivariance, options and what it refuses."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from registration import MeasuredSegments, RegistrationOptions, RigidTransform, Segments, register
from registration.options import Estimator, Rotation, Weighting

from . import reference
from .scenes import POSE, ROOM, correspondences, diagonal, difference, moved, noisy_pairs, pose_of, room, seen_from

SEEDS = st.integers(0, 2**32 - 1)
ESTIMATORS = ("joint", "one_step")
ROTATIONS = ("wahba", "mitsuta")
WEIGHTINGS = ("uniform", "shorter_length", "information")


@pytest.mark.parametrize("weighting", WEIGHTINGS)
@pytest.mark.parametrize("rotation", ROTATIONS)
@pytest.mark.parametrize("estimator", ESTIMATORS)
@pytest.mark.parametrize("theta", [0.4, math.pi, -3.0])
def test_perfect_data_are_exact(theta: float, estimator: Estimator, rotation: Rotation, weighting: Weighting) -> None:
    pose = RigidTransform(3.0, -2.0, theta)
    map_segments, scan = room(pose)
    options = RegistrationOptions(estimator, rotation, weighting=weighting)
    result = register(map_segments, scan, diagonal(6), 0.0, options)
    assert not result.degenerate
    assert result.usable
    np.testing.assert_allclose(difference(pose_of(result), pose), 0.0, atol=1e-12)
    np.testing.assert_allclose(result.offsets, 0.0, atol=1e-12)
    np.testing.assert_allclose(result.angles, 0.0, atol=1e-12)
    d = result.diagnostics
    assert d.ambiguity.total == pytest.approx(0.0, abs=1e-15 * result.weights.sum())
    assert d.chi2 == pytest.approx(0.0, abs=1e-15)
    assert (d.pairs, d.dof) == (6, 9)
    assert (result.covariance is None) == (estimator == "one_step")
    assert result.unobservable is None


def test_residuals_weights_and_diagnostics_in_closed_form() -> None:
    # A square of 2 m seen in place, but with its upper wall 0.1 m too high: halfway down, upper and lower are 0.05 off.
    map_segments = Segments.from_array([[0, 0, 2, 0], [2, 0, 2, 2], [2, 2, 0, 2], [0, 2, 0, 0]])
    scan = Segments.from_array(np.array([[0, 0, 2, 0], [2, 0, 2, 2], [2, 2.1, 0, 2.1], [0, 2, 0, 0]]))
    options = RegistrationOptions(k_translation=3.0, evaluate_at=RigidTransform(0.0, -0.1, 0.0))
    result = register(map_segments, MeasuredSegments.from_segments(scan, 0.1), diagonal(4), 0.2, options)
    weight = 1.0 / (0.1**2 / 40 + 0.2**2)
    np.testing.assert_allclose(difference(pose_of(result), RigidTransform(0.0, -0.05, 0.0)), 0.0, atol=1e-12)
    np.testing.assert_allclose(result.weights, weight, rtol=1e-12)
    np.testing.assert_allclose(result.offsets, [-0.05, 0.0, -0.05, 0.0], atol=1e-12)
    d = result.diagnostics
    assert d.chi2 == pytest.approx(weight * 2 * 0.05**2)
    assert d.ambiguity.translation == pytest.approx(3.0 * weight * 2 * 0.05**2)
    assert d.ambiguity_before.translation == pytest.approx(3.0 * weight * 0.1**2)
    assert d.ambiguity_at is not None
    assert d.ambiguity_at.translation == pytest.approx(3.0 * weight * 0.1**2)
    assert d.similarity == pytest.approx(1.0 / d.ambiguity.total)
    assert d.rms_offset == pytest.approx(0.05 / math.sqrt(2.0))
    assert d.reliability == pytest.approx(1.0)
    assert d.determinant == pytest.approx((2.0 * weight) ** 2)
    # Four walls spread over 2 m each fix theta, two walls each x and y; all of it about (1, 1), which is the lever arm.
    turn, one = 1.0 / (4.0 * weight * 2.0**2 / 12.0), 1.0 / (2.0 * weight)
    expected = [[one + turn, -turn, turn], [-turn, one + turn, -turn], [turn, -turn, turn]]
    assert result.covariance is not None
    np.testing.assert_allclose(result.covariance, expected, rtol=1e-9)


@pytest.mark.parametrize(
    ("ends", "points", "variances"),
    [
        ([[0, 0, 2, 0]], None, [1 / 40]),
        ([[0, 0, 0.04, 0]], None, [1 / 2]),
        ([[0, 0, 0.04, 0]], [1.0], [1.0]),
        ([[0, 0, 0.04, 0], [1, 0, 1.02, 0]], None, [1 / (2 * 0.04 / 0.06), 1 / (2 * 0.02 / 0.06)]),
        ([[0, 0, 0.04, 0], [1, 0, 1.06, 0], [1.5, 0, 1.51, 0]], None, [1 / 0.8, 1 / 1.2, 1 / 0.2]),
    ],
)
def test_what_is_seen_of_one_map_segment_has_two_points_at_least(
    ends: list[list[float]], points: list[float] | None, variances: list[float]
) -> None:
    """Together, if they have no point counts; another map segment is separate."""
    map_segments = Segments.from_array([[0, 0, 2, 0], [2, 0, 2, 2]])
    seen = Segments.from_array([*ends, [2, 1, 2, 1.03]])
    counts = None if points is None else [*points, 3.0]
    scan = MeasuredSegments.from_segments(seen, 0.1, counts)
    pairs = [*([k, 0] for k in range(len(ends))), [len(ends), 1]]
    expected = np.array([*variances, 1 / 2 if points is None else 1 / 3]) * 0.1**2
    np.testing.assert_allclose(1.0 / register(map_segments, scan, pairs).weights, expected)


@given(SEEDS)
@settings(max_examples=10, deadline=None)
def test_joint_answer_is_the_least_cost(seed: int) -> None:
    rng = np.random.default_rng(seed)
    map_segments, scan = noisy_pairs(rng, 6)
    result = register(map_segments, scan, diagonal(6))
    pairs = correspondences(map_segments, scan)
    rows = (pairs.map_normals, pairs.map_offsets, pairs.centroids, pairs.directions, pairs.spreads, result.weights)
    best, information = reference.joint_solve(np.array([POSE.x, POSE.y, POSE.theta]), *rows)
    np.testing.assert_allclose(difference(pose_of(result), RigidTransform(*best.tolist())), 0.0, atol=1e-9)
    assert result.diagnostics.chi2 == pytest.approx(reference.joint_cost(best[2], best[:2], *rows), rel=1e-9)
    assert result.covariance is not None
    np.testing.assert_allclose(result.covariance, np.linalg.inv(information), rtol=1e-6, atol=1e-15)


@pytest.mark.parametrize("rotation", ROTATIONS)
@given(SEEDS)
@settings(max_examples=10, deadline=None)
def test_one_step_answer_is_the_papers(rotation: Rotation, seed: int) -> None:
    rng = np.random.default_rng(seed)
    map_segments, scan = noisy_pairs(rng, 6)
    options = RegistrationOptions("one_step", rotation, weighting="shorter_length", k_rotation=2.0)
    result = register(map_segments, scan, diagonal(6), 0.0, options)
    weights = np.minimum(map_segments.lengths, scan.segments.lengths)
    np.testing.assert_allclose(result.weights, weights)
    pairs = correspondences(map_segments, scan)
    rows = zip(pairs.map_directions, pairs.map_midpoints, pairs.directions, pairs.midpoints, strict=True)
    lines = [reference.transformation_line(*row) for row in rows]
    if rotation == "mitsuta":
        total, squares = reference.mitsuta([alpha for *_, alpha in lines], weights)
        theta = total / weights.sum()
        error = squares - theta * total
    else:
        theta = reference.wahba(pairs.map_directions, pairs.directions, weights)
        error = reference.wahba_error(theta, pairs.map_directions, pairs.directions, weights)
    translation = reference.one_step_translation(lines, weights)
    np.testing.assert_allclose(
        difference(pose_of(result), RigidTransform(translation[0], translation[1], theta)), 0.0, atol=1e-9
    )
    ambiguity = result.diagnostics.ambiguity
    assert ambiguity.rotation == pytest.approx(2.0 * error, rel=1e-6)
    off = reference.translation_ambiguity(translation, lines, weights)
    assert ambiguity.translation == pytest.approx(off, rel=1e-9)


@given(SEEDS, st.sampled_from([1.0, 1e3, 5e6]))
@settings(max_examples=20, deadline=None)
def test_joint_answer_moves_with_either_frame(seed: int, reach: float) -> None:
    rng = np.random.default_rng(seed)
    map_segments, scan = noisy_pairs(rng, 6)
    plain = register(map_segments, scan, diagonal(6))
    by = RigidTransform(rng.uniform(-reach, reach), rng.uniform(-reach, reach), rng.uniform(-3.0, 3.0))
    rounding = 1e-9 * max(1.0, reach / 1e3)

    carried = register(moved(by, map_segments), scan, diagonal(6))
    np.testing.assert_allclose(difference(pose_of(carried), by.compose(pose_of(plain))), 0.0, atol=rounding)
    np.testing.assert_allclose(carried.offsets, plain.offsets, atol=rounding)

    if reach <= 1e3:
        turned = replace(scan, segments=moved(by, scan.segments), centroids=by.apply(scan.centroids))
        answer = register(map_segments, turned, diagonal(6))
        np.testing.assert_allclose(difference(pose_of(answer).compose(by), pose_of(plain)), 0.0, atol=1e-9 * reach)
        assert answer.diagnostics.chi2 == pytest.approx(plain.diagnostics.chi2, rel=1e-6)


@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_far_from_the_origin_no_digit_is_lost(estimator: Estimator) -> None:
    # Dyadic coordinates are exact at any of these offsets, so near and far must agree to the last digits.
    map_segments = Segments.from_array(ROOM)
    rough = np.round(seen_from(POSE, map_segments).endpoints * 1024.0) / 1024.0
    scan = MeasuredSegments.from_segments(Segments.from_array(rough), 0.02)
    options = RegistrationOptions(estimator)
    near = register(map_segments, scan, diagonal(6), 0.0, options)
    far = register(map_segments.shifted([5e6, 4e6]), scan, diagonal(6), 0.0, options)
    np.testing.assert_allclose(far.offsets, near.offsets, atol=1e-13)
    assert far.diagnostics.chi2 == pytest.approx(near.diagnostics.chi2, rel=1e-9)
    assert far.diagnostics.ambiguity.total == pytest.approx(near.diagnostics.ambiguity.total, rel=1e-9)
    there, here = pose_of(far), pose_of(near)
    np.testing.assert_allclose([there.x - 5e6, there.y - 4e6], [here.x, here.y], atol=2e-9)
    assert there.theta == pytest.approx(here.theta, abs=1e-14)


@pytest.mark.parametrize("estimator", ESTIMATORS)
@given(SEEDS)
@settings(max_examples=10, deadline=None)
def test_order_does_not_matter(estimator: Estimator, seed: int) -> None:
    rng = np.random.default_rng(seed)
    map_segments, scan = noisy_pairs(rng, 7)
    order = rng.permutation(7)
    options = RegistrationOptions(estimator, "mitsuta")
    a = register(map_segments, scan, diagonal(7), 0.0, options)
    b = register(map_segments, scan, diagonal(7)[order], 0.0, options)
    np.testing.assert_allclose(difference(pose_of(a), pose_of(b)), 0.0, atol=1e-12)
    np.testing.assert_allclose(a.offsets[order], b.offsets, atol=1e-12)


def test_weights_replace_the_information() -> None:
    map_segments, scan = noisy_pairs(np.random.default_rng(5), 6)
    plain = register(map_segments, scan, diagonal(6))
    quarter = register(map_segments, scan, diagonal(6), 0.0, RegistrationOptions(weights=plain.weights / 4.0))
    np.testing.assert_allclose(difference(pose_of(quarter), pose_of(plain)), 0.0, atol=1e-12)
    assert quarter.diagnostics.chi2 == pytest.approx(plain.diagnostics.chi2 / 4.0)
    assert quarter.covariance is not None
    assert plain.covariance is not None
    np.testing.assert_allclose(quarter.covariance, 4.0 * plain.covariance, rtol=1e-9)


@pytest.mark.parametrize("estimator", ESTIMATORS)
@pytest.mark.parametrize("weights", [[1e-100, 1.0, 1e100, 1.0, 1e-100, 0.0], [1e100] * 6, [1e-100] * 6])
@pytest.mark.parametrize("sigma", [0.0, 1e-200, 1e-12, 1e3])
def test_no_weight_and_no_sigma_breaks_a_number(sigma: float, weights: Any, estimator: Estimator) -> None:
    map_segments, scan = noisy_pairs(np.random.default_rng(5), 6)
    scan = MeasuredSegments.from_segments(scan.segments, sigma)
    options = RegistrationOptions(
        estimator, weights=weights, k_translation=1e30, evaluate_at=RigidTransform(1e10, -1e10, 3.0)
    )
    result = register(map_segments, scan, diagonal(6), sigma, options)
    d = result.diagnostics
    assert d.ambiguity_at is not None
    assert d.similarity is not None
    pose = pose_of(result)
    numbers = [d.ambiguity.total, d.ambiguity_before.total, d.ambiguity_at.total, d.similarity, d.reliability]
    numbers += [d.determinant, d.chi2, d.rms_offset, d.rms_angle, pose.x, pose.y, pose.theta]
    assert np.isfinite(numbers).all()
    assert np.isfinite(result.offsets).all()
    assert result.covariance is None or np.isfinite(result.covariance).all()


@pytest.mark.parametrize("estimator", ESTIMATORS)
@pytest.mark.parametrize(("dx", "dy", "size"), [(1, 0, 1), (3, 4, 5), (-12, 5, 13), (0, -1, 1), (-8, -15, 17)])
@pytest.mark.parametrize("away", [(0, 0), (3_000, -2_000), (500_000, 5_400_000)])
@pytest.mark.parametrize("along", [0, 1_000, -400_000])
@pytest.mark.parametrize("across", [0.0, 2.0**-6, 1.0])
def test_ambiguity_of_parallel_lines_keeps_its_digits_far_out(
    estimator: Estimator, dx: int, dy: int, size: int, away: tuple[int, int], along: int, across: float
) -> None:
    """The returned pose may be far from the other one, and fits as well.

    All coordinates are exact, so that the answer is: each of three lines is off by as much as the pose is, across them.
    """
    offsets = np.array([0.0, -8.0, 3.0])
    ends = np.stack([np.array([0.0, 6.0, -2.0]), offsets, np.array([4.0, 9.0, -7.0]), offsets], axis=1)
    turned = np.array([[dx, dy], [-dy, dx]])  # times `size`
    on_map = (ends.reshape(-1, 2) @ turned + away).reshape(-1, 4)
    scan = MeasuredSegments.from_segments(Segments.from_array(size * ends))
    x, y = np.array(away) + np.array([along, across]) @ turned
    at = RigidTransform(x, y, math.atan2(dy, dx))
    options = RegistrationOptions(estimator, weights=[1.0] * 3, evaluate_at=at)
    found = register(Segments.from_array(on_map), scan, diagonal(3), 0.0, options)
    assert found.unobservable is not None
    assert found.diagnostics.ambiguity_at is not None
    expected = 3.0 * (across * size) ** 2
    assert found.diagnostics.ambiguity_at.translation == pytest.approx(expected, rel=1e-7, abs=1e-15)
    # Seen from where the frames of map and scan lie far from one another along the lines.
    there = (ends.reshape(-1, 2) @ turned + np.array([along, across]) @ turned).reshape(-1, 4)
    scan = MeasuredSegments.from_segments(Segments.from_array((ends.reshape(-1, 2) @ turned).reshape(-1, 4)))
    before = register(Segments.from_array(there), scan, diagonal(3), 0.0, options).diagnostics.ambiguity_before
    assert before.translation == pytest.approx(expected, rel=1e-7, abs=1e-15)


@pytest.mark.parametrize("weighting", WEIGHTINGS)
def test_wrong_pairs_are_not_usable(weighting: Weighting) -> None:
    map_segments, scan = room()
    swapped = [[0, 0], [1, 1], [2, 2], [3, 3], [4, 5], [5, 4]]
    result = register(map_segments, scan, swapped, 0.0, RegistrationOptions(weighting=weighting))
    assert not result.degenerate
    assert not result.usable
