import math

import numpy as np
import pytest

from benchmarks.worlds import FAMILIES, free_place
from benchmarks.worlds.buildings import FIXED, Building
from benchmarks.worlds.buildings.plan import Plan
from benchmarks.worlds.buildings.shapes import arc, box, chamfered, crosses, edges, oblong, ring
from simulation import Scanner, SimulationError, scan

ALL_AROUND = Scanner.over(math.tau, 720, range_max=500.0, sigma=0.0)
SEEDS = (1, 2)


def draw(name: str, seed: int) -> Building:
    rng = np.random.default_rng(seed)
    return FAMILIES[name].draw(rng).build(rng)


def area(outline: np.ndarray) -> float:
    x, y, u, v = outline.T
    return 0.5 * float((x * v - u * y).sum())


@pytest.mark.parametrize("name", FAMILIES)
@pytest.mark.parametrize("seed", SEEDS)
def test_a_robot_sees_free_sides_alone(name: str, seed: int) -> None:
    building, rng = draw(name, seed), np.random.default_rng(seed)
    for _ in range(6):
        pose = free_place(building.segments, rng)
        seen = scan(building.segments, pose, ALL_AROUND)
        met = seen.hits >= 0
        assert met.mean() > 0.2
        assert seen.facing[met].all()
        assert seen.ranges.min() > 0.4


@pytest.mark.parametrize("name", [name for name in FAMILIES if name != "facades"])
def test_a_building_is_closed_but_for_a_street(name: str) -> None:
    building = draw(name, 3)
    pose = free_place(building.segments, np.random.default_rng(3))
    assert np.isfinite(scan(building.segments, pose, ALL_AROUND).ranges).all()


@pytest.mark.parametrize("name", FAMILIES)
@pytest.mark.parametrize("seed", SEEDS)
def test_sizes_are_those_of_buildings(name: str, seed: int) -> None:
    building = draw(name, seed)
    corners = building.segments.endpoints.reshape(-1, 2)
    assert 40 <= len(building.segments) <= 1700
    assert np.ptp(corners, axis=0).min() > 8.0
    assert np.ptp(corners, axis=0).max() < 150.0
    assert building.segments.lengths.min() > 0.01
    assert building.name == name


@pytest.mark.parametrize("name", FAMILIES)
def test_the_same_seed_draws_the_same_building_and_sisters_differ(name: str) -> None:
    one, again, other = draw(name, 5), draw(name, 5), draw(name, 6)
    np.testing.assert_array_equal(one.segments.endpoints, again.segments.endpoints)
    np.testing.assert_array_equal(one.things, again.things)
    rng = np.random.default_rng(5)
    style = FAMILIES[name].draw(rng)
    sisters = style.build(rng), style.build(rng)
    for different in (other, sisters[1]):
        assert different.segments.endpoints.shape != one.segments.endpoints.shape or not np.allclose(
            different.segments.endpoints, one.segments.endpoints
        )


@pytest.mark.parametrize("name", FAMILIES)
def test_things_are_closed_outlines_that_stand_apart(name: str) -> None:
    building = draw(name, 4)
    assert building.things.shape == (len(building.segments),)
    assert set(building.things.tolist()) == {FIXED, *range(len(building.kinds))}
    for thing in range(len(building.kinds)):
        sides = building.segments.endpoints[building.things == thing]
        np.testing.assert_allclose(sides[:, 2:], np.roll(sides[:, :2], -1, axis=0), atol=1e-12)
        assert area(sides) < 0.0
        assert not crosses(sides, building.segments.endpoints[building.things != thing])


@pytest.mark.parametrize("name", FAMILIES)
def test_what_can_be_moved_is_marked(name: str) -> None:
    found = [draw(name, seed) for seed in range(6)]
    assert sum(len(building.kinds) for building in found) > 0
    if name not in ("mine", "facades", "round_rooms", "museum"):
        assert all(len(building.doors) > 0 for building in found)
    for building in found:
        widths = np.hypot(*(building.doors[:, 2:] - building.doors[:, :2]).T)
        assert ((widths > 0.7) & (widths < 2.6)).all()


def test_half_of_the_families_are_kept_for_the_report() -> None:
    assert len(FAMILIES) >= 14
    assert sum(family.held_out for family in FAMILIES.values()) == len(FAMILIES) // 2


