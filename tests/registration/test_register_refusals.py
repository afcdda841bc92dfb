"""Input that `register` rejects, with the argument and the index at fault."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from registration import InvalidArgumentError, MeasuredSegments, RegistrationOptions, RigidTransform, Segments, register

from .scenes import ROOM, diagonal, room


@pytest.mark.parametrize(
    ("pairs", "index"),
    [
        ([[0, 0], [1, 6]], 1),
        ([[0, 0], [0, 0], [6, 1]], 2),
        ([[-1, 0]], 0),
        ([[0, 0], [0.5, 1]], 1),
        ([[0.0, 1.0]], None),
        ([[0, 1, 2]], None),
        ([0, 1], None),
        ([[0, 1], [2]], None),
        ([["0", "1"]], None),
        ([[True, False]], None),
        ([[float("nan"), 0]], 0),
        ([[2**70, 0]], None),
    ],
)
def test_bad_pairs_are_refused(pairs: Any, index: int | None) -> None:
    with pytest.raises(InvalidArgumentError) as caught:
        register(*room(), pairs)
    assert (caught.value.argument, caught.value.index) == ("correspondences", index)


def test_each_index_has_the_range_of_its_own_set() -> None:
    many = Segments.from_array(ROOM)
    few = many.take(np.arange(2))
    assert register(many, MeasuredSegments.from_segments(few), [[0, 4], [1, 5]]).diagnostics.pairs == 2
    assert register(few, MeasuredSegments.from_segments(many), [[4, 0], [5, 1]]).diagnostics.pairs == 2
    for map_segments, scan, pair in ((many, few, [2, 0]), (few, many, [0, 2])):
        with pytest.raises(InvalidArgumentError, match="from 0 to 1, found 2"):
            register(map_segments, MeasuredSegments.from_segments(scan), [pair])


@pytest.mark.parametrize(
    ("weights", "index"),
    [
        ([1, 1, -1, 1, 1, 1], 2),
        ([1, 1, 1, math.nan, 1, 1], 3),
        ([math.inf, 1, 1, 1, 1, 1], 0),
        ([1, 1e-300, 1, 1, 1, 1], 1),
        ([1, 1, 1, 1, 1, 1e300], 5),
        ([0, 0, 0, 0, 0, 0], None),
        ([1, 1, 1], None),
        (["1"] * 6, None),
        ([True] * 6, None),
        ([[1], [1, 2]], None),
    ],
)
def test_bad_weights_are_refused(weights: Any, index: int | None) -> None:
    with pytest.raises(InvalidArgumentError) as caught:
        register(*room(), diagonal(6), 0.0, RegistrationOptions(weights=weights))
    assert (caught.value.argument, caught.value.index) == ("weights", index)


@pytest.mark.parametrize("map_sigma", [-1.0, math.nan, math.inf, 1e4])
def test_bad_map_sigmas_are_refused(map_sigma: float) -> None:
    with pytest.raises(InvalidArgumentError) as caught:
        register(*room(), diagonal(6), map_sigma)
    assert caught.value.argument == "map.sigma"


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


@pytest.mark.parametrize(
    ("changes", "argument"),
    [
        ({"k_translation": -1.0}, "options.k_translation"),
        ({"k_rotation": math.nan}, "options.k_rotation"),
        ({"k_rotation": math.inf}, "options.k_rotation"),
        ({"estimator": "best"}, "options.estimator"),
        ({"rotation": "mean"}, "options.rotation"),
        ({"weighting": "length"}, "weighting"),
        ({"evaluate_at": RigidTransform(1e300, 0.0, 0.0)}, "options.evaluate_at"),
    ],
)
def test_bad_options_are_refused(changes: dict[str, Any], argument: str) -> None:
    with pytest.raises(InvalidArgumentError) as caught:
        RegistrationOptions(**changes)
    assert caught.value.argument == argument
