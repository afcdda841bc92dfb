"""Values that are rejected, with the argument and the index at fault."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from registration import (
    InvalidArgumentError,
    InvalidSegmentsError,
    MeasuredSegments,
    RegistrationError,
    RegistrationOptions,
    RigidTransform,
    Segments,
    register,
)

from .scenes import ROOM, diagonal, room

Call = Callable[[], object]


def pairs(of: Any) -> Call:
    return lambda: register(*room(), of)


def weights(of: Any) -> Call:
    return lambda: register(*room(), diagonal(6), 0.0, RegistrationOptions(weights=of))


def map_sigma(of: float) -> Call:
    return lambda: register(*room(), diagonal(6), of)


def options(**of: Any) -> Call:
    return lambda: RegistrationOptions(**of)


def measured(**of: Any) -> Call:
    return lambda: MeasuredSegments.from_segments(Segments.from_array([[0, 0, 1, 0], [0, 0, 0, 1]]), **of)


def segments(of: Any) -> Call:
    return lambda: Segments.from_array(of, argument="map.segments")


@pytest.mark.parametrize(
    ("argument", "index", "call"),
    [
        ("correspondences", 1, pairs([[0, 0], [1, 6]])),
        ("correspondences", 2, pairs([[0, 0], [0, 0], [6, 1]])),
        ("correspondences", 0, pairs([[-1, 0]])),
        ("correspondences", 1, pairs([[0, 0], [0.5, 1]])),
        ("correspondences", None, pairs([[0.0, 1.0]])),
        ("correspondences", None, pairs([[0, 1, 2]])),
        ("correspondences", None, pairs([0, 1])),
        ("correspondences", None, pairs([[0, 1], [2]])),
        ("correspondences", None, pairs([["0", "1"]])),
        ("correspondences", None, pairs([[True, False]])),
        ("correspondences", 0, pairs([[float("nan"), 0]])),
        ("correspondences", None, pairs([[2**70, 0]])),
        ("weights", 2, weights([1, 1, -1, 1, 1, 1])),
        ("weights", 3, weights([1, 1, 1, math.nan, 1, 1])),
        ("weights", 0, weights([math.inf, 1, 1, 1, 1, 1])),
        ("weights", 1, weights([1, 1e-300, 1, 1, 1, 1])),
        ("weights", 5, weights([1, 1, 1, 1, 1, 1e300])),
        ("weights", None, weights([0, 0, 0, 0, 0, 0])),
        ("weights", None, weights([1, 1, 1])),
        ("weights", None, weights(["1"] * 6)),
        ("weights", None, weights([True] * 6)),
        ("weights", None, weights([[1], [1, 2]])),
        ("map.sigma", None, map_sigma(-1.0)),
        ("map.sigma", None, map_sigma(math.nan)),
        ("map.sigma", None, map_sigma(math.inf)),
        ("map.sigma", None, map_sigma(1e4)),
        ("options.k_translation", None, options(k_translation=-1.0)),
        ("options.k_rotation", None, options(k_rotation=math.nan)),
        ("options.k_rotation", None, options(k_rotation=math.inf)),
        ("options.estimator", None, options(estimator="best")),
        ("options.rotation", None, options(rotation="mean")),
        ("weighting", None, options(weighting="length")),
        ("options.evaluate_at", None, options(evaluate_at=RigidTransform(1e300, 0.0, 0.0))),
        ("scan.sigma", 0, measured(sigma=-0.1)),
        ("scan.sigma", 1, measured(sigma=[0.1, math.nan])),
        ("scan.sigma", None, measured(sigma=[0.1])),
        ("scan.point_counts", 1, measured(point_counts=[5, 0])),
        ("scan.point_counts", 0, measured(point_counts=[0.6, 1])),
        ("scan.centroids", 1, measured(moments=([[0, 0], [0, math.inf]], [1, 1]))),
        ("scan.spreads", 0, measured(moments=([[0, 0], [0, 0]], [-1, 1]))),
        ("map.segments", None, segments([[0, 0, 1]])),
        ("map.segments", None, segments([1, 2, 3, 4])),
        ("map.segments", None, segments([["0", "0", "1", "0"]])),
        ("map.segments", None, segments([[0, 0, 1, 0], [1]])),
    ],
)
def test_the_argument_and_the_index_at_fault_are_named(argument: str, index: int | None, call: Call) -> None:
    with pytest.raises(InvalidArgumentError) as caught:
        call()
    assert (caught.value.argument, caught.value.index) == (argument, index)


@pytest.mark.parametrize(
    ("row", "says"),
    [
        ([0, 0, math.nan, 0], "not finite"),
        ([0, 0, math.inf, 0], "not finite"),
        ([2e9, 0, 2e9, 1], "beyond"),
        ([0, 0, 1e-7, 0], "shorter"),
        ([1, 1, 1, 1], "shorter"),
        ([0, 0, 2e4, 0], "longer"),
    ],
)
def test_bad_segments_are_refused_by_index(row: list[float], says: str) -> None:
    with pytest.raises(InvalidSegmentsError, match=says) as caught:
        segments(np.array([[0, 0, 1, 0], row]))()
    assert (caught.value.argument, caught.value.index) == ("map.segments", 1)
    assert isinstance(caught.value, RegistrationError)


def test_each_index_has_the_range_of_its_own_set() -> None:
    many = Segments.from_array(ROOM)
    few = many.take(np.arange(2))
    assert register(many, MeasuredSegments.from_segments(few), [[0, 4], [1, 5]]).diagnostics.pairs == 2
    assert register(few, MeasuredSegments.from_segments(many), [[4, 0], [5, 1]]).diagnostics.pairs == 2
    for map_segments, scan, pair in ((many, few, [2, 0]), (few, many, [0, 2])):
        with pytest.raises(InvalidArgumentError, match="from 0 to 1, found 2"):
            register(map_segments, MeasuredSegments.from_segments(scan), [pair])


def test_information_without_noise_is_refused() -> None:
    map_segments, scan = room(sigma=0.0)
    with pytest.raises(InvalidArgumentError) as caught:
        register(map_segments, scan, diagonal(6))
    assert caught.value.argument == "scan.sigma"
    with_little = MeasuredSegments.from_segments(scan.segments, 1e-200)
    np.testing.assert_allclose(register(map_segments, with_little, diagonal(6)).weights, 1e24 * scan.point_counts)
    little = register(map_segments, scan, diagonal(6), 1e-200)
    np.testing.assert_allclose(little.weights, 1e24)
    assert register(map_segments, scan, diagonal(6), 0.01).usable
    assert register(map_segments, scan, diagonal(6), 0.0, RegistrationOptions(weighting="uniform")).usable
