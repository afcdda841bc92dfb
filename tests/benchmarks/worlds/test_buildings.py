"""Drawn buildings: their free sides and things, places in them, and floors that share what floors share."""

from __future__ import annotations

import math

import numpy as np
import pytest

from benchmarks.worlds import FAMILIES, FLOOR_KINDS, draw_floors, free_place, free_places
from benchmarks.worlds.buildings import FIXED, Building
from benchmarks.worlds.buildings.shapes import box, crosses, edges
from registration import Segments
from simulation import Scanner, SimulationError, scan

ALL_AROUND = Scanner.over(math.tau, 720, range_max=500.0, sigma=0.0)


def draw(name: str, seed: int) -> Building:
    rng = np.random.default_rng(seed)
    return FAMILIES[name].draw(rng).build(rng)


def area(outline: np.ndarray) -> float:
    x, y, u, v = outline.T
    return 0.5 * float((x * v - u * y).sum())


@pytest.mark.parametrize("name", FAMILIES)
def test_a_robot_sees_free_sides_alone(name: str) -> None:
    building, rng = draw(name, 1), np.random.default_rng(1)
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
def test_things_are_closed_outlines_that_stand_apart(name: str) -> None:
    building = draw(name, 4)
    assert building.things.shape == (len(building.segments),)
    assert set(building.things.tolist()) == {FIXED, *range(len(building.kinds))}
    for thing in range(len(building.kinds)):
        sides = building.segments.endpoints[building.things == thing]
        np.testing.assert_allclose(sides[:, 2:], np.roll(sides[:, :2], -1, axis=0), atol=1e-12)
        assert area(sides) < 0.0
        assert not crosses(sides, building.segments.endpoints[building.things != thing])


ROOM = np.vstack([edges(box(0, 0, 6, 4)), edges(box(2, 1, 3, 2)[::-1])])  # with a pillar


def test_where_there_is_no_room_there_is_an_error() -> None:
    with pytest.raises(SimulationError) as caught:
        free_place(Segments.from_array(edges(box(0, 0, 0.6, 0.6))), np.random.default_rng(0))
    assert caught.value.argument == "segments"


@pytest.mark.parametrize("name", FLOOR_KINDS)
def test_floors_share_outer_walls_and_shafts_and_differ_otherwise(name: str) -> None:
    kind = FLOOR_KINDS[name]
    floors = draw_floors(kind, 4, np.random.default_rng(3))
    rows = [{tuple(row) for row in floor.endpoints.tolist()} for floor in floors]
    shared = set.intersection(*rows)
    width, depth = kind.size
    outer = {(0.0, 0.0, width, 0.0), (width, 0.0, width, depth), (width, depth, 0.0, depth), (0.0, depth, 0.0, 0.0)}
    assert outer <= shared
    assert len(shared) >= 4 + 3 * 4  # the outer walls, and three cores
    assert all(len(own - shared) >= 10 for own in rows)
    assert all(own != other for k, own in enumerate(rows) for other in rows[:k])


def test_the_same_generator_draws_the_same_floors() -> None:
    kind = FLOOR_KINDS["flats"]
    first, second = (draw_floors(kind, 2, np.random.default_rng(8)) for _ in range(2))
    assert all((a.endpoints == b.endpoints).all() for a, b in zip(first, second, strict=True))


@pytest.mark.parametrize("name", FLOOR_KINDS)
def test_places_are_free_and_inside(name: str) -> None:
    kind, rng = FLOOR_KINDS[name], np.random.default_rng(1)
    (floor,) = draw_floors(kind, 1, rng)
    for x, y in free_places(floor, kind, 20, rng):
        assert 0.0 < x < kind.size[0]
        assert 0.0 < y < kind.size[1]
        begins, ends = floor.endpoints[:, :2], floor.endpoints[:, 2:]
        along = np.clip(((np.array([x, y]) - begins) * (ends - begins)).sum(axis=1) / floor.lengths**2, 0.0, 1.0)
        gaps = np.linalg.norm(begins + along[:, None] * (ends - begins) - [x, y], axis=1)
        assert gaps.min() >= 0.45
