"""The answer worked out: what is known of the map's walls or shown by them, and which directions are free."""

from __future__ import annotations

import math

import numpy as np
import pytest

from association import MapIndex
from association.consensus.estimation import EstimatedPose
from association.consensus.tuning import LEAST_KNOWN_VARIANCE
from association.rank_and_estimate import search_and_rank
from registration import RigidTransform, Segments
from registration.layout import Floats

from ..scenes import CORRIDOR, INSIDE, ROOM, context_of, index_of, local, maze, pose, same_pose, scan_of, seen

PLACE = pose(15.0, 14.0, 0.5)


def estimated(index: MapIndex, ends: Floats) -> EstimatedPose:
    answer = search_and_rank(context_of(index, scan_of(ends))).answer
    assert answer is not None
    return answer.estimated


def unknown(walls: Floats) -> MapIndex:
    """Index a map without a sigma."""
    return MapIndex.build(Segments.from_array(walls))


def off_by(walls: Floats, error: float, seed: int) -> Floats:
    """Move each wall across itself."""
    rng = np.random.default_rng(seed)
    d = walls[:, 2:] - walls[:, :2]
    n = np.stack([-d[:, 1], d[:, 0]], axis=1) / np.hypot(d[:, 0], d[:, 1])[:, None]
    return np.asarray(walls + np.tile(rng.normal(0.0, error, (len(walls), 1)) * n, 2))


@pytest.mark.parametrize(("sigma", "expected"), [(0.0, LEAST_KNOWN_VARIANCE**0.5), (0.05, 0.05), (0.1, 0.1)])
def test_what_the_map_says_of_its_walls_is_believed(sigma: float, expected: float) -> None:
    ends = seen(maze(1), PLACE, noise=0.02, seed=1, radius=9.0)[0]
    assert estimated(index_of(maze(1), sigma), ends).wall_sigma == pytest.approx(expected)


def test_what_it_does_not_say_is_estimated() -> None:
    """The worse the map is drawn the greater, and so the covariance."""
    ends = seen(maze(1), PLACE, noise=0.01, radius=9.0)[0]
    exact, off = (estimated(unknown(walls), ends) for walls in (maze(1), off_by(maze(1), 0.05, 2)))
    assert exact.wall_sigma < 0.02
    assert 0.03 < off.wall_sigma < 0.08
    assert np.trace(off.covariance[:2, :2]) > 5.0 * np.trace(exact.covariance[:2, :2])


def test_the_pose_is_of_the_index_frame() -> None:
    found = estimated(index_of(ROOM), seen(ROOM, INSIDE)[0])
    assert same_pose(found.pose, local(index_of(ROOM), INSIDE), 1e-9, 1e-9)
    np.testing.assert_array_equal(found.covariance, found.covariance.T)
    assert sorted(found.leverages["wall"].tolist()) == list(range(len(ROOM)))


@pytest.mark.parametrize("angle", [0.0, 1.0, math.pi / 2, 2.5, -2.5])
def test_walls_of_one_direction_are_parallel(angle: float) -> None:
    by = RigidTransform(3.0, 1.0, angle)
    ends = seen(CORRIDOR, pose(4.0, 0.8), noise=0.01)[0]
    found = estimated(index_of(by.apply(CORRIDOR.reshape(-1, 2, 2)).reshape(-1, 4)), ends)
    assert found.parallel
    assert found.direction[0] >= 0.0
    assert abs(found.direction[0] * math.sin(angle) - found.direction[1] * math.cos(angle)) < 0.01


def test_a_wall_across_makes_them_fixed() -> None:
    walls = np.vstack([CORRIDOR, [[30.0, 0.0, 30.0, 2.0]]])
    found = estimated(index_of(walls), seen(walls, pose(24.0, 0.8), noise=0.01)[0])
    assert not found.parallel
    assert found.weakest < 0.1


@pytest.mark.parametrize("sigma", [0.0, 0.1, 0.3])
def test_a_map_that_is_far_off_does_not_make_walls_parallel(sigma: float) -> None:
    """The angle information of a wall does not depend on its place."""
    assert not estimated(index_of(ROOM, sigma), seen(ROOM, INSIDE, noise=0.02, seed=1)[0]).parallel
