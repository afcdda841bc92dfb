"""Scans of logs as they are mounted, upside down, and during which the robot moved."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import linefix
from formats import LoggedScan
from linefix import RigidTransform
from tests.association.scenes import known
from tests.linefix.moving import moving_ranges

ROOM = np.array([[0, 0, 7, 0], [7, 0, 7, 3], [7, 3, 4, 3], [4, 3, 4, 6], [4, 6, 0, 6], [0, 6, 0, 0]], dtype=float)
WALLS = linefix.Segments.from_array(ROOM)
BEAMS = 500
STEP = math.tau / BEAMS
ANGLES = np.linspace(-math.pi, math.pi, BEAMS, endpoint=False)
MOUNT = RigidTransform(0.25, -0.15, 1.1)
ROBOT = RigidTransform(2.2, 1.7, 0.6)
HERE = RigidTransform(0.0, 0.0, 0.0)
MOUNTS = MOUNT, RigidTransform(-0.4, 0.1, 3.0), RigidTransform(0.1, 0.2, -1.5)
RUNS = 100  # of a robot at different speeds
BOUND = 3.3 * math.sqrt(6.0 / RUNS)  # of the mean of chi-squares with three degrees of freedom, at 99.9 %


def seen(
    mount: RigidTransform, *, seconds: float = 0.0, twist: tuple[float, ...] = (0.0, 0.0, 0.0), seed: Any = 3
) -> np.ndarray:
    """Return ranges of a scanner on a robot that moves at a twist, the first beam from `ROBOT`."""
    motion = linefix.Motion(seconds / BEAMS, *twist)
    return moving_ranges(WALLS, ROBOT, mount, ANGLES, motion, np.random.default_rng(seed))


def logged(
    ranges: np.ndarray,
    *,
    flipped: bool = False,
    mount: RigidTransform | None = MOUNT,
    seconds: float = 0.0,
    motion: linefix.Motion | None = None,
) -> LoggedScan:
    """Return what a log has of ranges that are counter-clockwise as seen from above."""
    way = -1.0 if flipped else 1.0  # the same beams as the sensor names them: its own angles run the other way
    laser = linefix.LaserScan(-way * math.pi, way * STEP, ranges, motion=motion)
    return LoggedScan(0, "/scan", "laser", laser, seconds / BEAMS, None, "", mount, flipped, "base_link")


def off(answer: linefix.AssociationResult, truth: RigidTransform) -> tuple[float, float]:
    """Return by how much a pose is wrong, metres and radians."""
    step = truth.inverse().compose(known(answer.pose))
    return math.hypot(step.x, step.y), abs(step.theta)


@pytest.mark.parametrize("flipped", [False, True])
@pytest.mark.parametrize("mount", [MOUNT, None])
def test_the_loop_over_a_log_gives_poses_of_the_robot(mount: RigidTransform | None, flipped: bool) -> None:
    answer = linefix.locate(linefix.index_map(ROOM), logged(seen(MOUNT), mount=mount, flipped=flipped))
    assert answer.usable
    assert math.sqrt(known(answer.covariance)[2, 2]) < 0.005  # of a moment: nothing widens it
    metres, radians = off(answer, ROBOT.compose(HERE if mount else MOUNT))
    assert metres < 0.02
    assert radians < 0.005


def test_a_prior_is_of_the_robot() -> None:
    away = linefix.HardPrior(ROBOT.compose(RigidTransform(1.5, 0.0, 0.0)), 0.5, 0.5)
    near = linefix.HardPrior(ROBOT, 0.1, 0.1)
    scan = logged(seen(MOUNT))
    assert linefix.locate(ROOM, scan, prior=near).usable
    assert not linefix.locate(ROOM, scan, prior=away).usable


@pytest.mark.parametrize("flipped", [False, True])
def test_the_motion_of_the_sensor_counts(flipped: bool) -> None:
    twist = (0.4, 0.0, 1.2)  # of the robot
    ranges = seen(MOUNT, seconds=0.2, twist=twist)
    vx, vy = twist[0] - twist[2] * MOUNT.y, twist[2] * MOUNT.x
    c, s = math.cos(MOUNT.theta), math.sin(MOUNT.theta)
    side = -1.0 if flipped else 1.0
    motion = linefix.Motion(0.2 / BEAMS, c * vx + s * vy, side * (c * vy - s * vx), side * twist[2])
    answer = linefix.locate(ROOM, logged(ranges, flipped=flipped, seconds=0.2, motion=motion))
    metres, radians = off(answer, ROBOT)
    assert answer.usable
    assert metres < 0.02
    assert radians < 0.006


@pytest.mark.parametrize("twist", [(0.0, 0.0, 1.0), (0.5, 0.0, -1.0), (0.6, 0.0, 0.0), (0.0, 0.0, 0.0)])
def test_a_motion_that_is_not_known_widens_the_covariance(twist: tuple[float, float, float]) -> None:
    answer = linefix.locate(ROOM, logged(seen(MOUNT, seconds=0.1, twist=twist), seconds=0.1))
    metres, radians = off(answer, ROBOT)
    sigma = np.sqrt(np.diag(known(answer.covariance)))
    assert radians < 2.0 * sigma[2]
    assert metres < 2.0 * math.hypot(sigma[0], sigma[1])
    assert math.hypot(sigma[0], sigma[1]) > 0.5 * 0.1 * 0.5, "the speed is not known"
    assert sigma[2] < 0.01, "the walls show the rotation"
    rate = known(answer.diagnostics).turn_rate
    assert (0.0 if rate is None else rate) == pytest.approx(twist[2], abs=0.1)


def test_two_scanners_are_one_scan() -> None:
    rear, step = RigidTransform(-0.3, 0.1, 3.0), RigidTransform(0.2, 0.05, 0.1)
    then = logged(seen(step.compose(rear), seed=5), mount=rear)
    together = linefix.assemble([linefix.view_of(logged(seen(MOUNT))), linefix.view_of(then, step)])
    answer = linefix.locate(ROOM, together)
    assert answer.usable
    assert off(answer, ROBOT)[0] < 0.02


@pytest.mark.parametrize(
    ("seconds", "least"), [((0.1, 0.1, 0.1), 3.0 - BOUND), ((0.1, 0.05, 0.1), 0.5)], ids=["alike", "one of them faster"]
)
def test_scanners_of_one_robot_share_its_unknown_motion(seconds: tuple[float, ...], least: float) -> None:
    """Squared errors in units of the covariance have the mean 3, or less where the covariance is an upper bound."""
    rng, index = np.random.default_rng(8), linefix.index_map(ROOM)
    squares = []
    for _ in range(RUNS):
        twist = tuple(rng.normal(0.0, (0.5, 0.5, 1.0)).tolist())
        views = [
            linefix.view_of(logged(seen(mount, seconds=time, twist=twist, seed=rng), mount=mount, seconds=time))
            for mount, time in zip(MOUNTS, seconds, strict=True)
        ]
        answer = linefix.locate(index, linefix.assemble(views), prior=linefix.HardPrior(ROBOT, 0.5, 0.5))
        pose = known(answer.pose)
        error = np.array([pose.x - ROBOT.x, pose.y - ROBOT.y, pose.theta - ROBOT.theta])
        squares.append(float(error @ np.linalg.solve(known(answer.covariance), error)))
    assert least < np.mean(squares) < 3.0 + BOUND
