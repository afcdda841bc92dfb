from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import simulation
from registration import RigidTransform
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


def test_the_papers_pillars_show_two_long_edges_in_different_directions_from_every_pose() -> None:
    world = pillars(1.0)
    for pose in world.poses:
        hits = np.unique(scan(world.segments, pose, Scanner(range_max=1e3, sigma=0.0)).hits)
        directions = world.segments.directions[hits[world.segments.lengths[hits] >= 80]]
        assert abs(directions[:, 0]).max() > 0.9
        assert abs(directions[:, 1]).max() > 0.9


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


def test_everything_exported_exists() -> None:
    assert all(hasattr(simulation, name) for name in simulation.__all__)
