"""Segments, measured segments and transforms; values that are rejected, with the argument and the index at fault."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from registration import (
    Beams,
    Correspondences,
    InvalidArgumentError,
    InvalidSegmentsError,
    MeasuredSegments,
    RegistrationError,
    RegistrationOptions,
    RigidTransform,
    Segments,
    register,
    wrap_angle,
)

from . import reference
from .scenes import ROOM, assert_close, correspondences, diagonal, noisy_pairs, room

POSES = st.builds(RigidTransform, st.floats(-1e3, 1e3), st.floats(-1e3, 1e3), st.floats(-10.0, 10.0))


def test_segments_in_closed_form() -> None:
    ends = np.random.default_rng(0).uniform(-9.0, 9.0, (40, 4))
    s, begins, along = Segments.from_array(ends), ends[:, :2], ends[:, 2:] - ends[:, :2]
    np.testing.assert_allclose(s.directions * s.lengths[:, None], along, atol=1e-14)
    np.testing.assert_allclose(np.hypot(*s.directions.T), 1.0)
    np.testing.assert_array_equal(s.normals, s.directions @ [[0.0, 1.0], [-1.0, 0.0]])
    np.testing.assert_allclose(s.offsets, np.sum(s.normals * begins, axis=1), atol=1e-13)
    np.testing.assert_allclose(s.midpoints, begins + 0.5 * along, atol=1e-15)
    np.testing.assert_allclose(s.reversed().offsets, -s.offsets, atol=1e-14)
    np.testing.assert_allclose(s.shifted([2.0, 0.0]).offsets, s.offsets + 2.0 * s.normals[:, 0], atol=1e-14)
    assert len(s) == 40
    assert len(Segments.from_array([])) == 0


def test_mirrored_segments_are_those_of_the_mirrored_ends() -> None:
    """With begin and end exchanged, so that the normal points to the same side of the wall."""
    ends = np.random.default_rng(0).uniform(-9.0, 9.0, (40, 4))
    got = Segments.from_array(ends).mirrored()
    expected = Segments.from_array(ends[:, [2, 3, 0, 1]] * [1.0, -1.0, 1.0, -1.0])
    for name in ("endpoints", "directions", "normals", "offsets", "lengths", "midpoints"):
        np.testing.assert_allclose(getattr(got, name), getattr(expected, name), atol=1e-12, err_msg=name)
        assert not getattr(got, name).flags.writeable


def test_arrays_are_read_only_and_rows_can_be_taken() -> None:
    s = Segments.from_array([[0, 0, 1, 0], [0, 0, 0, 2]])
    with pytest.raises(ValueError, match="read-only"):
        s.endpoints[0, 0] = 7.0
    np.testing.assert_array_equal(s.take([1, 0]).lengths, [2, 1])


def test_what_is_made_of_segments_may_be_longer_than_they_may() -> None:
    long = Segments.derived(np.array([[0.0, 0.0, 3e4, 4e4]]))
    np.testing.assert_allclose(long.lengths, [5e4])
    np.testing.assert_allclose(long.directions, [[0.6, 0.8]])
    np.testing.assert_array_equal(long.shifted([1.0, 2.0]).endpoints, [[1, 2, 30001, 40002]])
    np.testing.assert_array_equal(long.reversed().endpoints, [[3e4, 4e4, 0, 0]])
    with pytest.raises(ValueError, match="read-only"):
        long.lengths[0] = 1.0


def test_what_a_caller_does_not_know_is_filled_in() -> None:
    measured = MeasuredSegments.from_segments(Segments.from_array(np.array([[0, 0, 6, 0], [0, 0, 0, 0.03]])))
    np.testing.assert_allclose(measured.sigma, [0.02, 0.02])
    np.testing.assert_allclose(measured.point_counts, [120, 0.6])
    counted = MeasuredSegments.from_segments(measured.segments, point_counts=[9.0, 1.0])
    assert (measured.counted, counted.counted, counted.point_counts.tolist()) == (False, True, [9.0, 1.0])
    np.testing.assert_allclose(measured.spreads, [3.0, 0.03**2 / 12])
    np.testing.assert_allclose(measured.centroids, np.array([[3, 0], [0, 0.015]]))


def test_of_nothing_lists_of_any_form_are_taken() -> None:
    """NumPy gives an empty list one dimension."""
    measured = MeasuredSegments.from_segments(Segments.from_array([]), moments=([], []))
    assert (measured.centroids.shape, measured.spreads.shape) == ((0, 2), (0,))


@pytest.mark.parametrize(
    ("angle", "expected"),
    [(0.0, 0.0), (math.pi, math.pi), (-math.pi, math.pi), (1.5 * math.pi, -0.5 * math.pi), (7.0, 7.0 - math.tau)],
)
def test_wrapped_angles(angle: float, expected: Any) -> None:
    assert wrap_angle(angle) == pytest.approx(expected, abs=1e-12)


def test_a_transform_in_closed_form() -> None:
    pose = RigidTransform(1.0, 2.0, math.pi / 2)
    np.testing.assert_allclose(pose.apply([[1.0, 0.0], [0.0, 1.0]]), [[1.0, 3.0], [0.0, 2.0]], atol=1e-15)


@given(POSES, POSES, st.tuples(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3)))
def test_transforms_are_a_group(a: RigidTransform, b: RigidTransform, point: Any) -> None:
    np.testing.assert_allclose(a.compose(b).apply(point), a.apply(b.apply(point)), atol=1e-9)
    np.testing.assert_allclose(a.inverse().apply(a.apply(point)), point, atol=1e-9)


@pytest.mark.parametrize("turns", [-3.75, -1.0, 0.25, 2.25])
def test_some_turns_are_wrapped(turns: float) -> None:
    assert RigidTransform(1.0, 2.0, turns * math.tau).theta == pytest.approx(math.remainder(turns, 1.0) * math.tau)


@pytest.mark.parametrize("theta", [30.0, -90.0])
def test_degrees_are_refused(theta: float) -> None:
    with pytest.raises(ValueError, match=r"found -?[39]0; if these are degrees, give -?[01]"):
        RigidTransform(1.0, 2.0, theta)


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_a_transform_is_finite(bad: Any) -> None:
    for values in ((bad, 0, 0), (0, bad, 0), (0, 0, bad)):
        with pytest.raises(ValueError, match="finite"):
            RigidTransform(*values)


@given(POSES, POSES, st.integers(0, 2**32 - 1))
def test_a_covariance_is_carried_as_small_changes_are(pose: RigidTransform, by: RigidTransform, seed: int) -> None:
    """By differences: what a small change of the pose does to the composed one."""
    step, there = 1e-6, pose.compose(by)
    columns = []
    for k in range(3):
        change = [0.0, 0.0, 0.0]
        change[k] = step
        moved = RigidTransform(pose.x + change[0], pose.y + change[1], pose.theta + change[2]).compose(by)
        columns.append([moved.x - there.x, moved.y - there.y, wrap_angle(moved.theta - there.theta)])
    jacobian = np.array(columns).T / step
    root = np.random.default_rng(seed).normal(size=(3, 3))
    expected = jacobian @ root @ root.T @ jacobian.T
    np.testing.assert_allclose(pose.carry(root @ root.T, by), expected, rtol=1e-2, atol=1e-2 * np.abs(expected).max())


SEEDS = st.integers(0, 2**32 - 1)
COLUMNS = (
    "map_directions", "map_midpoints", "map_offsets", "map_lengths", "directions", "midpoints", "lengths",
    "centroids", "spreads", "variances",
)  # fmt: skip


@given(SEEDS)
@settings(max_examples=20, deadline=None)
def test_gather(seed: int) -> None:
    rng = np.random.default_rng(seed)
    map_segments, scan = noisy_pairs(rng, 9)
    scan = replace(scan, sigma=rng.choice([0.0, 1e-200, 1e-12, 0.3], 9))
    pairs = np.stack([rng.integers(0, 9, 12), rng.integers(0, 9, 12)], axis=1)
    found = Correspondences.of(map_segments, scan, pairs)
    expected = zip(*reference.pair_rows(map_segments, scan, pairs), strict=True)
    for name, column in zip(COLUMNS, expected, strict=True):
        np.testing.assert_allclose(getattr(found, name), column, rtol=1e-15, atol=1e-15, err_msg=name)


@given(SEEDS)
@settings(max_examples=20, deadline=None)
def test_residuals(seed: int) -> None:
    rng = np.random.default_rng(seed)
    map_segments, scan = noisy_pairs(rng, 7, noise=0.05)
    pairs = correspondences(map_segments, scan)
    at, weights = RigidTransform(*rng.uniform(-3.0, 3.0, 3)), rng.uniform(0.1, 2.0, 7)
    counts = np.append(rng.random(6) < 0.5, True)
    weights[~counts] = 0.0
    found = register(map_segments, scan, diagonal(7), 0.0, RegistrationOptions(weights=weights), at)
    expected = np.sum(pairs.map_normals * at.apply(pairs.midpoints), axis=1) - pairs.map_offsets
    assert_close(found.offsets, expected)
    rows = zip(pairs.map_directions, pairs.map_midpoints, pairs.directions, pairs.midpoints, strict=True)
    turns = [math.remainder(reference.transformation_line(*row)[2] - at.theta, math.tau) for row in rows]
    assert_close(found.angles, turns)
    assert_close(pairs.angles(at.theta), turns)
    some = pairs.take(counts)
    measured = (some.map_normals, some.map_offsets, some.centroids, some.directions, some.spreads, weights[counts])
    cost = reference.joint_cost(at.theta, np.array([at.x, at.y]), *measured)
    assert found.diagnostics.chi2 == pytest.approx(cost, rel=1e-9)
    assert found.diagnostics.rms_offset == pytest.approx(math.sqrt(np.mean(found.offsets[counts] ** 2)))
    assert found.diagnostics.rms_angle == pytest.approx(math.sqrt(np.mean(found.angles[counts] ** 2)))


ANGLES, RANGES = np.array([-0.5, 0.25, 1.0]), np.array([2.0, math.inf, 3.0])
ORIGINS = np.array([[0.0, 1.0], [2.0, 3.0], [4.0, -5.0]])


def test_left_and_right_are_exchanged() -> None:
    """In the same order, which is that of time; a second time makes them as they were."""
    beams = Beams(ANGLES, RANGES, 10.0, ORIGINS)
    mirrored = beams.mirrored()
    np.testing.assert_array_equal(mirrored.angles, [0.5, -0.25, -1.0])
    np.testing.assert_array_equal(mirrored.ranges, RANGES)
    np.testing.assert_array_equal(mirrored.origins, [[0.0, -1.0], [2.0, -3.0], [4.0, 5.0]])
    again = mirrored.mirrored()
    for got, expected in ((again.angles, ANGLES), (again.ranges, RANGES), (again.origins, ORIGINS)):
        np.testing.assert_array_equal(got, expected)
    assert (mirrored.range_max, Beams(ANGLES, RANGES, 10.0).mirrored().origins) == (10.0, None)


def test_lengths_are_multiplied() -> None:
    scaled = Beams(ANGLES, RANGES, 10.0, ORIGINS).scaled(2.0)
    np.testing.assert_array_equal(scaled.angles, ANGLES)
    np.testing.assert_array_equal(scaled.ranges, [4.0, math.inf, 6.0])
    np.testing.assert_array_equal(scaled.origins, 2.0 * ORIGINS)
    assert scaled.range_max == 20.0


def test_each_beam_is_moved_with_its_origin_or_that_of_all() -> None:
    by = RigidTransform(1.0, 2.0, 0.5 * math.pi)
    for origins in (ORIGINS, np.tile([3.0, 1.0], (3, 1))):
        moved = Beams(ANGLES, RANGES, 10.0, None if origins is not ORIGINS else ORIGINS).moved(by, (3.0, 1.0))
        np.testing.assert_allclose(moved.angles, ANGLES + 0.5 * math.pi)
        np.testing.assert_array_equal(moved.ranges, RANGES)
        assert moved.origins is not None
        expected = np.stack([1.0 - origins[:, 1], 2.0 + origins[:, 0]], axis=1)
        np.testing.assert_allclose(moved.origins, expected, atol=1e-12)


Call = Callable[[], object]


def pairs(of: Any) -> Call:
    return lambda: register(*room(), of)


def weights(of: Any) -> Call:
    return lambda: register(*room(), diagonal(6), 0.0, RegistrationOptions(weights=of))


def map_sigma(of: float) -> Call:
    return lambda: register(*room(), diagonal(6), of)


def options(**of: Any) -> Call:
    return lambda: RegistrationOptions(**of)


def measured(**of: Any) -> Call:
    return lambda: MeasuredSegments.from_segments(Segments.from_array([[0, 0, 1, 0], [0, 0, 0, 1]]), **of)


def segments(of: Any) -> Call:
    return lambda: Segments.from_array(of, argument="map.segments")


@pytest.mark.parametrize(
    ("argument", "index", "call"),
    [
        ("correspondences", 1, pairs([[0, 0], [1, 6]])),
        ("correspondences", 2, pairs([[0, 0], [0, 0], [6, 1]])),
        ("correspondences", 0, pairs([[-1, 0]])),
        ("correspondences", 1, pairs([[0, 0], [0.5, 1]])),
        ("correspondences", None, pairs([[0.0, 1.0]])),
        ("correspondences", None, pairs([[0, 1, 2]])),
        ("correspondences", None, pairs([0, 1])),
        ("correspondences", None, pairs([[0, 1], [2]])),
        ("correspondences", None, pairs([["0", "1"]])),
        ("correspondences", None, pairs([[True, False]])),
        ("correspondences", 0, pairs([[float("nan"), 0]])),
        ("correspondences", None, pairs([[2**70, 0]])),
        ("weights", 2, weights([1, 1, -1, 1, 1, 1])),
        ("weights", 3, weights([1, 1, 1, math.nan, 1, 1])),
        ("weights", 0, weights([math.inf, 1, 1, 1, 1, 1])),
        ("weights", 1, weights([1, 1e-300, 1, 1, 1, 1])),
        ("weights", 5, weights([1, 1, 1, 1, 1, 1e300])),
        ("weights", None, weights([0, 0, 0, 0, 0, 0])),
        ("weights", None, weights([1, 1, 1])),
        ("weights", None, weights(["1"] * 6)),
        ("weights", None, weights([True] * 6)),
        ("weights", None, weights([[1], [1, 2]])),
        ("map.sigma", None, map_sigma(-1.0)),
        ("map.sigma", None, map_sigma(math.nan)),
        ("map.sigma", None, map_sigma(math.inf)),
        ("map.sigma", None, map_sigma(1e4)),
        ("options.k_translation", None, options(k_translation=-1.0)),
        ("options.k_rotation", None, options(k_rotation=math.nan)),
        ("options.k_rotation", None, options(k_rotation=math.inf)),
        ("options.estimator", None, options(estimator="best")),
        ("options.rotation", None, options(rotation="mean")),
        ("weighting", None, options(weighting="length")),
        ("options.evaluate_at", None, options(evaluate_at=RigidTransform(1e300, 0.0, 0.0))),
        ("scan.sigma", 0, measured(sigma=-0.1)),
        ("scan.sigma", 1, measured(sigma=[0.1, math.nan])),
        ("scan.sigma", None, measured(sigma=[0.1])),
        ("scan.point_counts", 1, measured(point_counts=[5, 0])),
        ("scan.point_counts", 0, measured(point_counts=[0.6, 1])),
        ("scan.centroids", 1, measured(moments=([[0, 0], [0, math.inf]], [1, 1]))),
        ("scan.spreads", 0, measured(moments=([[0, 0], [0, 0]], [-1, 1]))),
        ("map.segments", None, segments([[0, 0, 1]])),
        ("map.segments", None, segments([1, 2, 3, 4])),
        ("map.segments", None, segments([["0", "0", "1", "0"]])),
        ("map.segments", None, segments([[0, 0, 1, 0], [1]])),
    ],
)
def test_the_argument_and_the_index_at_fault_are_named(argument: str, index: int | None, call: Call) -> None:
    with pytest.raises(InvalidArgumentError) as caught:
        call()
    assert (caught.value.argument, caught.value.index) == (argument, index)


@pytest.mark.parametrize(
    ("row", "says"),
    [
        ([0, 0, math.nan, 0], "not finite"),
        ([0, 0, math.inf, 0], "not finite"),
        ([2e9, 0, 2e9, 1], "beyond"),
        ([0, 0, 1e-7, 0], "shorter"),
        ([1, 1, 1, 1], "shorter"),
        ([0, 0, 2e4, 0], "longer"),
    ],
)
def test_bad_segments_are_refused_by_index(row: list[float], says: str) -> None:
    with pytest.raises(InvalidSegmentsError, match=says) as caught:
        segments(np.array([[0, 0, 1, 0], row]))()
    assert (caught.value.argument, caught.value.index) == ("map.segments", 1)
    assert isinstance(caught.value, RegistrationError)


def test_each_index_has_the_range_of_its_own_set() -> None:
    many = Segments.from_array(ROOM)
    few = many.take(np.arange(2))
    assert register(many, MeasuredSegments.from_segments(few), [[0, 4], [1, 5]]).diagnostics.pairs == 2
    assert register(few, MeasuredSegments.from_segments(many), [[4, 0], [5, 1]]).diagnostics.pairs == 2
    for map_segments, scan, pair in ((many, few, [2, 0]), (few, many, [0, 2])):
        with pytest.raises(InvalidArgumentError, match="from 0 to 1, found 2"):
            register(map_segments, MeasuredSegments.from_segments(scan), [pair])


def test_information_without_noise_is_refused() -> None:
    map_segments, scan = room(sigma=0.0)
    with pytest.raises(InvalidArgumentError) as caught:
        register(map_segments, scan, diagonal(6))
    assert caught.value.argument == "scan.sigma"
    with_little = MeasuredSegments.from_segments(scan.segments, 1e-200)
    np.testing.assert_allclose(register(map_segments, with_little, diagonal(6)).weights, 1e24 * scan.point_counts)
    little = register(map_segments, scan, diagonal(6), 1e-200)
    np.testing.assert_allclose(little.weights, 1e24)
    assert register(map_segments, scan, diagonal(6), 0.01).usable
    assert register(map_segments, scan, diagonal(6), 0.0, RegistrationOptions(weighting="uniform")).usable
