from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from registration import RigidTransform, Segments
from registration.layout import Floats
from simulation import Scanner, SimulatedScan, World, l_room, offices, scan, square_room
from vectorization import LaserScan, Vectorization, VectorizationOptions, vectorize

POSE = RigidTransform(0.7, -0.4, 0.3)
SQUARE = square_room(6.0).segments


def laser(seen: SimulatedScan) -> LaserScan:
    s = seen.scanner
    return LaserScan(s.angle_min, s.angle_increment, seen.ranges, s.range_min, s.range_max)


def seen_from(pose: RigidTransform, segments: Segments, scanner: Scanner, seed: int = 0) -> SimulatedScan:
    return scan(segments, pose, scanner, np.random.default_rng(seed))


def in_map(pose: RigidTransform, found: Vectorization) -> Floats:
    return pose.apply(found.measured.segments.endpoints.reshape(-1, 2)).reshape(-1, 4)


def assert_same_walls(actual: Floats, expected: Any, atol: float) -> None:
    assert len(actual) == len(expected)
    for wall in expected:
        assert np.abs(actual - wall).max(axis=1).min() <= atol


@pytest.mark.parametrize("world", [square_room(6.0), l_room()], ids=["square", "l"])
@settings(deadline=None, max_examples=30)
@given(x=st.floats(-0.7, 0.7), y=st.floats(-0.7, 0.7), theta=st.floats(-3, 3))
def test_a_room_without_noise_is_exact_from_anywhere(world: World, x: float, y: float, theta: float) -> None:
    pose = RigidTransform(world.poses[0].x + x, world.poses[0].y + y, theta)
    found = vectorize(laser(seen_from(pose, world.segments, Scanner(sigma=0.0))))
    assert_same_walls(in_map(pose, found), world.segments.endpoints, 1e-9)
    np.testing.assert_allclose(found.rms, 0.0, atol=1e-9)


def test_a_wall_alone_has_the_numbers_of_its_closed_form() -> None:
    # Five beams on the wall x = 2, one step of 0.1 rad apart.
    a = 0.1 * np.arange(-2, 3)
    found = vectorize(LaserScan(-0.2, 0.1, 2 / np.cos(a)), VectorizationOptions(sigma=0.01))
    measured = found.measured
    y = 2 * np.tan(a)
    np.testing.assert_allclose(measured.segments.endpoints, [[2, y[0], 2, y[-1]]], atol=1e-12)
    # Noise along the ray, and 3 mm of the wall's own, straight through the wall.
    weights = 1 / ((0.01 * np.cos(a)) ** 2 + 0.003**2)
    assert measured.point_counts.tolist() == [5]
    assert measured.sigma[0] == pytest.approx(np.sqrt(5 / weights.sum()))
    np.testing.assert_allclose(measured.centroids, [[2, 0]], atol=1e-12)
    assert measured.spreads[0] == pytest.approx(np.sum(weights * y**2) / np.sum(weights))
    assert found.spans.tolist() == [[0, 4]]
    assert found.sigma == 0.01


@settings(deadline=None, max_examples=15)
@given(start=st.floats(-3, 3), steps=st.integers(0, 719))
def test_where_the_angles_start_turns_the_segments_and_nothing_else(start: float, steps: int) -> None:
    step = math.tau / 720
    seen = seen_from(POSE, SQUARE, Scanner(720, -math.pi, step, sigma=0.02))
    one = vectorize(laser(seen)).measured
    other = vectorize(LaserScan(start, step, np.roll(seen.ranges, steps), 0.0, 20.0)).measured
    turn = RigidTransform(0, 0, start + step * steps + math.pi)
    turned = turn.apply(one.segments.endpoints.reshape(-1, 2)).reshape(-1, 4)
    assert_same_walls(other.segments.endpoints, turned, 1e-6)
    assert np.sort(other.point_counts).tolist() == np.sort(one.point_counts).tolist()


