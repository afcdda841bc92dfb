"""From where the laser is to where the robot is."""

from __future__ import annotations

import numpy as np
import pytest
from linefix_client import Pose, base_from_laser

import linefix
from registration import IDENTITY
from ros2 import messages
from ros2.frames import Frames, Mount
from ros2.looking import look_of
from ros2.odometry import OdometryHistory
from ros2.reporting import values_of, verdict_of
from tests.association.scenes import known

from .robot import SCANNER, WALLS, laser_scan

TRUTH = linefix.RigidTransform(1.0, 1.5, 0.4)  # of the laser
MOUNT = linefix.RigidTransform(0.3, -0.1, 2.0)


def seen() -> messages.LaserScan:
    ranges = linefix.simulation.scan(WALLS, TRUTH, SCANNER, np.random.default_rng(3)).ranges
    return laser_scan(ranges, 0.0)


def located_in(walls: linefix.Segments, scan: messages.LaserScan, mount: Mount) -> linefix.AssociationResult:
    look = look_of(scan, mount, OdometryHistory(), IDENTITY, motion=True)
    return linefix.locate(linefix.index_map(walls), linefix.assemble([look.view]))


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
    found = known(mounts.mount("base_link", "/laser", None))
    assert found.flipped
    assert (found.base_from_laser.x, found.base_from_laser.y) == pytest.approx((0.3, -0.1))


def test_a_position_that_is_open_is_published_without_a_probability() -> None:
    corridor = linefix.Segments.from_array(np.array([[-40, 0, 40, 0], [40, 2, -40, 2]], dtype=float))
    at = linefix.RigidTransform(0.0, 0.8, 0.3)
    ranges = linefix.simulation.scan(corridor, at, SCANNER, np.random.default_rng(3)).ranges
    near = np.where(ranges < 10.0, ranges, np.inf).tolist()
    scan = laser_scan(near, 0.0, range_max=10.0)
    located = located_in(corridor, scan, Mount(MOUNT))
    values = values_of(located, 1.0)
    assert (values["status"], values["usable"], values["probability"]) == ("degenerate", "false", "")
    assert verdict_of(located)[1] == located.reasons[0].message
    far = located_in(corridor, laser_scan((1000.0 * ranges).tolist(), 0.0, range_max=10.0), Mount(MOUNT))
    assert "such as millimetres" in verdict_of(far)[1]
