import math
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.worlds import CONDITIONS, FAMILIES, Case, Stranger, draw_case
from benchmarks.worlds.cases import BEAMS, RANGE_MAX, _unmapped_part, _window_elsewhere
from benchmarks.worlds.places import distances
from registration import RigidTransform, Segments
from registration.layout import Floats
from simulation import Scanner, SimulationError, scan


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


@pytest.mark.parametrize("condition", CONDITIONS)
def test_every_condition_draws_the_same_twice_and_has_a_truth_where_it_says_so(condition: str) -> None:
    rule = CONDITIONS[condition]
    one, again = draw_case("offices", condition, 3), draw_case("offices", condition, 3)
    np.testing.assert_array_equal(one.ranges, again.ranges)
    np.testing.assert_array_equal(one.map.endpoints, again.map.endpoints)
    assert one.pose == again.pose
    assert (one.truth is None) == (rule.stranger is not None)
    assert (one.window is not None) == (rule.stranger is Stranger.WINDOW)
    assert one.ranges.shape == (BEAMS,)
    assert RANGE_MAX[0] <= one.scanner.range_max <= RANGE_MAX[1]
    assert not np.array_equal(one.ranges, draw_case("offices", condition, 4).ranges)


@pytest.mark.parametrize("world", FAMILIES)
def test_a_clean_scan_shows_the_map_from_its_truth(world: str) -> None:
    case = draw_case(world, "clean", 1)
    off = residuals(case)
    assert len(off) > 100
    assert np.abs(off).max() < 6.0 * case.scanner.sigma
    assert off.std() == pytest.approx(case.scanner.sigma, rel=0.25)


@pytest.mark.parametrize("world", ["school", "hotel"])
def test_a_changed_building_shows_most_of_the_map(world: str) -> None:
    rest = [residuals(draw_case(world, "changed", number)) for number in range(6)]
    share = np.mean([np.mean(np.abs(off) < 0.15) for off in rest])
    assert 0.6 < share < 0.999


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


def test_a_turning_laser_sweeps_more_or_less_than_it_says() -> None:
    # Seen by the angles that it really has, the scan shows the map; by those declared it does not.
    case = draw_case("museum", "turning", 2)
    spread = []
    for share in (0.975, 1.0, 1.025):
        scanner = replace(
            case.scanner,
            angle_min=share * case.scanner.angle_min,
            angle_increment=share * case.scanner.angle_increment,
        )
        spread.append(np.median(np.abs(residuals(replace(case, scanner=scanner)))))
    assert min(spread[0], spread[2]) < case.scanner.sigma
    assert min(spread[0], spread[2]) < 0.5 * spread[1]
    corrected = draw_case("museum", "turning_corrected", 2)
    assert np.abs(residuals(corrected)).max() < 6.0 * corrected.scanner.sigma
    assert abs(corrected.scanner.angle_increment) != pytest.approx(1.5 * math.pi / (BEAMS - 1), rel=0.01)


def test_a_wrong_step_is_wrong_by_half_a_percent() -> None:
    case = draw_case("museum", "wrong_step", 2)
    spread = [
        np.median(
            np.abs(
                residuals(
                    replace(case, scanner=replace(case.scanner, angle_increment=share * case.scanner.angle_increment))
                )
            )
        )
        for share in (0.995, 1.0, 1.005)
    ]
    assert min(spread[0], spread[2]) < 1.0 * case.scanner.sigma
    assert min(spread[0], spread[2]) < 0.8 * spread[1]


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


@pytest.mark.parametrize(("condition", "size"), [("scaled_1", 0.01), ("scaled_2", 0.02)])
def test_a_scaled_map_has_that_scale(condition: str, size: float) -> None:
    scales = set()
    for number in range(8):
        case = draw_case("offices", condition, number)
        ratio = case.map.lengths.sum() / case.scene.lengths.sum()
        assert abs(ratio - 1.0) == pytest.approx(size, rel=1e-6)
        scales.add(round(ratio, 6))
    assert len(scales) == 2


def test_a_sheared_map_has_other_angles() -> None:
    case = draw_case("offices", "sheared", 0)
    angles = [np.degrees(np.arctan2(*s.directions.T[::-1])) for s in (case.scene, case.map)]
    turns = (angles[1] - angles[0] + 180.0) % 360.0 - 180.0
    assert 0.3 < np.ptp(turns) < 1.5


@pytest.mark.parametrize(("condition", "share"), [("clutter_33", 0.33), ("clutter_66", 0.66)])
def test_so_many_beams_end_on_clutter(condition: str, share: float) -> None:
    for world in ("hospital", "mine", "warehouse"):
        case = draw_case(world, condition, 1)
        seen = scan(case.scene, case.pose, replace(case.scanner, sigma=0.0))
        assert np.mean(seen.hits >= len(case.map)) == pytest.approx(case.clutter, abs=0.01)
        assert case.clutter == pytest.approx(share, abs=0.03)


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


def test_strangers_maps_are_of_other_buildings() -> None:
    for number in range(5):
        sister = draw_case("warehouse", "sister", number)
        other = draw_case("warehouse", "other_type", number)
        for case in (sister, other):
            own, searched = (np.sort(s.lengths) for s in (case.scene, case.map))
            assert len(own) != len(searched) or not np.allclose(own, searched)
        # Racks of one owner have one depth; frames are drawn at it.
        depths = [np.round(s.lengths[s.lengths > 0.9], 6) for s in (sister.scene, sister.map)]
        assert set(depths[0].tolist()) & set(depths[1].tolist())


def test_a_mirrored_scan_is_the_scan_read_backwards() -> None:
    case = draw_case("hotel", "mirrored", 0)
    upright = scan(case.scene, case.pose, replace(case.scanner, sigma=0.0))
    turned = upright.ranges[::-1] if abs(case.scanner.angle_min) < 3.1 else np.roll(upright.ranges[::-1], 1)
    known = np.isfinite(case.ranges) & np.isfinite(turned)
    assert known.sum() > 100
    assert np.mean(np.abs(case.ranges - turned)[known] < 0.2) > 0.95
    assert np.mean(np.abs(case.ranges - upright.ranges)[known] < 0.2) < 0.6


def test_a_window_does_not_hold_the_truth() -> None:
    segments = Segments.from_array([[x, 0.0, x + 1.0, 0.0] for x in range(30)])
    rng = np.random.default_rng(0)
    for _ in range(50):
        truth = RigidTransform(rng.uniform(0, 30), 1.0, 0.0)
        window = _window_elsewhere(truth, segments, rng)
        assert window is not None
        away = math.hypot(window.pose.x - truth.x, window.pose.y - truth.y)
        assert away > window.radius
        assert distances(segments, window.pose.x, window.pose.y).min() < 1.5
    drawn = draw_case("offices", "window", 0).window
    assert drawn is not None
    assert 2.0 <= drawn.radius <= 6.0


@pytest.mark.parametrize(("world", "condition"), [("palace", "clean"), ("hotel", "raining")])
def test_unknown_names_are_refused(world: str, condition: str) -> None:
    with pytest.raises(SimulationError) as caught:
        draw_case(world, condition, 0)
    assert caught.value.argument == ("world" if world == "palace" else "condition")