@pytest.mark.parametrize(
    ("walls", "behind", "parts"),
    [
        ([[3, -2, 3, -0.4], [3, 0.4, 3, 2], [6, -3, 6, 3]], True, [(-1.84, -0.4), (0.4, 1.84)]),  # a door
        ([[3, -2, 3, -0.01], [3, 0.01, 3, 2], [5, -1, 5, 1]], False, [(-1.64, 0.0), (0.0, 1.64)]),  # a slit
        ([[3, -2, 3, 2], [1.5, -0.004, 1.5, 0.004]], False, [(-1.64, 1.64)]),  # a thin post before it
    ],
)
def test_what_parts_a_wall(walls: list[list[float]], behind: bool, parts: list[tuple[float, float]]) -> None:
    scanner = Scanner.over(1.1 if behind else 1.0, 401, sigma=0.01)
    seen = seen_from(RigidTransform(0, 0, 0), Segments.from_array(walls), scanner)
    found = vectorize(laser(seen)).measured
    near = found.segments.endpoints[:, 0] < 4
    assert len(found) == len(parts) + behind
    np.testing.assert_allclose(found.segments.endpoints[near][:, [1, 3]], parts, atol=0.05)
    on_wall = np.isin(seen.hits, range(len(parts))).sum()
    assert found.point_counts[near].sum() == pytest.approx(on_wall, abs=len(parts))


def test_a_point_beside_the_end_of_a_wall_is_not_its_own() -> None:
    a = 0.01 * np.arange(31)
    ranges = 2 / np.cos(a)
    ranges[-1] += 0.06
    found = vectorize(LaserScan(0.0, 0.01, ranges), VectorizationOptions(sigma=0.02))
    assert found.spans.tolist() == [[0, 29]]
    assert found.measured.point_counts.tolist() == [30]
    np.testing.assert_allclose(found.measured.segments.endpoints[0], [2, 0, 2, 2 * math.tan(0.29)], atol=1e-7)


def test_a_lost_beam_does_not_part_a_wall_but_a_given_gap_does() -> None:
    ranges = 2 / np.cos(np.arange(-30, 31) * 0.01)
    ranges[[10, 40]] = np.nan, np.inf
    scan_ = LaserScan(-0.3, 0.01, ranges)
    assert len(vectorize(scan_).measured) == 1
    assert vectorize(scan_).measured.point_counts[0] == 59
    parted = vectorize(scan_, VectorizationOptions(max_gap=0.03))
    assert parted.spans.tolist() == [[0, 9], [11, 39], [41, 60]]


def test_a_bend_too_slight_for_any_one_point_is_found_by_many() -> None:
    # 3 degrees; 4 cm off the chord in the middle at 2 cm of noise.
    walls = Segments.from_array([[3, -1.5, 3, 0], [3, 0, 3 - 1.5 * math.sin(0.06), 1.5 * math.cos(0.06)]])
    found = vectorize(laser(seen_from(RigidTransform(0, 0, 0), walls, Scanner.over(0.9, 540))))
    assert len(found.measured) == 2
    np.testing.assert_allclose(found.measured.segments.endpoints[0, 2:], [3, 0], atol=0.3)


@pytest.mark.parametrize("quantum", [0.01, 0.05])
def test_quantised_ranges_neither_split_walls_nor_promise_too_much(quantum: float) -> None:
    scanner = Scanner(360, -math.pi, math.tau / 360, sigma=0.003, quantum=quantum)
    for seed in range(5):
        found = vectorize(laser(seen_from(POSE, SQUARE, scanner, seed)))
        assert len(found.measured) == 4
        assert found.sigma >= quantum / math.sqrt(12)
        assert_same_walls(in_map(POSE, found), SQUARE.endpoints, 2 * quantum)


def test_the_least_sigma_of_quantised_ranges_is_that_of_rounding() -> None:
    ranges = np.round(2 / np.cos(0.01 * np.arange(-40, 41)) / 0.05) * 0.05
    assert vectorize(LaserScan(-0.4, 0.01, ranges)).sigma == pytest.approx(0.05 / math.sqrt(12))
    assert vectorize(LaserScan(-0.4, 0.01, 2 / np.cos(0.01 * np.arange(-40, 41)))).sigma == 0.001