def test_an_opening_joins_two_rooms() -> None:
    plan = Plan()
    plan.room(box(0.0, 0.0, 4.0, 3.0))
    plan.room(box(4.2, 0.0, 8.0, 3.0))
    plan.opening((4.0, 1.0), (4.0, 2.0), 0.2, door=True)
    building = plan.building("two rooms")
    expected = [
        [0, 0, 4, 0], [4, 3, 0, 3], [0, 3, 0, 0], [4.2, 0, 8, 0], [8, 0, 8, 3], [8, 3, 4.2, 3],
        [4, 1, 4.2, 1], [4.2, 2, 4, 2], [4, 0, 4, 1], [4, 2, 4, 3], [4.2, 3, 4.2, 2], [4.2, 1, 4.2, 0],
    ]  # fmt: skip
    drawn = sorted(np.round(building.segments.endpoints, 9).tolist())
    assert drawn == sorted(np.array(expected, dtype=float).tolist())
    assert building.doors.tolist() == [[4.0, 1.0, 4.0, 2.0]]


def test_a_recess_sets_a_wall_back() -> None:
    plan = Plan()
    plan.room(box(0.0, 0.0, 4.0, 3.0))
    plan.recess((1.0, 0.0), (3.0, 0.0), 0.5)
    drawn = np.round(plan.building("niche").segments.endpoints, 9).tolist()
    for wall in ([0, 0, 1, 0], [1, 0, 1, -0.5], [1, -0.5, 3, -0.5], [3, -0.5, 3, 0], [3, 0, 4, 0]):
        assert [float(v) for v in wall] in drawn
    assert len(drawn) == 8


def test_an_opening_in_no_wall_is_refused() -> None:
    plan = Plan()
    plan.room(box(0.0, 0.0, 4.0, 3.0))
    plan.opening((1.0, 0.0), (2.0, 0.0), 0.2)
    with pytest.raises(SimulationError) as caught:
        plan.building("no room behind")
    assert caught.value.argument == "opening"


@pytest.mark.parametrize("mirrored", [False, True])
def test_parts_lie_where_they_are_put_with_free_space_on_the_left(mirrored: bool) -> None:
    plan = Plan()
    part = plan.at(10.0, 5.0, 0.5 * math.pi, mirrored=mirrored)
    part.room(box(0.0, 0.0, 4.0, 3.0))
    part.thing("box", box(1.0, 1.0, 2.0, 2.0))
    part.wall([(0.5, 0.5), (3.5, 0.5)])
    building = plan.building("part")
    sign = -1.0 if mirrored else 1.0
    room, wall, thing = np.split(building.segments.endpoints, [4, 5])
    assert area(room) == pytest.approx(12.0)
    assert area(thing) == pytest.approx(-1.0)
    # x of the part is y of the plan, its y is -x.
    assert thing[:, :2].mean(axis=0).tolist() == pytest.approx([8.5, 5.0 + 1.5 * sign])
    begin, end = (wall[0, :2], wall[0, 2:]) if not mirrored else (wall[0, 2:], wall[0, :2])
    assert begin.tolist() == pytest.approx([9.5, 5.0 + 0.5 * sign])
    assert end.tolist() == pytest.approx([9.5, 5.0 + 3.5 * sign])


def test_a_thing_in_a_wall_or_in_another_is_left_out() -> None:
    plan = Plan()
    plan.room(box(0.0, 0.0, 4.0, 3.0))
    plan.thing("first", box(1.0, 1.0, 2.0, 2.0))
    plan.thing("in the first", box(1.5, 1.5, 2.5, 2.5))
    plan.thing("in a wall", box(3.5, 1.0, 4.5, 2.0))
    plan.thing("last", box(2.5, 0.5, 3.0, 1.0))
    assert plan.building("room").kinds == ("first", "last")


def test_shapes_are_counter_clockwise_and_of_their_size() -> None:
    assert area(edges(box(0, 0, 2, 1))) == pytest.approx(2.0)
    assert area(edges(oblong(3, 4, 2, 1, 0.7))) == pytest.approx(2.0)
    assert area(edges(chamfered(0, 0, 2, 1, 0.3, 0.2))) == pytest.approx(2.0 - 4 * 0.5 * 0.2**2)
    assert area(edges(ring(1, 1, 2.0, 400))) == pytest.approx(4.0 * math.pi, rel=1e-3)
    np.testing.assert_allclose(arc(0, 0, 1.0, 0.0, math.pi, 2), [[1, 0], [0, 1], [-1, 0]], atol=1e-12)


def test_outlines_that_cross_are_told_from_those_that_touch() -> None:
    square = edges(box(0, 0, 1, 1))
    assert crosses(square, np.array([[0.5, 0.5, 2.0, 0.5]]))
    assert not crosses(square, np.array([[1.0, 0.0, 1.0, 1.0], [1.5, 0.0, 1.5, 1.0], [0.2, 0.2, 0.8, 0.8]]))
    assert not crosses(square, np.zeros((0, 4)))
    # Across the line of a side, but not across the side.
    angle = edges(np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]]))
    assert not crosses(angle, np.array([[0.5, 0.5, 0.5, 1.5], [1.2, 1.2, 1.8, 1.8]]))
    assert crosses(angle, np.array([[0.5, 0.6, 1.5, 1.8]]))
