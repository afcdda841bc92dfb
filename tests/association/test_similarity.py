"""Where a map is off by a factor the pose is where the map has it, the covariance says so, and a warning tells it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from association import AssociationResult, MapIndex, Scan
from registration import RigidTransform, Segments
from registration.layout import Floats
from registration.options import Estimator

from .scenes import answer_of, index_of, maze, pose, pose_in, same_pose, scan_of, seen
from .test_settling import off_by

WALLS = maze(1)
AT = pose(15.0, 14.0, 0.5)


def at_scale(factor: float, at: RigidTransform = AT) -> RigidTransform:
    """Return a place where a map has it that is too large by a factor."""
    return pose(factor * at.x, factor * at.y, at.theta)


def answer(walls: Floats, seed: int = 1, estimator: Estimator = "joint") -> AssociationResult:
    return answer_of(
        index_of(walls), scan_of(seen(WALLS, AT, noise=0.01, seed=seed, radius=12.0)[0]), estimator=estimator
    )


def told(result: AssociationResult) -> list[str]:
    return [warning.message for warning in result.warnings if warning.code == "scale"]


def squared_error(result: AssociationResult, truth: RigidTransform) -> float:
    found = pose_in(result)
    error = np.array([found.x - truth.x, found.y - truth.y, math.remainder(found.theta - truth.theta, math.tau)])
    assert result.covariance is not None
    return float(error @ np.linalg.solve(result.covariance, error))


@pytest.mark.parametrize("factor", [0.98, 0.99, 1.01, 1.02])
def test_the_pose_is_where_the_map_has_it(factor: float) -> None:
    """Its covariance holds: 3 is the mean, 16.3 the quantile of .1 %."""
    for seed in range(6):
        found = answer(factor * WALLS, seed)
        assert found.usable
        assert same_pose(pose_in(found), at_scale(factor), 0.03, 0.01)
        assert squared_error(found, at_scale(factor)) < 16.3


@pytest.mark.parametrize("factor", [0.99, 1.02])
def test_the_factor_is_told(factor: float) -> None:
    [message] = told(answer(factor * WALLS))
    assert float(message.split(" times ")[1].split(" ")[0]) == pytest.approx(factor, abs=0.002)


@pytest.mark.parametrize("factor", [1.0, 1.003])
def test_maps_to_scale_are_told_nothing_of(factor: float) -> None:
    assert told(answer(factor * WALLS)) == []


@pytest.mark.parametrize("seed", range(10))
def test_walls_that_are_off_one_by_one_are_no_factor(seed: int) -> None:
    assert told(answer(off_by(WALLS, 0.05, seed), seed)) == []


def test_the_papers_estimator_has_no_factor() -> None:
    assert told(answer(1.02 * WALLS, estimator="one_step")) == []


def test_where_the_sensor_sits_on_the_robot_is_not_stretched() -> None:
    """The same scan in the frame of a robot whose sensor is 3 m from its middle."""
    mount = pose(3.0, -0.5, 0.3)
    ends = seen(WALLS, AT, noise=0.01, seed=1, radius=12.0)[0]
    index = MapIndex.build(Segments.from_array(1.02 * WALLS), oriented=False)
    alone = pose_in(answer_of(index, scan_of(ends, viewpoint=(0.0, 0.0)), oriented=False))
    moved = mount.apply(ends.reshape(-1, 2, 2)).reshape(-1, 4)
    scan: Scan = scan_of(moved, viewpoint=(mount.x, mount.y))
    robot = pose_in(answer_of(index, scan, oriented=False))
    assert same_pose(robot.compose(mount), alone, 1e-3, 1e-4)


def test_residuals_are_those_of_the_scan_to_scale() -> None:
    """Every wall is matched, and none is off by more than noise."""
    found = answer(1.02 * WALLS)
    scan = seen(WALLS, AT, noise=0.01, seed=1, radius=12.0)[0]
    at, where = pose_in(found), float(told(found)[0].split(" times ")[1].split(" ")[0])
    assert len(found.correspondences) == len(scan)
    for one in found.correspondences:
        begin, end = (1.02 * WALLS[one.map]).reshape(2, 2)
        d = (end - begin) / np.hypot(*(end - begin))
        middle = at.apply(where * scan[one.scan].reshape(2, 2)).mean(axis=0)
        off = float(d[0] * (middle - begin)[1] - d[1] * (middle - begin)[0])
        assert max(abs(off), abs(one.offset)) < 0.06