def test_sigma_is_estimated_from_the_scan() -> None:
    for sigma in (0.005, 0.02, 0.05):
        estimates = [vectorize(laser(seen_from(POSE, SQUARE, Scanner(sigma=sigma), k))).sigma for k in range(10)]
        assert np.mean(estimates) == pytest.approx(sigma, rel=0.1)
        assert vectorize(laser(seen_from(POSE, SQUARE, Scanner(sigma=sigma)))).measured.sigma.max() < 1.2 * sigma


def test_what_a_segment_claims_is_what_it_is_off_by() -> None:
    """Offset and angle against the claimed variance: chi-square with two degrees of freedom, mean 2."""
    pose = RigidTransform(-1.9, 1.2, 0.3)
    offsets, angles = [], []
    for seed in range(150):
        seen = seen_from(pose, SQUARE, Scanner(720, -3.0, math.tau / 720), seed)
        m = vectorize(laser(seen), VectorizationOptions(sigma=0.02)).measured
        assert len(m) == 4
        d = RigidTransform(0, 0, pose.theta).apply(m.segments.directions)
        k = np.argmax(d @ SQUARE.directions.T, axis=1)
        information = m.point_counts / m.sigma**2
        off = np.sum(SQUARE.normals[k] * pose.apply(m.centroids), axis=1) - SQUARE.offsets[k]
        turn = d[:, 0] * SQUARE.directions[k, 1] - d[:, 1] * SQUARE.directions[k, 0]
        offsets.append(off * np.sqrt(information))
        angles.append(turn * np.sqrt(information * m.spreads))
    # 600 values each: 4 standard deviations of their mean square are 0.23.
    assert np.mean(np.square(offsets)) == pytest.approx(1.0, abs=0.23)
    assert np.mean(np.square(angles)) == pytest.approx(1.0, abs=0.23)
    assert abs(np.mean(offsets)) < 4 / math.sqrt(600)


def test_a_rough_wall_has_its_sigma_widened() -> None:
    rng = np.random.default_rng(0)
    a = np.linspace(-0.4, 0.4, 200)
    rough = 2 / np.cos(a) + rng.normal(0, 0.02, 200)
    found = vectorize(LaserScan(a[0], a[1] - a[0], rough), VectorizationOptions(sigma=0.012, min_points=20))
    assert len(found.measured) >= 1
    assert found.measured.sigma.max() > 0.0165


@pytest.mark.parametrize("value", [math.inf, math.nan, 0.0])
def test_a_scan_without_returns_has_no_segments(value: Any) -> None:
    found = vectorize(LaserScan(-1.0, 0.01, np.full(200, value), 0.1, 10.0))
    assert len(found.measured) == 0
    assert found.spans.shape == (0, 2)
    assert found.rms.shape == (0,)
    assert found.beams is not None
    assert found.beams.ranges.shape == found.beams.angles.shape == (200,)
    assert found.beams.range_max == 10.0


@pytest.mark.parametrize("ranges", [[], [1.0], [1.0, None, 1.0]])
def test_a_scan_too_short_for_a_segment_has_none(ranges: Any) -> None:
    assert len(vectorize(LaserScan(0.0, 0.1, ranges)).measured) == 0


def test_beams_are_handed_out_as_evidence() -> None:
    found = vectorize(LaserScan(0.5, 0.1, np.array([1.0, None, math.inf, 12.0, 0.01]), 0.1, 10.0))
    assert found.beams is not None
    np.testing.assert_allclose(found.beams.angles, [0.5, 0.6, 0.7, 0.8, 0.9])
    np.testing.assert_array_equal(found.beams.ranges, [1.0, np.nan, np.inf, np.inf, np.nan])


def test_a_heap_of_points_is_no_wall() -> None:
    rng = np.random.default_rng(1)
    ranges = rng.uniform(2.0, 4.0, 300)
    assert len(vectorize(LaserScan(-1.5, 0.01, ranges), VectorizationOptions(sigma=0.02)).measured) <= 2


def test_short_walls_and_few_points_are_left_out_as_asked() -> None:
    ranges = 2 / np.cos(np.arange(-10, 11) * 0.01)  # 0.40 m, 21 points
    for options, expected in [
        (VectorizationOptions(min_length=0.39), 1), (VectorizationOptions(min_length=0.42), 0),
        (VectorizationOptions(min_points=21), 1), (VectorizationOptions(min_points=22), 0),
    ]:  # fmt: skip
        assert len(vectorize(LaserScan(-0.1, 0.01, ranges), options).measured) == expected


