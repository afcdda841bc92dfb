"""The motion of a sensor during a scan, as the odometry of a log gives it."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from formats import LogOptions
from registration import RigidTransform

from .bags import FOUR_BEAMS, SECOND, UP, Robots, codes, fixed, read

BEGUN = 100 * SECOND


def turning(bag: Robots, *, rate: float, flip: bool = False) -> None:
    """A robot that turns and drives, at 0.5 rad/s and 0.4 m/s along its own x axis; a transform 1 / rate seconds."""
    for k in range(-10, 11):
        t = k / rate
        half, x, y = 0.25 * t, 0.8 * math.sin(0.5 * t), 0.8 * (1.0 - math.cos(0.5 * t))
        at = BEGUN + round(t * SECOND)
        bag.transform("/tf", at, "odom", "base_link", (x, y, 0.0), (0.0, 0.0, math.sin(half), math.cos(half)))
    bag.transform("/tf_static", 0, "base_link", "laser", (0.2, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0) if flip else UP)


@pytest.mark.parametrize("flip", [False, True])
def test_a_scan_that_takes_time_has_the_motion_of_its_sensor(tmp_path: Path, flip: bool) -> None:
    bag = Robots("mcap", tmp_path)
    turning(bag, rate=20.0, flip=flip)
    bag.scan(BEGUN)
    (scan,), log = read(bag)
    motion = scan.laser.motion
    assert motion is not None
    assert motion.time_increment == pytest.approx(0.001)
    # The sensor is 0.2 m ahead of the axis that the robot turns about; upside down, left is right.
    expected = (0.4, -0.1, -0.5) if flip else (0.4, 0.1, 0.5)
    assert (motion.vx, motion.vy, motion.omega) == pytest.approx(expected, abs=6e-3)
    assert "motion" not in codes(log)


def test_a_given_mount_says_how_the_sensor_moves(tmp_path: Path) -> None:
    bag = Robots("mcap", tmp_path)
    turning(bag, rate=20.0)
    bag.scan(BEGUN)
    (scan,), _ = read(bag, LogOptions(mount=RigidTransform(0.0, 0.3, math.pi / 2)))
    motion = scan.laser.motion
    assert motion is not None
    assert (motion.vx, motion.vy, motion.omega) == pytest.approx((0.0, -0.25, 0.5), abs=6e-3)


@pytest.mark.parametrize("rate", [0.5, 0.0])
def test_a_motion_that_odometry_does_not_say_is_not_known(tmp_path: Path, rate: float) -> None:
    bag = Robots("mcap", tmp_path)
    if rate:
        turning(bag, rate=rate)
    bag.scan(BEGUN)
    (scan,), log = read(bag)
    assert scan.laser.motion is None
    assert scan.time_increment == pytest.approx(0.001)
    assert codes(log)["motion"] == 1


def test_a_robot_that_stands_has_a_motion_of_zero(tmp_path: Path) -> None:
    bag = Robots("mcap", tmp_path)
    fixed(bag, "base_link", "laser")
    for k in range(4):
        bag.says(k * SECOND, 0.0)
    bag.scan(SECOND)
    (scan,), _ = read(bag)
    motion = scan.laser.motion
    assert motion is not None
    assert (motion.vx, motion.vy, motion.omega) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(("scan_time", "expected"), [(0.1, 0.025), (0.0, 0.05), (math.nan, 0.05), (30.0, 0.05)])
def test_a_time_increment_in_another_unit_is_replaced(tmp_path: Path, scan_time: float, expected: float) -> None:
    bag = Robots("mcap", tmp_path)
    bag.scan(1, laser=FOUR_BEAMS.but(ranges=(1.0,) * 4, time_increment=100.0, scan_time=scan_time))
    (scan,), log = read(bag)
    assert scan.time_increment == pytest.approx(expected)
    assert codes(log)["time_increment"] == 1
