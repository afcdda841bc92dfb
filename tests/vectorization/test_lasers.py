"""Scans of lasers: refused values, and a scanner that moves while it scans, every beam from where it then was."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from registration import RigidTransform, Segments
from simulation import Scanner, scan
from vectorization import InvalidOptionError, InvalidScanError, LaserScan, Motion, VectorizationOptions, vectorize

ROOM = np.array([[-3, -2, 5, -2], [5, -2, 5, 3], [5, 3, -3, 3], [-3, 3, -3, -2]], dtype=float)
MOTION = Motion(0.1 / 540, 1.5, -0.2, math.radians(120.0))


def moving_ranges(scanner: Scanner, motion: Motion) -> np.ndarray:
    """Return what is read in ROOM, from the origin on."""
    walls, out = Segments.from_array(ROOM), []
    for angle, (x, y, theta) in zip(scanner.angles, motion.places(scanner.beams).tolist(), strict=True):
        beam = Scanner(1, float(angle), scanner.angle_increment, sigma=0.0)
        out.append(scan(walls, RigidTransform(x, y, theta), beam).ranges[0])
    return np.array(out)


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
    scanner = Scanner.over(1.5 * math.pi, 541, sigma=0.0)
    if backward:
        scanner = Scanner(541, -scanner.angle_min, -scanner.angle_increment, sigma=0.0)
    ranges = moving_ranges(scanner, MOTION)
    told = vectorize(LaserScan(scanner.angle_min, scanner.angle_increment, ranges, motion=MOTION)).measured.segments
    untold = vectorize(LaserScan(scanner.angle_min, scanner.angle_increment, ranges)).measured.segments
    walls = Segments.from_array(ROOM)

    def worst(found: Segments) -> float:
        gaps = np.abs(found.midpoints @ walls.normals.T - walls.offsets)
        alike = found.directions @ walls.directions.T > 0.9
        return float(np.where(alike, gaps, np.inf).min(axis=1).max())

    assert worst(told) < 0.01
    assert worst(untold) > 0.05
    assert len(told) >= 3


def test_beams_begin_where_the_scanner_was() -> None:
    scanner = Scanner.over(1.5 * math.pi, 541, sigma=0.0)
    found = vectorize(
        LaserScan(scanner.angle_min, scanner.angle_increment, moving_ranges(scanner, MOTION), motion=MOTION)
    )
    beams = found.beams
    assert beams is not None
    assert beams.origins is not None
    ends = beams.origins + beams.ranges[:, None] * np.stack([np.cos(beams.angles), np.sin(beams.angles)], axis=1)
    walls = Segments.from_array(ROOM)
    assert np.abs(ends @ walls.normals.T - walls.offsets).min(axis=1).max() < 1e-9
    assert found.viewpoint == pytest.approx(beams.origins.mean(axis=0))


def test_one_that_turns_as_fast_as_it_scans_is_refused() -> None:
    with pytest.raises(InvalidScanError) as caught:
        LaserScan(0.0, 0.01, [1.0, 1.0], motion=Motion(0.001, 0.0, 0.0, -8.0))
    assert caught.value.argument == "twist"


def test_spans_of_a_scanner_that_moves_run_as_its_beams_do() -> None:
    """Both ends of a segment are its first and last beam, counted down where it turns clockwise."""
    for backward in (False, True):
        scanner = Scanner.over(1.5 * math.pi, 541, sigma=0.0)
        if backward:
            scanner = Scanner(541, -scanner.angle_min, -scanner.angle_increment, sigma=0.0)
        ranges = moving_ranges(scanner, MOTION)
        laser = LaserScan(scanner.angle_min, scanner.angle_increment, ranges, motion=MOTION)
        found = vectorize(laser)
        places = laser.places
        angles = laser.angles + places[:, 2]
        ends = places[:, :2] + ranges[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        told = found.measured.segments.endpoints.reshape(-1, 2, 2)
        np.testing.assert_allclose(ends[found.spans], told, atol=0.1)
        assert ((found.spans[:, 0] > found.spans[:, 1]) == backward).all()


@pytest.mark.parametrize(
    ("argument", "arguments"),
    [
        ("angle_min", (math.nan, 0.1, [1.0])),
        ("angle_min", (math.inf, 0.1, [1.0])),
        ("angle_increment", (0.0, 0.0, [1.0])),
        ("angle_increment", (0.0, math.nan, [1.0])),
        ("angle_increment", (0.0, 1e-200, [1.0] * 50)),
        ("angle_increment", (0.0, -9e-7, [1.0] * 50)),
        ("angle_increment", (0.0, 0.1, [1.0] * 100)),
        ("angle_increment", (0.0, 7.0, [1.0])),
        ("ranges", (0.0, 0.1, [[1.0]])),
        ("ranges", (0.0, 0.1, ["1.0"])),
        ("ranges", (0.0, 0.1, ["1.0", None])),
        ("ranges", (0.0, 0.1, [True, None])),
        ("ranges", (0.0, 0.1, [True, False])),
        ("ranges", (0.0, 0.1, 1.0)),
        ("ranges", (0.0, 1e-6, np.ones(100_001))),
        ("range_min", (0.0, 0.1, [1.0], -0.1)),
        ("range_min", (0.0, 0.1, [1.0], math.inf)),
        ("range_max", (0.0, 0.1, [1.0], 0.5, 0.5)),
        ("range_max", (0.0, 0.1, [1.0], 0.0, math.nan)),
    ],
)
def test_a_scan_that_cannot_be_is_refused(argument: str, arguments: Any) -> None:
    with pytest.raises(InvalidScanError) as caught:
        LaserScan(*arguments)
    assert caught.value.argument == argument
    assert caught.value.message


@pytest.mark.parametrize(
    ("index", "points"),
    [
        (None, [1.0, 2.0]),
        (None, [[1.0, 2.0, 3.0]]),
        (None, [["a", "b"]]),
        (None, [[1.0, 2.0], [1.0]]),
        (None, np.zeros((100_001, 2))),
        (1, [[1.0, 2.0], [math.nan, 0.0]]),
        (2, [[1.0, 2.0], [3.0, 4.0], [1.1e4, 0.0]]),
        (0, [[2e9, 2.0]]),
    ],
)
def test_points_that_cannot_be_are_refused(index: int | None, points: Any) -> None:
    with pytest.raises(InvalidScanError) as caught:
        vectorize(points)
    assert caught.value.argument == "points"
    assert caught.value.index == index


@pytest.mark.parametrize("viewpoint", [(0.0,), (math.nan, 0.0), (2e4, 0.0)])
def test_a_viewpoint_that_cannot_be_is_refused(viewpoint: Any) -> None:
    with pytest.raises(InvalidScanError) as caught:
        vectorize([[1.0, 1.0]], viewpoint=viewpoint)
    assert caught.value.argument == "viewpoint"


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
