import math
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.worlds import FAMILIES, Case, draw_case, free_place
from benchmarks.worlds.buildings import Building
from benchmarks.worlds.buildings.plan import Plan
from benchmarks.worlds.buildings.shapes import box, crosses
from benchmarks.worlds.cases import _unmapped_part
from benchmarks.worlds.changes import clutter, with_doors
from benchmarks.worlds.conditions import RANGE_MAX
from benchmarks.worlds.places import distances
from registration import RigidTransform, Segments
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


# --- Doors and clutter ------------------------------------------------------------------------------------------------

AHEAD = Scanner(1, 0.0, 0.1, sigma=0.0, range_max=100.0)


def two_rooms() -> Building:
    """Two rooms of 4 m by 4 m, a doorway of 1 m between them at y = 1 to 2."""
    plan = Plan()
    plan.room(box(0.0, 0.0, 4.0, 4.0))
    plan.room(box(4.2, 0.0, 8.2, 4.0))
    plan.opening((4.0, 1.0), (4.0, 2.0), 0.2, door=True)
    return plan.building("two rooms")


def store(count: int = 40) -> Building:
    plan = Plan()
    plan.room(box(0.0, 0.0, 4.0 * count, 6.0))
    for k in range(count):
        plan.thing("box", box(4.0 * k + 1.0, 2.0, 4.0 * k + 2.0, 3.0))
    return plan.building("store")


def ahead(segments: Segments, x: float, y: float, theta: float) -> float:
    return float(scan(segments, RigidTransform(x, y, theta), AHEAD).ranges[0])


def test_a_shut_door_is_a_wall_and_an_open_one_stands_in_the_room() -> None:
    building = two_rooms()
    assert ahead(building.segments, 1.0, 1.5, 0.0) == pytest.approx(7.2)
    shut = with_doors(building, np.random.default_rng(0), shut=1.0)
    assert shut.kinds == ("door",)
    assert ahead(shut.segments, 1.0, 1.5, 0.0) == pytest.approx(3.0)
    assert ahead(shut.segments, 6.0, 1.5, math.pi) == pytest.approx(6.0 - 4.04)
    opened = with_doors(building, np.random.default_rng(0), shut=0.0)
    # The hinge is at (4, 1); the leaf swings to the left of the way from there to (4, 2): to smaller x.
    assert ahead(opened.segments, 1.0, 1.9, 0.0) == pytest.approx(7.2)
    assert ahead(opened.segments, 3.5, 3.5, -0.5 * math.pi) == pytest.approx(2.5, abs=0.35)


@pytest.mark.parametrize("share", [0.33, 0.66])
@pytest.mark.parametrize("name", ["hotel", "garage", "facades"])
def test_clutter_takes_the_share_of_beams_that_was_asked_for(name: str, share: float) -> None:
    rng = np.random.default_rng(4)
    segments = FAMILIES[name].draw(rng).build(rng).segments
    scanner = Scanner.over(1.5 * math.pi, 720, range_max=25.0, sigma=0.0)
    for _ in range(8):
        pose = free_place(segments, rng, clearance=0.9)
        placed = clutter(segments, pose, scanner, share, rng)
        assert placed is not None
        outlines, reached = placed
        seen = scan(Segments.from_array(np.vstack([segments.endpoints, outlines])), pose, scanner)
        assert reached == pytest.approx(np.mean(seen.hits >= len(segments)), abs=1e-9)
        assert reached == pytest.approx(share, abs=0.03)
        assert seen.facing[seen.hits >= 0].all()
        assert not crosses(outlines, segments.endpoints)
