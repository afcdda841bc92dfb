"""Scans: values that are refused, scanners that move while they scan, points that repeat or are in no order."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import linefix
from registration import RigidTransform, Segments
from simulation import Scanner, scan
from vectorization import InvalidOptionError, InvalidScanError, LaserScan, Motion, VectorizationOptions, vectorize
from vectorization.order import without_repeats

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


Floats = NDArray[np.float64]
Viewpoint = tuple[float, float] | None
HALL = [[0, 0, 8, 0], [8, 0, 8, 5], [8, 5, 5, 5], [5, 5, 5, 3], [5, 3, 0, 3], [0, 3, 0, 0]]
SCANNER = Scanner(beams=540, sigma=0.008)
VIEWPOINTS: list[Viewpoint] = [(0.0, 0.0), None]


def seen(seed: int = 0, x: float = 2.0, y: float = 1.4, theta: float = 0.3) -> tuple[Floats, Floats]:
    """Return the points of a scan, and the directions of their rays."""
    pose = RigidTransform(x, y, theta)
    ranges = scan(Segments.from_array(np.array(HALL, dtype=float)), pose, SCANNER, np.random.default_rng(seed)).ranges
    angles = SCANNER.angle_min + SCANNER.angle_increment * np.arange(SCANNER.beams)
    rays = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    kept = np.isfinite(ranges)
    return ranges[kept, None] * rays[kept], rays[kept]


COUNTS: dict[str, Callable[[int], NDArray[np.int64]]] = {
    "twice": lambda n: np.full(n, 2),
    "thrice": lambda n: np.full(n, 3),
    "every second twice": lambda n: 1 + np.arange(n) % 2,
    "a third of them twice": lambda n: 1 + (np.arange(n) % 3 == 0),
    "seven times": lambda n: np.full(n, 7),
    "some": lambda n: np.random.default_rng(1).integers(1, 4, n),
    "one": lambda n: 1 + (np.arange(n) == 9),
}


@pytest.mark.parametrize("viewpoint", VIEWPOINTS)
@pytest.mark.parametrize("name", COUNTS)
def test_points_that_come_again_count_once(name: str, viewpoint: Viewpoint) -> None:
    points, _ = seen()
    once = vectorize(points, viewpoint=viewpoint)
    repeats = COUNTS[name](len(points))
    found = vectorize(np.repeat(points, repeats, axis=0), viewpoint=viewpoint)
    np.testing.assert_array_equal(found.measured.segments.endpoints, once.measured.segments.endpoints)
    np.testing.assert_array_equal(found.measured.point_counts, once.measured.point_counts)
    assert found.sigma == once.sigma
    assert found.ordered
    # Spans are indices of the points as they were sent.
    begins = np.concatenate(([0], np.cumsum(repeats)[:-1]))
    np.testing.assert_array_equal(found.spans, begins[once.spans])


@pytest.mark.parametrize("viewpoint", VIEWPOINTS)
@pytest.mark.parametrize("again", [lambda p: p, lambda p: p[::-1]], ids=["from the beginning", "back"])
def test_a_scan_that_is_sent_twice_counts_once(again: Callable[[Floats], Floats], viewpoint: Viewpoint) -> None:
    points, _ = seen()
    found = vectorize(np.vstack([points, again(points)]), viewpoint=viewpoint)
    np.testing.assert_array_equal(
        found.measured.point_counts, vectorize(points, viewpoint=viewpoint).measured.point_counts
    )


def nearly(once: Floats, other: Floats) -> bool:
    """Tell whether segments are the same, but for noise."""
    return len(once) == len(other) and bool(np.abs(once - other).max() < 0.1)


@pytest.mark.parametrize("viewpoint", VIEWPOINTS)
@pytest.mark.parametrize("name", list(COUNTS)[:4])
@pytest.mark.parametrize("scatter", [1e-7, 1e-4, 1e-3])
def test_points_that_come_nearly_again_count_once(name: str, scatter: float, viewpoint: Viewpoint) -> None:
    points, _ = seen()
    repeated = np.repeat(points, COUNTS[name](len(points)), axis=0)
    repeated += np.random.default_rng(2).normal(0.0, scatter, repeated.shape)
    once, found = vectorize(points, viewpoint=viewpoint), vectorize(repeated, viewpoint=viewpoint)
    assert nearly(once.measured.segments.endpoints, found.measured.segments.endpoints)
    assert found.measured.point_counts.sum() < 1.25 * len(points)
    assert found.ordered


@pytest.mark.parametrize("scatter", [1e-3, 8e-3])
def test_two_returns_of_each_beam_count_once(scatter: float) -> None:
    points, rays = seen()
    along = np.random.default_rng(3).normal(0.0, scatter, (len(points), 1))
    pairs = np.stack([points, points + along * rays], axis=1).reshape(-1, 2)
    once, found = vectorize(points), vectorize(pairs)
    assert nearly(once.measured.segments.endpoints, found.measured.segments.endpoints)
    assert found.measured.point_counts.sum() <= len(points)


@pytest.mark.parametrize("fraction", [0.05, 0.1, 0.3, 0.6, 1.0])
def test_steps_of_points_that_are_spaced_unevenly_are_no_repeats(fraction: float) -> None:
    rng = np.random.default_rng(4)
    for _ in range(20):
        kept = np.sort(rng.choice(6000, int(6000 * fraction), replace=False))
        at_random = np.diff(np.sort(rng.uniform(0.0, 6.0, int(600 * fraction))))
        for steps in (np.diff(kept).astype(float), at_random):
            assert len(without_repeats(steps, np.ones(len(steps), dtype=np.bool_))) == len(steps) + 1


def shuffled(points: Floats, rng: np.random.Generator) -> Floats:
    return rng.permutation(points)


def in_blocks(points: Floats, rng: np.random.Generator) -> Floats:
    return np.vstack([points[9 * k : 9 * k + 9] for k in rng.permutation(len(points) // 9)])


def interleaved(points: Floats, rng: np.random.Generator) -> Floats:
    half = len(points) // 2
    return np.stack([points[:half], points[half : 2 * half]], axis=1).reshape(-1, 2)


@pytest.mark.parametrize("how", [shuffled, in_blocks, interleaved])
def test_points_in_no_order_are_told(how: Callable[[Floats, np.random.Generator], Floats]) -> None:
    rng = np.random.default_rng(5)
    for seed in range(5):
        points, _ = seen(seed)
        assert not vectorize(how(points, rng)).ordered
    points, _ = seen()
    assert not vectorize(shuffled(points, rng), viewpoint=None).ordered


def test_two_scans_one_after_the_other_are_not_in_order() -> None:
    assert not vectorize(np.vstack([seen(1)[0], seen(2)[0]])).ordered


@pytest.mark.parametrize("viewpoint", VIEWPOINTS)
def test_points_in_order_are_not_doubted(viewpoint: Viewpoint) -> None:
    rng = np.random.default_rng(6)
    for seed in range(20):
        points, _ = seen(seed, rng.uniform(0.5, 7.5), rng.uniform(0.5, 2.5), rng.uniform(-3.0, 3.0))
        part = points[rng.integers(0, 300) :][: rng.integers(12, 500)]
        thinned = points[np.sort(rng.choice(len(points), 60, replace=False))]
        rough = points + rng.normal(0.0, 0.01, points.shape)
        turned = np.roll(points, rng.integers(len(points)), axis=0)
        for some in (points, points[::-1], part, thinned, rough, turned, points.round(2), points[:5]):
            assert vectorize(some, viewpoint=viewpoint).ordered


def test_the_answer_warns_of_points_in_no_order() -> None:
    points, _ = seen(x=5.5, y=2.0, theta=3.1)
    for scan_points, codes in ((points, []), (np.random.default_rng(7).permutation(points), ["points_not_in_order"])):
        answer = linefix.locate(HALL, scan_points)
        assert [warning.code for warning in answer.warnings if warning.code == "points_not_in_order"] == codes
        assert answer.usable == (not codes)
