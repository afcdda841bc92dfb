import math
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.worlds import FAMILIES, Case, draw_case
from benchmarks.worlds.cases import _unmapped_part
from benchmarks.worlds.conditions import RANGE_MAX
from benchmarks.worlds.places import distances
from registration.layout import Floats
from simulation import Scanner, scan


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


@pytest.mark.parametrize(
    ("condition", "low", "high"),
    [("walls_5mm", 0.0, 0.03), ("walls_2cm", 0.01, 0.08), ("walls_5cm", 0.02, 0.2), ("cut", 0.01, 0.08)],
)
def test_maps_are_off_by_as_much_as_they_are_called(condition: str, low: float, high: float) -> None:
    cases = [without_noise(draw_case("museum", condition, number)) for number in range(8)]
    medians = [np.median(np.abs(residuals(case))) for case in cases]
    assert low < np.mean(medians) < high


def without_noise(case: Case) -> Case:
    """The same scan as a scanner without noise would have taken it."""
    quiet = scan(case.scene, case.pose, replace(case.scanner, sigma=0.0))
    return replace(case, ranges=quiet.ranges)


@pytest.mark.parametrize("world", FAMILIES)
def test_a_scan_of_the_unmapped_part_shows_nothing_of_the_map(world: str) -> None:
    rng = np.random.default_rng(7)
    style = FAMILIES[world].draw(rng)
    for _ in range(20):
        building = style.build(rng).segments
        pose, part = _unmapped_part(building, building, rng)
        if part is not None:
            break
    assert part is not None
    assert 0.3 <= part.lengths.sum() / building.lengths.sum() <= 0.9
    seen = scan(building, pose, Scanner.over(math.tau, 720, range_max=RANGE_MAX[1], sigma=0.0))
    points = pose.apply(seen.points)
    assert min(distances(part, x, y).min() for x, y in points) > 0.45
    assert distances(part, pose.x, pose.y).min() > 0.45
    case = draw_case(world, "unmapped", 0)
    assert case.truth is None
    assert case.map.lengths.sum() < 0.95 * case.scene.lengths.sum()


def test_a_mirrored_scan_is_the_scan_read_backwards() -> None:
    case = draw_case("hotel", "mirrored", 0)
    upright = scan(case.scene, case.pose, replace(case.scanner, sigma=0.0))
    turned = upright.ranges[::-1] if abs(case.scanner.angle_min) < 3.1 else np.roll(upright.ranges[::-1], 1)
    known = np.isfinite(case.ranges) & np.isfinite(turned)
    assert known.sum() > 100
    assert np.mean(np.abs(case.ranges - turned)[known] < 0.2) > 0.95
    assert np.mean(np.abs(case.ranges - upright.ranges)[known] < 0.2) < 0.6
