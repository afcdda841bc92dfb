"""Scans of lasers: refused values, and a scanner that moves while it scans, every beam from where it then was."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from registration import RigidTransform, Segments
from simulation import Scanner, scan
from vectorization import InvalidOptionError, InvalidScanError, LaserScan, Motion, VectorizationOptions, vectorize

WALLS = Segments.from_array([[-3, -2, 5, -2], [5, -2, 5, 3], [5, 3, -3, 3], [-3, 3, -3, -2]])
MOTION = Motion(0.1 / 540, 1.5, -0.2, math.radians(120.0))


def moving(*, backward: bool = False) -> LaserScan:
    """Return what a scanner that moves reads in ROOM, from the origin on."""
    scanner = Scanner.over(1.5 * math.pi, 541, sigma=0.0)
    if backward:
        scanner = Scanner(541, -scanner.angle_min, -scanner.angle_increment, sigma=0.0)
    ranges = []
    for angle, (x, y, theta) in zip(scanner.angles, MOTION.places(scanner.beams).tolist(), strict=True):
        beam = Scanner(1, float(angle), scanner.angle_increment, sigma=0.0)
        ranges.append(scan(WALLS, RigidTransform(x, y, theta), beam).ranges[0])
    return LaserScan(scanner.angle_min, scanner.angle_increment, ranges, motion=MOTION)


def test_a_constant_twist_is_an_arc() -> None:
    """A quarter of a circle of 2 m in a second; straight on without a turn."""
    places = Motion(0.25, math.pi, 0.0, 0.5 * math.pi).places(5)
    assert places[4] == pytest.approx([2.0, 2.0, 0.5 * math.pi])
    assert places[0] == pytest.approx([0.0, 0.0, 0.0])
    assert Motion(0.5, 1.0, -2.0, 0.0).places(3)[2] == pytest.approx([1.0, -2.0, 0.0])
    aside = Motion(0.25, 0.0, math.pi, 0.5 * math.pi).places(5)
    assert aside[4] == pytest.approx([-2.0, 2.0, 0.5 * math.pi])


@pytest.mark.parametrize("backward", [False, True])
def test_walls_are_where_they_are_though_the_scanner_moved(backward: bool) -> None:
    """In the frame of the first beam; without the motion they are not."""
    laser = moving(backward=backward)
    told, untold = (vectorize(one).measured.segments for one in (laser, replace(laser, motion=None)))

    def worst(found: Segments) -> float:
        gaps = np.abs(found.midpoints @ WALLS.normals.T - WALLS.offsets)
        alike = found.directions @ WALLS.directions.T > 0.9
        return float(np.where(alike, gaps, np.inf).min(axis=1).max())

    assert worst(told) < 0.01
    assert worst(untold) > 0.05
    assert len(told) >= 3


def test_beams_begin_where_the_scanner_was() -> None:
    found = vectorize(moving())
    beams = found.beams
    assert beams is not None
    assert beams.origins is not None
    ends = beams.origins + beams.ranges[:, None] * np.stack([np.cos(beams.angles), np.sin(beams.angles)], axis=1)
    assert np.abs(ends @ WALLS.normals.T - WALLS.offsets).min(axis=1).max() < 1e-9
    assert found.viewpoint == pytest.approx(beams.origins.mean(axis=0))


@pytest.mark.parametrize("backward", [False, True])
def test_spans_of_a_scanner_that_moves_run_as_its_beams_do(backward: bool) -> None:
    """Both ends of a segment are its first and last beam, counted down where it turns clockwise."""
    laser = moving(backward=backward)
    found, places = vectorize(laser), laser.places
    angles = laser.angles + places[:, 2]
    ends = places[:, :2] + laser.cleaned[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    told = found.measured.segments.endpoints.reshape(-1, 2, 2)
    np.testing.assert_allclose(ends[found.spans], told, atol=0.1)
    assert ((found.spans[:, 0] > found.spans[:, 1]) == backward).all()


def laser(*of: Any, **more: Any) -> Callable[[], object]:
    return lambda: LaserScan(*of, **more)


def points(of: Any, viewpoint: Any = (0.0, 0.0)) -> Callable[[], object]:
    return lambda: vectorize(of, viewpoint=viewpoint)


@pytest.mark.parametrize(
    ("argument", "index", "call"),
    [
        ("angle_min", None, laser(math.nan, 0.1, [1.0])),
        ("angle_min", None, laser(math.inf, 0.1, [1.0])),
        ("angle_increment", None, laser(0.0, 0.0, [1.0])),
        ("angle_increment", None, laser(0.0, math.nan, [1.0])),
        ("angle_increment", None, laser(0.0, 1e-200, [1.0] * 50)),
        ("angle_increment", None, laser(0.0, -9e-7, [1.0] * 50)),
        ("angle_increment", None, laser(0.0, 0.1, [1.0] * 100)),
        ("angle_increment", None, laser(0.0, 7.0, [1.0])),
        ("ranges", None, laser(0.0, 0.1, [[1.0]])),
        ("ranges", None, laser(0.0, 0.1, ["1.0"])),
        ("ranges", None, laser(0.0, 0.1, ["1.0", None])),
        ("ranges", None, laser(0.0, 0.1, [True, None])),
        ("ranges", None, laser(0.0, 0.1, [True, False])),
        ("ranges", None, laser(0.0, 0.1, 1.0)),
        ("ranges", None, laser(0.0, 1e-6, np.ones(100_001))),
        ("range_min", None, laser(0.0, 0.1, [1.0], -0.1)),
        ("range_min", None, laser(0.0, 0.1, [1.0], math.inf)),
        ("range_max", None, laser(0.0, 0.1, [1.0], 0.5, 0.5)),
        ("range_max", None, laser(0.0, 0.1, [1.0], 0.0, math.nan)),
        ("twist", None, laser(0.0, 0.01, [1.0, 1.0], motion=Motion(0.001, 0.0, 0.0, -8.0))),  # turns as it scans
        ("points", None, points([1.0, 2.0])),
        ("points", None, points([[1.0, 2.0, 3.0]])),
        ("points", None, points([["a", "b"]])),
        ("points", None, points([[1.0, 2.0], [1.0]])),
        ("points", None, points(np.zeros((100_001, 2)))),
        ("points", 1, points([[1.0, 2.0], [math.nan, 0.0]])),
        ("points", 2, points([[1.0, 2.0], [3.0, 4.0], [1.1e4, 0.0]])),
        ("points", 0, points([[2e9, 2.0]])),
        ("viewpoint", None, points([[1.0, 1.0]], (0.0,))),
        ("viewpoint", None, points([[1.0, 1.0]], (math.nan, 0.0))),
        ("viewpoint", None, points([[1.0, 1.0]], (2e4, 0.0))),
    ],
)
def test_what_cannot_be_is_refused(argument: str, index: int | None, call: Callable[[], object]) -> None:
    with pytest.raises(InvalidScanError) as caught:
        call()
    assert (caught.value.argument, caught.value.index) == (argument, index)
    assert caught.value.message


@pytest.mark.parametrize(
    ("argument", "value"),
    [
        ("sigma", 0.0), ("sigma", math.nan), ("sigma", 11.0), ("min_points", 2), ("min_points", 1001),
        ("min_length", 0.0), ("min_length", math.inf), ("max_gap", 0.0), ("max_gap", math.inf), ("max_gap", math.nan),
    ],
)  # fmt: skip
def test_an_option_out_of_range_is_refused(argument: str, value: Any) -> None:
    with pytest.raises(InvalidOptionError) as caught:
        VectorizationOptions(**{argument: value})
    assert caught.value.argument == argument
    assert repr(value) in caught.value.message


def test_no_points_are_no_segments() -> None:
    for viewpoint in (None, (0.0, 0.0)):
        assert len(vectorize([], viewpoint=viewpoint).measured) == 0
        assert len(vectorize([[0.0, 0.0]], viewpoint=viewpoint).measured) == 0
        assert len(vectorize([[1.0, 1.0]] * 50, viewpoint=viewpoint).measured) == 0


@pytest.mark.parametrize("nearest", [5e-324, 1e-200, 9e-7])
def test_a_range_of_next_to_nothing_is_none(nearest: float) -> None:
    angles = np.linspace(-1.0, 1.0, 50)
    ranges = 2.0 / np.cos(angles)
    mixed = np.where(np.arange(50) % 10 == 0, nearest, ranges)
    unknown = np.where(np.arange(50) % 10 == 0, math.nan, ranges)
    found, without = (vectorize(LaserScan(-1.0, angles[1] - angles[0], r)) for r in (mixed, unknown))
    np.testing.assert_array_equal(found.measured.segments.endpoints, without.measured.segments.endpoints)
    assert len(vectorize(LaserScan(-1.0, 0.01, np.full(50, nearest))).measured) == 0
