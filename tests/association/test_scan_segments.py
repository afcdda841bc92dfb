"""What a scan's segments are worth and how far they are to be trusted."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from association.tuning import COMMON_ERROR, MODEL_ANGLE, MODEL_OFFSET

from .answers import ROOM_INDEX, SCAN
from .scenes import INSIDE, beams_of, context_of, scan_of


def test_the_longest_come_first_and_equal_ones_as_they_were_sent() -> None:
    ends = [[0, 0, 1, 0], [0, 0, 0, 3], [2, 0, 2, 1], [5, 5, 5, 8], [0, 0, 4, 0]]
    assert context_of(ROOM_INDEX, scan_of(ends)).segments.order.tolist() == [4, 1, 3, 0, 2]


def test_variances_are_those_of_the_sigmas_and_of_the_model() -> None:
    row = context_of(ROOM_INDEX, scan_of([[0, 0, 2, 0]], 0.05)).segments.rows[0]
    mean = 0.05**2 / 40.0  # of 40 points, one every 5 cm
    assert row["offset_variance"] == pytest.approx(mean + MODEL_OFFSET**2)
    assert row["angle_variance"] == pytest.approx(mean / (4.0 / 12.0) + MODEL_ANGLE**2)
    assert row["plain_variance"] == pytest.approx(mean)


def test_with_raw_ranges_neighbouring_points_have_an_error_in_common() -> None:
    ends = SCAN.measured.segments.endpoints
    rough = scan_of(ends, viewpoint=(0.0, 0.0), beams=beams_of(ROOM_INDEX, INSIDE))
    without, with_ranges = (context_of(ROOM_INDEX, scan).segments.rows for scan in (scan_of(ends), rough))
    more = with_ranges["angle_variance"] - without["angle_variance"]
    np.testing.assert_allclose(more, COMMON_ERROR**2 / without["spread"])
    np.testing.assert_allclose(with_ranges["offset_variance"], without["offset_variance"])


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
    row = context_of(ROOM_INDEX, scan_of([[0, 0, 9, 0]], 1e-6), **options).segments.rows[0]
    assert math.sqrt(row["offset_variance"]) == pytest.approx(offset, rel=1e-3)
    assert math.sqrt(row["angle_variance"]) == pytest.approx(angle, rel=1e-3)
    assert row["weight"] == pytest.approx(1.0 / row["offset_variance"])


def test_scan_and_tables_are_derived_from_what_was_sent() -> None:
    rows, order = context_of(ROOM_INDEX, SCAN).segments.rows, context_of(ROOM_INDEX, SCAN).segments.order
    segments = SCAN.measured.segments.take(order)
    np.testing.assert_allclose(np.stack([rows["x"], rows["y"]], axis=1), segments.midpoints)
    np.testing.assert_allclose(np.stack([rows["dx"], rows["dy"]], axis=1), segments.directions)
    np.testing.assert_allclose(rows["length"], segments.lengths)
    np.testing.assert_allclose(np.stack([rows["centroid_x"], rows["centroid_y"]], axis=1), segments.midpoints)
    np.testing.assert_allclose(rows["spread"], segments.lengths**2 / 12.0)
