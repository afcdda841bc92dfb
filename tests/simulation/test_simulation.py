"""Maps with known answers, seen by a scanner in closed form, and drawn worlds."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from registration import RigidTransform, Segments
from registration.layout import Floats
from simulation import (
    OfficePlan,
    Scanner,
    SimulationError,
    corridor,
    cut_square,
    l_room,
    oblique,
    offices,
    pillars,
    rectangle_room,
    scan,
    square_room,
    with_obstacles,
)
from simulation.kernels.casting import cast

ORIGIN = RigidTransform(0.0, 0.0, 0.0)
QUIET = Scanner(sigma=0.0)
# Counter-clockwise: free space inside, on the left.
SQUARE = Segments.from_array([[-1, -1, 1, -1], [1, -1, 1, 1], [1, 1, -1, 1], [-1, 1, -1, -1]])


def test_a_square_room_has_the_ranges_of_its_closed_form() -> None:
    seen = scan(SQUARE, ORIGIN, QUIET)
    expected = 1.0 / np.maximum(abs(np.cos(seen.angles)), abs(np.sin(seen.angles)))
    np.testing.assert_allclose(seen.ranges, expected, rtol=1e-12)
    assert seen.facing.all()
    assert np.unique(seen.hits).tolist() == [0, 1, 2, 3]


def test_the_hits_name_the_wall_that_each_beam_looks_at() -> None:
    seen = scan(SQUARE, ORIGIN, Scanner(beams=4, angle_min=0.0, angle_increment=math.pi / 2, sigma=0.0))
    assert seen.hits.tolist() == [1, 2, 3, 0]
    np.testing.assert_allclose(seen.points, [[1, 0], [0, 1], [-1, 0], [0, -1]], atol=1e-15)


def test_a_pose_turns_and_moves_what_is_seen() -> None:
    seen = scan(SQUARE, RigidTransform(0.5, 0.25, math.pi / 2), Scanner.over(math.pi, 3, sigma=0.0))
    np.testing.assert_allclose(seen.ranges, [0.5, 0.75, 1.5])
    assert seen.hits.tolist() == [1, 2, 3]


@pytest.mark.parametrize(
    ("x", "least", "most", "unread"), [(0.0, 0.0, 1.2, math.inf), (0.95, 0.1, 20.0, math.nan)], ids=["far", "near"]
)
def test_what_is_out_of_range_is_no_return_or_unknown(x: float, least: float, most: float, unread: float) -> None:
    seen = scan(SQUARE, RigidTransform(x, 0.0, 0.0), Scanner(range_min=least, range_max=most, sigma=0.0))
    out = (seen.true_ranges < least) | (seen.true_ranges > most)
    assert out.any()
    np.testing.assert_array_equal(seen.ranges, np.where(out, unread, seen.true_ranges))
    assert (seen.hits[out] == -1).all()
    assert not seen.facing[out].any()


def test_noise_lifts_no_range_above_the_limit() -> None:
    limit = 1.001  # the wall is at 1.0
    seen = scan(SQUARE, ORIGIN, Scanner(2000, -0.01, 1e-5, range_max=limit, sigma=0.05), np.random.default_rng(0))
    assert np.isinf(seen.ranges).any()
    assert seen.ranges[np.isfinite(seen.ranges)].max() <= limit


def test_an_empty_map_gives_no_returns() -> None:
    seen = scan(Segments.from_array([]), ORIGIN, QUIET)
    assert np.isinf(seen.ranges).all()
    assert (seen.hits == -1).all()
    assert not seen.facing.any()
    assert seen.points.shape == (0, 2)


@pytest.mark.parametrize(("one_sided", "expected"), [(False, [0.5, 0]), (True, [1.0, 1])])
def test_a_wall_seen_from_behind_stops_a_beam_unless_it_is_one_sided(one_sided: bool, expected: list[float]) -> None:
    walls = Segments.from_array(np.array([[0.5, 1, 0.5, -1], [1, -1, 1, 1]]))
    seen = scan(walls, ORIGIN, Scanner(1, 0.0, 0.1, sigma=0.0, one_sided=one_sided))
    assert [seen.ranges[0], seen.hits[0]] == pytest.approx(expected)
    assert seen.facing.tolist() == [one_sided]


@pytest.mark.parametrize("order", [[0, 1], [1, 0]])
def test_of_a_thin_wall_drawn_both_ways_the_facing_one_is_hit(order: Any) -> None:
    walls = Segments.from_array([[2, 1, 2, -1], [2, -1, 2, 1]]).take(order)
    seen = scan(walls, ORIGIN, Scanner.over(0.5, 21, sigma=0.0))
    assert seen.facing.all()
    assert (seen.hits == order.index(1)).all()


def test_no_beam_slips_through_a_joint() -> None:
    turns = np.linspace(0, math.tau, 361)[:-1]
    ring = np.stack([3 * np.cos(turns), 3 * np.sin(turns)], axis=1)
    map = Segments.from_array(np.hstack([ring, np.roll(ring, -1, axis=0)]))
    seen = scan(map, ORIGIN, Scanner(360, 0.0, math.tau / 360, sigma=0.0))
    np.testing.assert_allclose(seen.ranges, 3.0)


def test_noise_dropouts_and_quantisation_are_as_asked() -> None:
    scanner = Scanner(20_000, -1.0, 1e-4, sigma=0.03, dropout=0.1)
    seen = scan(SQUARE, ORIGIN, scanner, np.random.default_rng(3))
    kept = np.isfinite(seen.ranges)
    noise = (seen.ranges - seen.true_ranges)[kept]
    assert 1 - kept.mean() == pytest.approx(0.1, abs=0.01)
    assert noise.std() == pytest.approx(0.03, rel=0.03)
    assert abs(noise.mean()) < 1e-3
    assert (seen.hits[~kept] == -1).all()
    again = scan(SQUARE, ORIGIN, scanner, np.random.default_rng(3))
    np.testing.assert_array_equal(seen.ranges, again.ranges)
    stepped = scan(SQUARE, ORIGIN, Scanner(sigma=0.0, quantum=0.05)).ranges
    np.testing.assert_allclose(stepped / 0.05, np.round(stepped / 0.05), atol=1e-9)


def test_a_biased_scanner_measures_too_long_and_a_saturated_one_reads_its_limit() -> None:
    plain, biased = (scan(SQUARE, ORIGIN, Scanner(sigma=0.0, bias=bias)).ranges for bias in (0.0, 0.02))
    np.testing.assert_allclose(biased - plain, 0.02)
    full = scan(SQUARE, ORIGIN, Scanner(range_max=1.2, sigma=0.0, saturated=True))
    far = full.true_ranges > 1.2
    assert (full.ranges[far] == 1.2).all()
    assert (full.hits[far] == -1).all()
    assert (full.hits[~far] >= 0).all()


def expected_cast(
    endpoints: Floats,
    x: float,
    y: float,
    start: float,
    increment: float,
    cosines: Floats,
    sines: Floats,
    one_sided: bool,
) -> tuple[Floats, NDArray[np.int64]]:
    """Intersect every beam with every segment: solve ``[x, y] + r d = begin + u (end - begin)``."""
    ranges = np.full(len(cosines), np.inf)
    hits = np.full(len(cosines), -1)
    for i, (dx, dy) in enumerate(zip(cosines, sines, strict=True)):
        best = np.inf
        for k, (bx, by, ex, ey) in enumerate(endpoints):
            left = (ex - bx) * (y - by) - (ey - by) * (x - bx)
            if left == 0 or (one_sided and left < 0):
                continue
            matrix = np.array([[dx, bx - ex], [dy, by - ey]])
            if np.linalg.det(matrix) == 0:
                continue
            r, u = np.linalg.solve(matrix, [bx - x, by - y])
            key = r if left > 0 else r * (1 + 1e-9)
            if r > 0 and -1e-10 <= u <= 1 + 1e-10 and key < best:
                best, ranges[i], hits[i] = key, r, k
    return ranges, hits


@settings(deadline=None, max_examples=60)
@given(
    seed=st.integers(0, 10_000),
    beams=st.integers(1, 40),
    start=st.floats(-7, 7),
    turn=st.floats(0.05, 1.0),
    clockwise=st.booleans(),
    one_sided=st.booleans(),
)
def test_the_kernel_agrees_with_its_twin(
    seed: int, beams: int, start: float, turn: float, clockwise: bool, one_sided: bool
) -> None:
    rng = np.random.default_rng(seed)
    endpoints = rng.uniform(-5, 5, (12, 4))
    x, y = rng.uniform(-2, 2, 2)
    increment = (-1 if clockwise else 1) * turn * math.tau / beams
    angles = start + increment * np.arange(beams)
    arguments = endpoints, x, y, start, increment, np.cos(angles), np.sin(angles), one_sided
    ranges, hits = cast(*arguments)
    expected_ranges, expected_hits = expected_cast(*arguments)
    np.testing.assert_array_equal(hits, expected_hits)
    np.testing.assert_allclose(ranges, expected_ranges, rtol=1e-9)


@pytest.mark.parametrize(
    ("argument", "value"),
    [
        ("beams", 0), ("beams", 100_001), ("angle_min", math.nan), ("angle_increment", 0.0), ("angle_increment", 0.1),
        ("range_min", -1.0), ("range_max", 0.0), ("range_max", math.inf), ("sigma", -0.1), ("sigma", math.nan),
        ("dropout", 1.1), ("quantum", -0.05), ("bias", math.nan),
    ],
)  # fmt: skip
def test_a_scanner_that_cannot_be_is_refused(argument: str, value: Any) -> None:
    with pytest.raises(SimulationError) as caught:
        Scanner(**{argument: value})
    assert caught.value.argument == argument
    assert repr(value) in caught.value.message


def test_noise_without_a_generator_is_refused() -> None:
    with pytest.raises(SimulationError) as caught:
        scan(SQUARE, ORIGIN)
    assert caught.value.argument == "rng"


CLOSED = {
    "rectangle_room": rectangle_room(),
    "square_room": square_room(),
    "l_room": l_room(),
    "cut_square": cut_square(),
    "oblique": oblique(),
    "pillars": pillars(),
    "offices": offices(np.random.default_rng(5)),
    "small office": offices(np.random.default_rng(6), OfficePlan(rooms=1, corridors=1)),
}
FAR = Scanner(range_max=500.0, sigma=0.0)


@pytest.mark.parametrize("name", CLOSED)
def test_every_pose_sees_free_sides_all_around(name: str) -> None:
    world = CLOSED[name]
    assert world.mapped == len(world.segments)
    for pose in world.poses:
        seen = scan(world.segments, pose, FAR)
        assert np.isfinite(seen.ranges).all()
        assert seen.facing.all()
        assert seen.ranges.min() > 0.1


def test_a_corridor_is_two_parallel_walls() -> None:
    seen = scan(corridor(60, 2).segments, RigidTransform(0, 0, 0), Scanner(4, 0.0, np.pi / 2, sigma=0.0, range_max=25))
    assert np.isinf(seen.ranges[[0, 2]]).all()
    np.testing.assert_allclose(seen.ranges[[1, 3]], 1.0)
    assert seen.facing[[1, 3]].all()


def test_rooms_have_their_size() -> None:
    assert square_room(3.0).segments.lengths.tolist() == [3, 3, 3, 3]
    assert rectangle_room(4.0, 2.0).segments.lengths.tolist() == [4, 2, 4, 2]
    assert l_room(8.0, 6.0, 3.0).segments.lengths.tolist() == [8, 3, 3, 3, 5, 6]


def test_the_papers_worlds_scale() -> None:
    assert cut_square(1.0).segments.lengths.max() == pytest.approx(400.0)
    np.testing.assert_allclose(pillars(1.0).segments.endpoints, 100 * pillars(0.01).segments.endpoints)
    assert oblique(2.0).poses[1].x == pytest.approx(200 * oblique().poses[1].x)


def test_offices_grow_as_asked_and_all_rooms_can_be_reached() -> None:
    plan = OfficePlan(rooms=3, corridors=2)
    world = offices(np.random.default_rng(0), plan)
    assert len(world.poses) == 2 * 2 * 3 * 2
    # From before a door straight through it one sees farther than the corridor's wall.
    before = world.poses[1]
    down = scan(world.segments, RigidTransform(before.x, before.y, -np.pi / 2), Scanner(1, 0.0, 0.1, sigma=0.0))
    assert down.ranges[0] == pytest.approx(0.5 * plan.corridor_width + plan.wall + plan.depth)


def test_obstacles_come_after_the_map_and_keep_away_from_the_poses() -> None:
    world = with_obstacles(square_room(10.0), 40, np.random.default_rng(2))
    assert world.mapped == 4
    assert len(world.segments) == 4 + 4 * 40
    np.testing.assert_array_equal(world.map.endpoints, square_room(10.0).segments.endpoints)
    for pose in world.poses:
        seen = scan(world.segments, pose, FAR)
        assert seen.facing.all()
        assert seen.ranges.min() >= 0.5
        assert (seen.hits >= world.mapped).any()


@pytest.mark.parametrize(
    ("make", "argument"),
    [
        (lambda: square_room(0.0), "side"),
        (lambda: rectangle_room(1.0, -1.0), "height"),
        (lambda: l_room(notch=7.0), "notch"),
        (lambda: corridor(length=float("inf")), "length"),
        (lambda: cut_square(0.0), "unit"),
        (lambda: OfficePlan(rooms=0), "rooms"),
        (lambda: OfficePlan(room_width=(1.0, 2.0)), "room_width"),
        (lambda: with_obstacles(square_room(), -1, np.random.default_rng(0)), "boxes"),
        (lambda: with_obstacles(square_room(), 1, np.random.default_rng(0), (2.0, 1.0)), "size"),
    ],
)
def test_a_world_that_cannot_be_is_refused(make: Callable[[], object], argument: str) -> None:
    with pytest.raises(SimulationError) as caught:
        make()
    assert caught.value.argument == argument
