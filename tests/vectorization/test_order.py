"""Points that come more than once count once; points in no order are reported."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

import linefix
from linefix import RigidTransform, Segments
from simulation import Scanner, scan
from vectorization import vectorize
from vectorization.order import without_repeats

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
