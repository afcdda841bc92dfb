"""Sets that fix no unique transform, and what is stated of them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from registration import MeasuredSegments, RegistrationOptions, RegistrationResult, RigidTransform, Segments, register
from registration.layout import Floats
from registration.options import Estimator

from .scenes import POSE, diagonal, difference, moved, pose_of, room, seen_from

ESTIMATORS = ("joint", "one_step")


def place_of(result: RegistrationResult) -> Floats:
    return np.array([pose_of(result).x, pose_of(result).y])


def corridor(theta: float = 0.0, length: float = 8.0) -> Segments:
    """Two walls 2 m apart that face each other, along `theta`."""
    walls = Segments.from_array([[0, -1, length, -1], [length, 1, 0, 1]])
    return moved(RigidTransform(0.0, 0.0, theta), walls)


@pytest.mark.parametrize("estimator", ESTIMATORS)
@given(st.floats(-3.0, 3.0), st.floats(-100.0, 100.0), st.floats(-100.0, 100.0))
@example(0.5 * math.pi, 1.0, 2.0)
@example(-0.5 * math.pi, 1.0, 2.0)
@settings(max_examples=25, deadline=None)
def test_a_corridor_leaves_its_own_direction_free(estimator: Estimator, theta: float, x: float, y: float) -> None:
    map_segments = corridor(theta)
    pose = RigidTransform(x, y, 0.4)
    scan = MeasuredSegments.from_segments(seen_from(pose, map_segments))
    result = register(map_segments, scan, diagonal(2), 0.0, RegistrationOptions(estimator))
    assert result.degenerate
    assert not result.usable
    assert result.covariance is None
    free = np.array(result.unobservable)
    assert np.linalg.norm(free) == pytest.approx(1.0)
    assert abs(free @ [math.cos(theta), math.sin(theta)]) == pytest.approx(1.0)
    assert free[0] > 0.0 or (abs(free[0]) < 1e-9 and free[1] > 0.0)
    # Across it is right, and along it stays where it is.
    np.testing.assert_allclose(result.offsets, 0.0, atol=1e-9)
    assert pose_of(result).theta == pytest.approx(0.4)
    assert free @ place_of(result) == pytest.approx(0.0, abs=1e-9)
    assert result.diagnostics.dof == 2
    assert result.diagnostics.reliability == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_one_pair_is_degenerate(estimator: Estimator) -> None:
    map_segments = corridor()
    scan = MeasuredSegments.from_segments(seen_from(POSE, map_segments))
    result = register(map_segments, scan, [[0, 0]], 0.0, RegistrationOptions(estimator))
    assert result.degenerate
    assert (result.diagnostics.pairs, result.diagnostics.dof) == (1, 0)
    np.testing.assert_allclose(result.offsets, 0.0, atol=1e-12)


@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_no_pair_has_no_pose(estimator: Estimator) -> None:
    map_segments = corridor()
    scan = MeasuredSegments.from_segments(map_segments, 0.0)
    options = RegistrationOptions(estimator, weights=[], evaluate_at=POSE)
    result = register(map_segments, scan, [], 0.0, options)
    assert result.degenerate
    assert not result.usable
    assert result.pose is None
    assert result.unobservable is None
    assert result.diagnostics.similarity is None
    assert result.diagnostics.ambiguity_at is not None
    assert result.diagnostics.ambiguity_at.total == 0.0
    assert len(result.offsets) == len(result.angles) == len(result.weights) == 0


def nearly_parallel(degrees: float, length: float = 4.0, sigma: float = 0.02) -> tuple[Segments, MeasuredSegments]:
    a = math.radians(degrees)
    ends = [[0, 0, length, 0], [length * math.cos(a), 5 + length * math.sin(a), 0, 5]]
    map_segments = Segments.from_array(ends)
    return map_segments, MeasuredSegments.from_segments(seen_from(POSE, map_segments), sigma)


@pytest.mark.parametrize(
    ("degrees", "lengths", "sigma", "degenerate", "dof"),
    [
        # An angle is known to 0.02 / sqrt(80 * 4^2 / 12) rad = 0.111 degrees, so a difference of two to 0.157, and
        # the place along the walls to 0.02 / (sqrt(160) sin 1 deg) = 0.09 m for 2 degrees.
        ([0, 180, 0], (4, 4, 4), 0.02, True, 4),
        ([0, 0.45], (4, 4), 0.02, True, 2),
        ([0, 0.45], (4, 4), 0.001, False, 1),
        ([0, 0.49], (4, 4), 0.02, True, 1),  # not parallel; it may slide by more than half a metre
        ([0, 0.49], (4, 4), 0.03, True, 2),
        ([0, 2], (4, 4), 0.02, False, 1),
        ([0, 10], (4, 4), 0.2, False, 1),
        ([0, 40], (4, 4), 2.0, True, 2),
        ([0, 90], (4, 4), 0.02, False, 1),
        # Long walls: the angle is seen, the slide along them is not.
        ([0, 0.15], (40, 40), 0.06, True, 1),
        # The deviations from the mean are 0, 0.4 and 0.4 degrees: 26 where noise stays below 11.8.
        ([0, 0.4, -0.4], (4, 4, 4), 0.02, True, 3),
        ([0, 0.25, -0.25], (4, 4, 4), 0.02, True, 4),
        # The angle of a piece of 0.4 m is known to 3.5 degrees.
        ([0, 0, 8], (4, 4, 0.4), 0.02, True, 4),
        ([0, 0, 16], (4, 4, 0.4), 0.02, False, 3),
    ],
)
def test_lines_are_parallel_within_three_standard_deviations(
    degrees: list[float], lengths: tuple[float, ...], sigma: float, degenerate: bool, dof: int
) -> None:
    """However the pairs are weighed; and where they are not, the pose is known to half a metre, or degenerate."""
    a, n = np.radians(degrees), len(degrees)
    begins = np.array([[0.0, 0.0], [5.0, 5.0], [-3.0, 8.0]])[:n]
    along = np.array(lengths)[:, None] * np.stack([np.cos(a), np.sin(a)], axis=1)
    segments = Segments.from_array(np.hstack([begins, begins + along]))
    scan = MeasuredSegments.from_segments(seen_from(POSE, segments), sigma)
    for options in (
        RegistrationOptions(),
        RegistrationOptions(weighting="uniform"),
        RegistrationOptions(weights=[1e9] * n),
        RegistrationOptions(weights=[1e-6, 2e-6, 1e-6][:n]),
    ):
        result = register(segments, scan, diagonal(n), 0.0, options)
        assert (result.degenerate, result.diagnostics.dof) == (degenerate, dof)
        assert (result.covariance is None) == degenerate
        if degenerate:
            assert abs(np.array(result.unobservable) @ [1.0, 0.0]) > 0.9


@pytest.mark.parametrize(("deviation", "degenerate"), [(0.49, False), (0.51, True)])
def test_half_a_metre_is_the_limit(deviation: float, degenerate: bool) -> None:
    """A cross of two walls, each of which alone says where it is across itself."""
    cross = Segments.from_array([[-50, 0, 50, 0], [0, -50, 0, 50]])
    scan = MeasuredSegments.from_segments(seen_from(POSE, cross), 4.0 * deviation, point_counts=[16.0, 16.0])
    result = register(cross, scan, diagonal(2))
    assert (result.degenerate, result.diagnostics.dof) == (degenerate, 1)


def test_a_degenerate_pose_moves_no_further_than_it_fits_by_the_noise_and_not_by_the_weights() -> None:
    """Parallel walls do say where it is, if not well: the pose stays within three standard deviations of that."""
    map_segments, scan = nearly_parallel(0.45)
    plain = register(map_segments, scan, diagonal(2))
    assert abs(np.array(plain.unobservable) @ [1.0, 0.0]) > 0.999
    assert plain.diagnostics.chi2 == pytest.approx(9.0, rel=1e-6)
    assert 0.0 < pose_of(plain).x < POSE.x
    heavy = register(map_segments, scan, diagonal(2), 0.0, RegistrationOptions(weights=[1e9, 1e9]))
    np.testing.assert_allclose(place_of(heavy), place_of(plain), atol=1e-9)
    # Long walls, whose angle is seen: the same three standard deviations.
    map_segments, _ = nearly_parallel(0.15, length=40.0)
    scan = MeasuredSegments.from_segments(seen_from(RigidTransform(30.0, 2.0, 0.4), map_segments), 0.06)
    result = register(map_segments, scan, diagonal(2))
    assert result.diagnostics.chi2 == pytest.approx(9.0, rel=1e-3)
    assert (result.degenerate, result.diagnostics.dof) == (True, 1)


def test_parallel_to_rounding_needs_no_noise_to_say_so() -> None:
    map_segments = corridor(0.7)
    scan = MeasuredSegments.from_segments(seen_from(POSE, map_segments), 0.0)
    result = register(map_segments, scan, diagonal(2), 0.0, RegistrationOptions(weighting="uniform"))
    assert (result.degenerate, result.diagnostics.dof) == (True, 2)
    assert result.unobservable == pytest.approx((math.cos(0.7), math.sin(0.7)))


def test_a_pair_of_weight_0_does_not_say_that_the_others_fix_the_pose() -> None:
    map_segments, _ = nearly_parallel(0.45)
    across = Segments.from_array(np.vstack([map_segments.endpoints, [1.0, 1.0, 1.0, 4.0]]))
    scan = MeasuredSegments.from_segments(seen_from(POSE, across), 0.02)
    weights = np.append(scan.point_counts[:2] / 0.02**2, 0.0)
    result = register(across, scan, diagonal(3), 0.0, RegistrationOptions(weights=weights))
    assert (result.degenerate, result.diagnostics.pairs, result.diagnostics.dof) == (True, 2, 2)


def test_one_step_loses_no_digits_to_walls_that_are_hardly_not_parallel() -> None:
    # In one pass the determinant, 3e-10 of the sums that it is the difference of, would cost half a micrometre.
    map_segments = moved(RigidTransform(0.0, 0.0, 0.7), nearly_parallel(0.001)[0])
    scan = MeasuredSegments.from_segments(seen_from(POSE, map_segments))
    result = register(map_segments, scan, diagonal(2), 0.0, RegistrationOptions("one_step"))
    np.testing.assert_allclose(place_of(result), [POSE.x, POSE.y], atol=1e-9)


def test_points_that_fix_no_rotation() -> None:
    # Two points, each on its own wall, say nothing of the angle where both lie in the corner.
    map_segments = Segments.from_array([[-1, 0, 1, 0], [0, -1, 0, 1]])
    scan = MeasuredSegments.from_segments(map_segments, 0.0, moments=(np.zeros((2, 2)), np.zeros(2)))
    result = register(map_segments, scan, diagonal(2), 0.0, RegistrationOptions(weighting="uniform"))
    assert result.degenerate
    assert result.unobservable is None
    assert result.diagnostics.dof == 1
    np.testing.assert_allclose(place_of(result), 0.0, atol=1e-12)


@pytest.mark.parametrize("reverse", [[0, 3, 4], [0]])
@pytest.mark.parametrize("estimator", ESTIMATORS)
@pytest.mark.parametrize("theta", [0.4, 2.0, -3.0])
def test_reversed_segments_are_turned_round_or_not_usable_where_directions_count(
    theta: float, estimator: Estimator, reverse: list[int]
) -> None:
    pose = RigidTransform(1.0, 2.0, theta)
    map_segments, scan = room(pose)
    ends = scan.segments.endpoints.copy()
    ends[reverse] = ends[reverse][:, [2, 3, 0, 1]]
    mixed = MeasuredSegments.from_segments(Segments.from_array(ends))
    assert not register(map_segments, mixed, diagonal(6), 0.0, RegistrationOptions(estimator)).usable
    result = register(map_segments, mixed, diagonal(6), 0.0, RegistrationOptions(estimator, oriented=False))
    assert result.usable
    np.testing.assert_allclose(difference(pose_of(result), pose), 0.0, atol=1e-12)
    np.testing.assert_allclose(result.angles, 0.0, atol=1e-12)


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
