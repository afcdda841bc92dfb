"""From where the laser is to where the robot is."""

from __future__ import annotations

import math

import numpy as np
import pytest
from linefix_client import Pose, base_from_laser

import linefix
from registration import IDENTITY
from ros2 import messages
from ros2.frames import Frames, Mount
from ros2.looking import look_of
from ros2.odometry import OdometryHistory
from ros2.reporting import values_of
from ros2.searching import locate

ROOM = np.array([[0, 0, 6, 0], [6, 0, 6, 2], [6, 2, 4, 2], [4, 2, 4, 5], [4, 5, 0, 5], [0, 5, 0, 0]], dtype=float)
WALLS = linefix.Segments.from_array(ROOM)
SCANNER = linefix.simulation.Scanner(beams=720, sigma=0.01)
TRUTH = linefix.RigidTransform(1.0, 1.5, 0.4)  # of the laser
MOUNT = linefix.RigidTransform(0.3, -0.1, 2.0)


def seen(*, flipped: bool = False) -> messages.LaserScan:
    ranges = linefix.simulation.scan(WALLS, TRUTH, SCANNER, np.random.default_rng(3)).ranges
    first, step = SCANNER.angle_min, SCANNER.angle_increment
    if flipped:  # its own counter-clockwise is clockwise for anyone who looks from above
        first, ranges = -(first + 719 * step), ranges[::-1]
    return message(ranges.tolist(), first, step, range_max=30.0)


def message(ranges: list[float], first: float, step: float, *, range_max: float) -> messages.LaserScan:
    last = first + (len(ranges) - 1) * step
    return messages.LaserScan(
        angle_min=first, angle_max=last, angle_increment=step, range_min=0.05, range_max=range_max, ranges=ranges
    )


def located_in(walls: linefix.Segments, scan: messages.LaserScan, mount: Mount) -> linefix.AssociationResult:
    return locate(linefix.index_map(walls), [look_of(scan, mount, OdometryHistory(), IDENTITY, motion=True)])


@pytest.mark.parametrize("flipped", [False, True])
def test_the_robot_is_where_its_laser_is_not(flipped: bool) -> None:
    located = located_in(WALLS, seen(flipped=flipped), Mount(MOUNT, flipped))
    expected = TRUTH.compose(MOUNT.inverse())
    assert located.usable
    assert located.pose is not None
    assert math.hypot(located.pose.x - expected.x, located.pose.y - expected.y) < 0.02


def test_its_covariance_is_that_of_the_client() -> None:
    located = located_in(WALLS, seen(), Mount(MOUNT))
    alone = located_in(WALLS, seen(), Mount(IDENTITY))  # of the laser
    pose, covariance = alone.pose, alone.covariance
    assert pose is not None
    assert covariance is not None
    _, expected = base_from_laser(
        Pose(pose.x, pose.y, pose.theta), covariance.tolist(), Pose(MOUNT.x, MOUNT.y, MOUNT.theta)
    )
    assert located.covariance is not None
    assert not np.allclose(located.covariance, covariance, rtol=1e-3)
    np.testing.assert_allclose(located.covariance, np.array(expected), rtol=1e-9, atol=1e-15)


def test_a_scanner_upside_down_is_known_by_its_mount() -> None:
    mounts = Frames()
    assert mounts.mount("base_link", "laser", None) is None
    over = messages.Transform(messages.Vector3(0.3, -0.1, 0.5), messages.Quaternion(1.0, 0.0, 0.0, 0.0))
    told = messages.TransformStamped(messages.Header(frame_id="base_link"), "laser", over)
    assert mounts.take(messages.TFMessage([told]), static=True) == []
    found = mounts.mount("base_link", "/laser", None)
    assert found is not None
    assert found.flipped
    assert (found.base_from_laser.x, found.base_from_laser.y) == pytest.approx((0.3, -0.1))


def test_a_position_that_is_open_is_published_without_a_probability() -> None:
    corridor = linefix.Segments.from_array(np.array([[-40, 0, 40, 0], [40, 2, -40, 2]], dtype=float))
    at = linefix.RigidTransform(0.0, 0.8, 0.3)
    ranges = linefix.simulation.scan(corridor, at, SCANNER, np.random.default_rng(3)).ranges
    near = np.where(ranges < 10.0, ranges, np.inf).tolist()
    scan = message(near, SCANNER.angle_min, SCANNER.angle_increment, range_max=10.0)
    located = located_in(corridor, scan, Mount(MOUNT))
    values = values_of(located, 1.0)
    assert (values["status"], values["usable"], values["probability"]) == ("degenerate", "false", "")
