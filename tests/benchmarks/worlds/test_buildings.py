"""Drawn buildings have free sides, and a clean scan shows its map. Other tests are in `test_as_drawn`."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.worlds import FAMILIES, draw_case, free_place
from benchmarks.worlds.buildings import Building
from benchmarks.worlds.buildings.shapes import box, edges
from registration import Segments
from simulation import Scanner, SimulationError, scan

ALL_AROUND = Scanner.over(math.tau, 720, range_max=500.0, sigma=0.0)


def draw(name: str, seed: int) -> Building:
    rng = np.random.default_rng(seed)
    return FAMILIES[name].draw(rng).build(rng)


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
        assert met.all() or name == "facades"


def test_where_there_is_no_room_there_is_an_error() -> None:
    with pytest.raises(SimulationError) as caught:
        free_place(Segments.from_array(edges(box(0, 0, 0.6, 0.6))), np.random.default_rng(0))
    assert caught.value.argument == "segments"


@pytest.mark.parametrize("world", FAMILIES)
def test_a_clean_scan_shows_the_map_from_its_truth(world: str) -> None:
    """Compared are beams that are near neither an edge nor the limits."""
    case = draw_case(world, "clean", 1)
    assert case.truth is not None
    expected = np.minimum(1e4, scan(case.map, case.truth, replace(case.scanner, sigma=0.0)).true_ranges)
    steady = np.abs(expected - np.roll(expected, 1)) + np.abs(expected - np.roll(expected, -1)) < 0.15
    inside = np.isfinite(case.ranges) & (expected < case.scanner.range_max - 0.2) & steady
    off = case.ranges[inside] - expected[inside]
    assert len(off) > 100
    assert np.abs(off).max() < 6.0 * case.scanner.sigma
    assert off.std() == pytest.approx(case.scanner.sigma, rel=0.25)
