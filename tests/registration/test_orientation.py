"""Segments that run the other way: turned round where directions mean nothing, and not usable where they count."""

from __future__ import annotations

import numpy as np
import pytest

from registration import (
    MeasuredSegments,
    RegistrationOptions,
    RigidTransform,
    Segments,
    register,
)
from registration.options import Estimator

from .scenes import (
    POSE,
    diagonal,
    difference,
    pose_of,
    room,
)

ESTIMATORS = ("joint", "one_step")


@pytest.mark.parametrize("estimator", ESTIMATORS)
@pytest.mark.parametrize("theta", [0.4, 2.0, -3.0])
def test_without_directions_segments_are_turned_round(theta: float, estimator: Estimator) -> None:
    pose = RigidTransform(1.0, 2.0, theta)
    map_segments, scan = room(pose)
    ends = scan.segments.endpoints.copy()
    ends[[0, 3, 4]] = ends[[0, 3, 4]][:, [2, 3, 0, 1]]
    mixed = MeasuredSegments.from_segments(Segments.from_array(ends))
    result = register(map_segments, mixed, diagonal(6), 0.0, RegistrationOptions(estimator, oriented=False))
    assert not result.degenerate
    np.testing.assert_allclose(difference(pose_of(result), pose), 0.0, atol=1e-12)
    np.testing.assert_allclose(result.angles, 0.0, atol=1e-12)


@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_a_segment_the_wrong_way_round_is_not_usable_where_directions_count(estimator: Estimator) -> None:
    map_segments, scan = room()
    assert register(map_segments, scan, diagonal(6), 0.0, RegistrationOptions(estimator)).usable
    ends = scan.segments.endpoints.copy()
    ends[0] = ends[0][[2, 3, 0, 1]]
    mixed = MeasuredSegments.from_segments(Segments.from_array(ends))
    assert not register(map_segments, mixed, diagonal(6), 0.0, RegistrationOptions(estimator)).usable
    assert register(map_segments, mixed, diagonal(6), 0.0, RegistrationOptions(estimator, oriented=False)).usable


def test_without_directions_a_corner_fits_both_ways() -> None:
    map_segments, scan = room()
    result = register(map_segments, scan, [[0, 0], [1, 1]], 0.0, RegistrationOptions(oriented=False))
    assert result.degenerate
    assert result.covariance is None
    assert result.unobservable is None
    np.testing.assert_allclose(difference(pose_of(result), POSE), 0.0, atol=1e-12)
    assert not register(map_segments, scan, [[0, 0], [1, 1]]).degenerate


@pytest.mark.parametrize(("deviations", "unique"), [(2.5, False), (3.5, True)])
def test_without_directions_the_half_turn_has_to_be_worse_by_three_deviations(deviations: float, unique: bool) -> None:
    """A cross, which the half turn takes to itself, and a wall that it takes so many standard deviations off."""
    ends = np.array([[-2, 0, 2, 0], [0, -2, 0, 2], [-1, 0.5 * deviations, 1, 0.5 * deviations]])
    map_segments = Segments.from_array(ends)
    scan = MeasuredSegments.from_segments(map_segments, 1.0, point_counts=[1e8, 1e8, 1.0])
    result = register(map_segments, scan, diagonal(3), 0.0, RegistrationOptions(oriented=False))
    assert result.degenerate is not unique
    # It is a question of noise, and not of how a caller weighs.
    heavy = RegistrationOptions(oriented=False, weights=100.0 * result.weights)
    assert register(map_segments, scan, diagonal(3), 0.0, heavy).degenerate is not unique
    exact = MeasuredSegments.from_segments(map_segments, 0.0)
    options = RegistrationOptions(oriented=False, weighting="uniform")
    assert not register(map_segments, exact, diagonal(3), 0.0, options).degenerate


def test_without_directions_the_rotation_is_that_of_the_pairs_that_count() -> None:
    map_segments, scan = room()
    wrong = [[i, j] for i in range(4) for j in range(4) if (i - j) % 2 == 1]  # a quarter turn off
    weights = [1.0] * 6 + [1e-9] * len(wrong)
    options = RegistrationOptions(oriented=False, weights=weights)
    result = register(map_segments, scan, [*diagonal(6).tolist(), *wrong], 0.0, options)
    np.testing.assert_allclose(difference(pose_of(result), POSE), 0.0, atol=1e-6)
