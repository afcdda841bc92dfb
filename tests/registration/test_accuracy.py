"""Accuracy and covariance of the joint estimator."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest

from registration import (
    InvalidArgumentError,
    MeasuredSegments,
    RegistrationOptions,
    RegistrationResult,
    RigidTransform,
    Segments,
    register,
    register_estimating,
    wrap_angle,
)
from registration.layout import Floats
from registration.options import Weighting
from registration.wall_error import USUAL_WALL_ERROR

from .scenes import POSE, ROOM, diagonal, difference, fitted, pose_of, random_segments, scanned_points, seen_from

SIGMA = 0.02
COUNT = 25


def trials(
    n: int, *, segments: int = 8, origin: tuple[float, float] = (0.0, 0.0), options: RegistrationOptions | None = None
) -> Iterator[tuple[Floats, Floats, RegistrationResult]]:
    """Register n noisy scans of one scene; yield pose minus truth, the covariance and the result."""
    rng = np.random.default_rng(20191)
    map_segments = random_segments(rng, segments)
    pose = POSE.compose(RigidTransform(origin[0], origin[1], 0.0))
    options = options or RegistrationOptions()
    for _ in range(n):
        scan = fitted(scanned_points(rng, map_segments, pose, SIGMA, COUNT), SIGMA)
        result = register(map_segments, scan, diagonal(segments), 0.0, options)
        assert result.covariance is not None
        yield difference(pose_of(result), pose), result.covariance, result


@pytest.mark.parametrize("origin", [(0.0, 0.0), (50.0, 30.0)], ids=["inside", "58 m away"])
def test_covariance_and_chi2_are_honest_and_the_bound_is_reached(origin: tuple[float, float]) -> None:
    offs, costs, nees, usable = [], [], [], 0
    for off, covariance, result in trials(1000, origin=origin):
        offs.append(off)
        costs.append(result.diagnostics.chi2)
        nees.append(off @ np.linalg.solve(covariance, off))
        usable += result.usable
    assert 2.7 <= np.mean(nees) <= 3.3
    assert np.mean(costs) == pytest.approx(13.0, rel=0.05)
    assert usable > 0.995 * 1000
    # The Cramer-Rao bound is the inverse of the information of the raw points at the truth, which noise moves little.
    bound = np.sqrt(np.diag(covariance))
    rms = np.sqrt(np.mean(np.square(offs), axis=0))
    assert (rms <= 1.05 * bound).all()


@pytest.mark.parametrize("weighting", ["uniform", "shorter_length"])
def test_covariance_is_honest_whatever_the_weighting(weighting: Weighting) -> None:
    nees = []
    for off, covariance, _ in trials(600, options=RegistrationOptions(weighting=weighting)):
        nees.append(off @ np.linalg.solve(covariance, off))
    assert 2.7 <= np.mean(nees) <= 3.3


LIMIT = 7.815  # 95 % of chi-square of three


def polygon(walls: int) -> Segments:
    """Draw a room of so many walls, 4 m from its middle each."""
    angles = math.tau * np.arange(walls + 1) / walls
    corners = 4.0 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return Segments.from_array(np.hstack([corners[:-1], corners[1:]]))


def scan_of_walls_off(truth: Segments, off: float, rng: np.random.Generator) -> MeasuredSegments:
    """See a room whose walls stand that far off from where the map has them, with 1 cm of noise at 50 points each."""
    shifts = (rng.normal(0.0, off, len(truth)) + rng.normal(0.0, 0.01 / math.sqrt(50.0), len(truth)))[:, None]
    moved = truth.endpoints + np.tile(shifts * truth.normals, 2)
    seen = seen_from(POSE, Segments.from_array(moved))
    return MeasuredSegments.from_segments(seen, 0.01, np.full(len(truth), 50.0))


def normalised(estimating: bool, walls: int, off: float, draws: int = 400) -> np.ndarray:
    """Return the squared errors of the poses over what the covariance says, (draws,)."""
    rng, truth, out = np.random.default_rng(3), polygon(walls), []
    for _ in range(draws):
        scan = scan_of_walls_off(truth, off, rng)
        pairs = diagonal(walls)
        result = register_estimating(truth, scan, pairs) if estimating else register(truth, scan, pairs)
        assert result.pose is not None
        assert result.covariance is not None
        error = [result.pose.x - POSE.x, result.pose.y - POSE.y, wrap_angle(result.pose.theta - POSE.theta)]
        out.append(float(np.array(error) @ np.linalg.solve(result.covariance, error)))
    return np.array(out)


@pytest.mark.parametrize("walls", [6, 12])
@pytest.mark.parametrize("off", [0.01, 0.02, 0.05])
def test_the_ellipsoid_holds_walls_that_are_off(walls: int, off: float) -> None:
    inside = (normalised(True, walls, off) < LIMIT).mean()
    assert 0.85 <= inside <= 1.0
    assert (normalised(False, walls, off, 100) < LIMIT).mean() < 0.5


def test_on_an_exact_map_it_says_less_than_there_is_to_say_but_never_more() -> None:
    assert (normalised(True, 12, 0.0) < LIMIT).mean() > 0.97


def test_walls_that_fit_to_the_millimetre_are_taken_for_better_than_usual() -> None:
    truth = polygon(24)
    scan = scan_of_walls_off(truth, 0.0, np.random.default_rng(1))
    estimated = register_estimating(truth, scan, diagonal(24)).covariance
    usual = register(truth, scan, diagonal(24), USUAL_WALL_ERROR).covariance
    worse = register_estimating(truth, scan_of_walls_off(truth, 0.1, np.random.default_rng(1)), diagonal(24)).covariance
    assert estimated is not None
    assert usual is not None
    assert worse is not None
    assert 9.0 * np.trace(estimated) < 9.0 * np.trace(usual) < np.trace(worse)


def test_without_any_noise_declared_there_is_an_answer() -> None:
    room = Segments.from_array(ROOM)
    scan = MeasuredSegments.from_segments(seen_from(POSE, room), 0.0)
    with pytest.raises(InvalidArgumentError, match="sigma of scan and map are both 0"):
        register(room, scan, diagonal(6))
    result = register_estimating(room, scan, diagonal(6))
    assert result.usable
    assert result.pose is not None
    assert result.pose.x == pytest.approx(POSE.x, abs=1e-9)


def test_a_caller_s_own_weights_say_it_all() -> None:
    room = polygon(12)
    scan = scan_of_walls_off(room, 0.05, np.random.default_rng(2))
    options = RegistrationOptions(weights=np.arange(1.0, 13.0))
    estimated = register_estimating(room, scan, diagonal(12), options)
    exact = register(room, scan, diagonal(12), 0.0, options)
    assert estimated.pose == exact.pose
    np.testing.assert_array_equal(estimated.covariance, exact.covariance)


def test_parallel_walls_and_none() -> None:
    room = Segments.from_array([[0.0, 0.0, 8.0, 0.0], [8.0, 2.0, 0.0, 2.0]])
    scan = MeasuredSegments.from_segments(seen_from(POSE, room), 0.02)
    assert register_estimating(room, scan, diagonal(2)).degenerate
    nothing = register_estimating(room, scan, np.zeros((0, 2), dtype=np.intp))
    assert nothing.pose is None


def test_the_paper_s_estimator_is_answered_as_ever() -> None:
    room = Segments.from_array(ROOM)
    scan = MeasuredSegments.from_segments(seen_from(POSE, room), 0.02)
    options = RegistrationOptions("one_step", weighting="uniform")
    assert (
        register_estimating(room, scan, diagonal(6), options).pose
        == register(room, scan, diagonal(6), 0.0, options).pose
    )
    at = RigidTransform(1.0, 0.0, 0.0)
    assert register_estimating(room, scan, diagonal(6), RegistrationOptions(evaluate_at=at)).diagnostics.ambiguity_at