def test_none_is_smaller_than_asked_for_after_its_corners_were_cut() -> None:
    rng = np.random.default_rng(0)
    world = offices(rng)
    least = []
    for options in (VectorizationOptions(), VectorizationOptions(min_points=30, min_length=1.0)):
        for pose in world.poses:
            found = vectorize(laser(scan(world.segments, pose, Scanner(sigma=0.02), rng)), options)
            least.append((found.measured.point_counts.min() - options.min_points,
                          found.measured.segments.lengths.min() - options.min_length))  # fmt: skip
    assert np.min(least, axis=0).min() >= -1e-9


def test_points_with_a_viewpoint_are_what_the_laser_saw() -> None:
    scanner = Scanner(700, -2.5, 0.007, sigma=0.02)
    seen = seen_from(POSE, SQUARE, scanner)
    by_laser = vectorize(laser(seen)).measured.segments.endpoints
    for points in (seen.points, seen.points[::-1]):
        found = vectorize(points)
        np.testing.assert_allclose(found.measured.segments.endpoints, by_laser, atol=1e-6)
    moved = vectorize(POSE.apply(seen.points), viewpoint=(POSE.x, POSE.y))
    expected = POSE.apply(by_laser.reshape(-1, 2)).reshape(-1, 4)
    np.testing.assert_allclose(moved.measured.segments.endpoints, expected, atol=1e-6)


def test_a_wall_whose_points_run_the_other_way_still_has_the_viewpoint_on_its_left() -> None:
    y = 0.03 * np.arange(60)
    onward = np.stack([np.full(60, 3.0), y], axis=1)
    contrary = np.stack([np.full(30, -3.0), y[:30]], axis=1)
    found = vectorize(np.vstack([onward, contrary]))
    assert found.spans.tolist() == [[0, 59], [89, 60]]
    np.testing.assert_allclose(found.measured.segments.endpoints, [[3, 0, 3, y[59]], [-3, y[29], -3, 0]], atol=1e-9)


def test_points_without_a_viewpoint_run_as_they_come() -> None:
    seen = seen_from(POSE, SQUARE, Scanner(700, -2.5, 0.007, sigma=0.005))
    forth = vectorize(seen.points, viewpoint=None)
    back = vectorize(seen.points[::-1], viewpoint=None)
    assert (forth.measured.segments.offsets < 0).all()
    assert (back.measured.segments.offsets > 0).all()
    assert len(forth.measured) == len(back.measured) == 4
    walls = back.measured.segments.endpoints[::-1][:, [2, 3, 0, 1]]
    np.testing.assert_allclose(forth.measured.segments.endpoints, walls, atol=0.02)
    assert (forth.spans[:, 0] < forth.spans[:, 1]).all()


def test_points_far_from_the_origin_lose_nothing() -> None:
    seen = seen_from(POSE, SQUARE, Scanner(700, -2.5, 0.007, sigma=0.0))
    far = np.array([4e5, 5e6])
    for viewpoint in (None, (4e5, 5e6)):
        near = vectorize(seen.points, viewpoint=viewpoint and (0.0, 0.0)).measured
        moved = vectorize(seen.points + far, viewpoint=viewpoint).measured
        np.testing.assert_allclose(moved.segments.endpoints - np.tile(far, 2), near.segments.endpoints, atol=1e-6)


def test_a_corner_of_seven_beams_has_two_walls() -> None:
    """So few points are split at the one farthest from their chord only."""
    angles = math.pi / 4 + 0.03 * np.arange(-3, 4)
    ranges = 2.0 / np.maximum(np.cos(angles), np.sin(angles))
    options = VectorizationOptions(sigma=0.005, min_points=3, min_length=0.05)
    found = vectorize(LaserScan(angles[0], 0.03, ranges, 0.1, 30.0), options).measured.segments
    assert found.endpoints == pytest.approx(np.array([[2.0, 1.67, 2.0, 2.0], [2.0, 2.0, 1.67, 2.0]]), abs=0.01)
