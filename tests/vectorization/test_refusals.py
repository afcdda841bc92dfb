from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from vectorization import InvalidOptionError, InvalidScanError, LaserScan, VectorizationOptions, vectorize


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
