"""Lines of a scan, with their gains and deviations."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from association import MapIndex, Scan, View, assemble
from association.scan.scan_lines import ScanLines, parts_of
from association.scan.tuning import COMMON_ERROR, GATE_SIGMAS
from association.tuning import (
    FREE_ANGLE,
    FREE_DISTANCE,
    GAIN,
    GAIN_LENGTH,
    GAIN_PER_METRE,
    MODEL_ANGLE,
    MODEL_OFFSET,
    ROUGHNESS,
)
from registration.layout import Floats, Records

from ..answers import ROOM_INDEX, SCAN
from ..scenes import INSIDE, beams_of, context_of, pose, scan_of


def test_the_longest_come_first_and_equal_ones_as_they_were_sent() -> None:
    ends = [[0, 7, 1, 7], [0, 0, 0, 3], [2, 0, 2, 1], [5, 5, 5, 8], [0, 0, 4, 0]]
    lines = context_of(ROOM_INDEX, scan_of(ends)).lines
    assert np.argsort(lines.row_of).tolist() == [4, 1, 3, 0, 2]
    assert lines.rows["length"].tolist() == [4.0, 3.0, 3.0, 1.0, 1.0]


def test_what_continues_or_repeats_another_is_one_line() -> None:
    """It comes where its whole length puts it, and is worth what it covers."""
    ends = [[0, 0, 4, 0], [9, 0, 9, 2], [9, 2, 9, 5], [3, 0, 4.5, 0], [20, 0, 20, 4.7], [9, 5.2, 9, 6.2]]
    lines = context_of(ROOM_INDEX, scan_of(ends)).lines
    assert lines.row_of.tolist() == [2, 0, 0, 2, 1, 0]
    np.testing.assert_allclose(lines.rows["length"], [6.2, 4.7, 4.5])
    gains = [GAIN + GAIN_PER_METRE * min(GAIN_LENGTH, covered) for covered in (6.0, 4.7, 4.5)]
    np.testing.assert_allclose(lines.rows["gain"], gains)
    np.testing.assert_allclose(lines.rows["later_gain"], [gains[1] + gains[2], gains[2], 0.0])
    np.testing.assert_allclose(lines.rows["plain_variance"][2], 0.02**2 / 90.0)  # what overlaps counts once


def test_a_scan_of_nothing_has_no_lines() -> None:
    lines = context_of(ROOM_INDEX, scan_of(np.zeros((0, 4)))).lines
    assert (len(lines.rows), len(lines.row_of)) == (0, 0)


def test_variances_are_those_of_the_sigmas_and_of_the_model() -> None:
    row = context_of(ROOM_INDEX, scan_of([[0, 0, 2, 0]], 0.05)).lines.rows[0]
    mean = 0.05**2 / 40.0  # of 40 points, one every 5 cm
    assert row["offset_variance"] == pytest.approx(mean + MODEL_OFFSET**2)
    assert row["angle_variance"] == pytest.approx(mean / (4.0 / 12.0) + MODEL_ANGLE**2)
    assert row["plain_variance"] == pytest.approx(mean)
    assert row["weight"] == pytest.approx(1.0 / (mean + ROUGHNESS**2))


def test_a_walls_own_error_is_the_maps_and_the_models() -> None:
    """Differences along a wall are in the weights of its lines; a wide tolerance means that walls are that far off."""
    exact = context_of(ROOM_INDEX, SCAN).lines.model[0]
    assert exact["wall_variance"] == pytest.approx(MODEL_OFFSET**2 - ROUGHNESS**2)
    assert (exact["free_distance"], exact["free_angle"]) == (FREE_DISTANCE, FREE_ANGLE)
    rough = MapIndex.build(ROOM_INDEX.segments, 0.3)
    assert context_of(rough, SCAN).lines.model["wall_variance"][0] - exact["wall_variance"] == pytest.approx(0.09)
    wide = context_of(ROOM_INDEX, SCAN, offset_tolerance=0.3).lines.model[0]
    assert wide["wall_variance"] == pytest.approx(0.01)


def test_with_raw_ranges_neighbouring_points_have_an_error_in_common() -> None:
    ends = SCAN.measured.segments.endpoints
    rough = scan_of(ends, viewpoint=(0.0, 0.0), beams=beams_of(ROOM_INDEX, INSIDE))
    without, with_ranges = (context_of(ROOM_INDEX, scan).lines.rows for scan in (scan_of(ends), rough))
    more = with_ranges["angle_variance"] - without["angle_variance"]
    np.testing.assert_allclose(more, COMMON_ERROR**2 / without["spread"])
    np.testing.assert_allclose(with_ranges["offset_variance"], without["offset_variance"])


def test_lines_on_a_map_that_is_farther_off_are_those_of_the_scan_as_if_made_anew() -> None:
    context = context_of(ROOM_INDEX, SCAN)
    given = context.lines.given
    assert given is not None
    again, anew = (ScanLines.of(SCAN, 0.05, context.options, parts) for parts in (given, None))
    assert again.given is given
    np.testing.assert_array_equal(again.rows, anew.rows)
    assert (again.rows["offset_variance"] > context.lines.rows["offset_variance"]).all()


def test_what_is_not_known_of_a_views_place_moves_its_lines_together() -> None:
    """How much the offset of a line at its middle changes with place and heading of its view is found by moving it."""
    ends = [[1.0, 1.0, 4.0, 1.2], [5.0, 0.0, 5.0, 3.7], [-2.0, -1.0, -2.0, 1.2], [0.0, 4.0, 1.5, 4.4]]
    seen, at = scan_of(ends).measured, pose(2.0, -1.0, 0.4)
    root = np.array([[0.05, 0.0, 0.0], [0.02, 0.08, 0.0], [-0.01, 0.015, 0.02]])

    def parts(moved: Floats) -> tuple[Records, Records]:
        x, y, theta = moved.tolist()
        there = pose(at.x + x, at.y + y, at.theta + theta)
        scan = assemble([View(Scan(seen)), View(Scan(seen), there, root @ root.T)])
        assert scan.views is not None
        _, lines, of_view = parts_of(scan.measured, scan.views)
        return lines[of_view == 1], lines[of_view == 0]

    lines, exact = parts(np.zeros(3))
    assert len(lines) == len(exact) > 3
    assert not exact["common_offset"].any()
    assert not exact["common_angle"].any()
    np.testing.assert_allclose(lines["common_angle"], (root @ root.T)[2, 2])
    changes = []
    for step in 1e-6 * np.eye(3):
        there, _ = parts(step)
        away = np.stack([there[name] - lines[name] for name in ("centroid_x", "centroid_y")], 1)
        changes.append((lines["dx"] * away[:, 1] - lines["dy"] * away[:, 0]) / 1e-6)
    by_root = np.stack(changes, 1) @ root
    np.testing.assert_allclose(lines["common_offset"], (by_root**2).sum(axis=1), rtol=1e-4)


@pytest.mark.parametrize(
    ("options", "offset", "angle"),
    [
        ({"offset_tolerance": 0.3}, 0.1, MODEL_ANGLE),
        ({"angle_tolerance": 0.3}, MODEL_OFFSET, 0.1),
        ({"offset_tolerance": 0.03, "angle_tolerance": 0.003}, MODEL_OFFSET, MODEL_ANGLE),
    ],
)
def test_a_wide_tolerance_says_that_the_map_is_that_far_off(
    options: dict[str, Any], offset: float, angle: float
) -> None:
    """It is three standard deviations; one that is narrower than the sigmas' own says nothing of them."""
    row = context_of(ROOM_INDEX, scan_of([[0, 0, 9, 0]], 1e-6), **options).lines.rows[0]
    assert math.sqrt(row["offset_variance"]) == pytest.approx(offset, rel=1e-3)
    assert math.sqrt(row["angle_variance"]) == pytest.approx(angle, rel=1e-3)
    angle_or_rough = max(ROUGHNESS**2, (options.get("angle_tolerance", 0.0) / GATE_SIGMAS) ** 2 * row["spread"])
    assert row["weight"] == pytest.approx(1.0 / angle_or_rough, rel=1e-3)


def test_scan_and_tables_are_derived_from_what_was_sent() -> None:
    lines = context_of(ROOM_INDEX, SCAN).lines
    rows, segments = lines.rows, SCAN.measured.segments.take(np.argsort(lines.row_of))
    np.testing.assert_allclose(np.stack([rows["x"], rows["y"]], axis=1), segments.midpoints)
    np.testing.assert_allclose(np.stack([rows["dx"], rows["dy"]], axis=1), segments.directions)
    np.testing.assert_allclose(rows["length"], segments.lengths)
    np.testing.assert_allclose(np.stack([rows["centroid_x"], rows["centroid_y"]], axis=1), segments.midpoints)
    np.testing.assert_allclose(rows["spread"], segments.lengths**2 / 12.0)
