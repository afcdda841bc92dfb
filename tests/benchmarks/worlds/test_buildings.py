"""Drawn buildings have free sides and things, floors share what floors share, cases are what they are called."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.worlds import FAMILIES, FLOOR_KINDS, Case, draw_case, draw_floors, free_place
from benchmarks.worlds.buildings import FIXED, Building
from benchmarks.worlds.buildings.shapes import box, crosses, edges
from registration import Segments
from registration.layout import Floats
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


def shown(case: Case) -> Floats:
    """Ranges of the declared scanner at the true pose in the map, without noise; 1e4 where there is nothing."""
    assert case.truth is not None
    return np.minimum(1e4, scan(case.map, case.truth, replace(case.scanner, sigma=0.0)).true_ranges)


def residuals(case: Case) -> Floats:
    """Measured less shown, of beams that are near neither an edge nor the limits."""
    expected = shown(case)
    steady = np.abs(expected - np.roll(expected, 1)) + np.abs(expected - np.roll(expected, -1)) < 0.15
    inside = np.isfinite(case.ranges) & (expected < case.scanner.range_max - 0.2) & steady
    return case.ranges[inside] - expected[inside]


@pytest.mark.parametrize("world", FAMILIES)
def test_a_clean_scan_shows_the_map_from_its_truth(world: str) -> None:
    case = draw_case(world, "clean", 1)
    off = residuals(case)
    assert len(off) > 100
    assert np.abs(off).max() < 6.0 * case.scanner.sigma
    assert off.std() == pytest.approx(case.scanner.sigma, rel=0.25)


def test_noise_bias_and_no_return_are_what_they_are_called() -> None:
    noisy, biased = draw_case("museum", "noisier", 0), draw_case("museum", "bias", 0)
    assert residuals(noisy).std() == pytest.approx(2.0 * noisy.scanner.sigma, rel=0.2)
    assert abs(np.median(residuals(biased))) == pytest.approx(0.02, abs=0.004)
    full = draw_case("garage", "saturated", 0)
    nothing = shown(full) > full.scanner.range_max
    assert nothing.any()
    assert (full.ranges[nothing] == full.scanner.range_max).all()
    assert not np.isinf(full.ranges).any()
    clean = draw_case("garage", "clean", 0)
    assert np.isinf(clean.ranges[shown(clean) > clean.scanner.range_max]).all()
