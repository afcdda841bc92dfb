"""A robot that turns and drives while its scanner scans: every beam is taken to where the scanner then was."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import linefix
from registration import IDENTITY
from ros2 import messages
from ros2.frames import Frames, Mount
from ros2.looking import Look, look_of, looks_of, motion_of
from ros2.odometry import OdometryHistory, Speed
from ros2.options import NodeOptions
from ros2.topics import SENSOR, Publisher
from tests.association.scenes import known
from tests.linefix.moving import moving_ranges

from .robot import BASE_FROM_LASER, MAP_FROM_BASE, ROOM, WALLS, Robot, bridge, is_at_truth, laser_scan, mount, running

SCANNER = linefix.simulation.Scanner.over(1.5 * math.pi, 720, sigma=0.01)
SPEED = Speed(0.8, -0.1, 2.0)
BEAT = 0.1 / SCANNER.beams  # s from beam to beam
HALF = 50_000_000  # ns, of a scan


def robot_at(seconds: float) -> linefix.RigidTransform:
    """Return where the robot is so long after its first beam; worked out by many small steps."""
    at, steps = MAP_FROM_BASE, 1000
    for _ in range(steps):
        little = seconds / steps
        at = at.compose(linefix.RigidTransform(SPEED.vx * little, SPEED.vy * little, SPEED.omega * little))
    return at


def moving_scan(second: int, *, flipped: bool = False, speed: Speed = SPEED) -> messages.LaserScan:
    """Return what the scanner reads, each beam from where it is at that time; `flipped`: it hangs upside down."""
    angles, motion = (-1.0 if flipped else 1.0) * SCANNER.angles, linefix.Motion(BEAT, speed.vx, speed.vy, speed.omega)
    ranges = moving_ranges(WALLS, MAP_FROM_BASE, BASE_FROM_LASER, angles, motion, np.random.default_rng(second))
    return laser_scan(ranges, second + 5e-9, scanner=SCANNER, time_increment=BEAT, scan_time=0.1)


def odometry(second: int, nanosec: int = HALF, speed: Speed = SPEED) -> messages.Odometry:
    twist = messages.Twist(messages.Vector3(speed.vx, speed.vy), messages.Vector3(z=speed.omega))
    message = messages.Odometry(messages.Header(messages.Time(second, nanosec), "odom"), "base_link")
    message.twist.twist = twist
    return message


@pytest.mark.parametrize("motion", [True, False])
def test_a_turning_robot_is_where_it_was_at_the_first_beam(
    domain: int, room: linefix.MapIndex, map_file: str, motion: bool
) -> None:
    """A bridge that is not to reckon with motion does not know where it is."""
    broken, scan = odometry(1), moving_scan(10)
    broken.twist.twist.angular.z = math.inf
    with running(NodeOptions(domain=domain), room) if motion else bridge("--map", map_file, "--no-motion"):
        robot = Robot(domain)
        driven = Publisher(robot.net, "/odom", messages.Odometry, SENSOR)
        robot.mounts.publish(mount())
        robot.until(robot.diagnostics, lambda: driven.publish(broken), lambda one: "twist" in one.status[0].message)
        driven.publish(odometry(10))
        robot.until(
            robot.diagnostics,
            lambda: robot.scans.publish(scan),
            lambda one: one.header.stamp == scan.header.stamp and "no transform" not in one.status[0].message,
        )
        if motion:
            assert is_at_truth(robot.until(robot.poses, lambda: None))
        else:
            assert robot.poses.take() == []


def looked(scan: messages.LaserScan, *told: messages.Odometry, motion: bool = True) -> Look:
    """Return what is searched for a scan, given odometry."""
    where, driven = Frames(), OdometryHistory()
    where.take(
        messages.TFMessage([messages.TransformStamped(messages.Header(frame_id="base_link"), "laser")]), static=True
    )
    for one in told:
        driven.take(one)
    (look,), missing = looks_of([scan], where, NodeOptions(motion=motion), driven)
    assert missing == []
    return look


def timed(beams: int, time_increment: float, scan_time: float = 0.0) -> messages.LaserScan:
    header, last = messages.Header(messages.Time(10, 0), "laser"), (beams - 1) * 0.01
    return messages.LaserScan(header, 0.0, last, 0.01, time_increment, scan_time, 0.05, 30.0, [1.0] * beams)


def speed_during(scan: messages.LaserScan, *told: messages.Odometry) -> Speed | None:
    """Return how fast the laser, which is where the base is, is taken to have moved during a scan."""
    motion = looked(scan, *told).laser.motion
    return None if motion is None else Speed(motion.vx, motion.vy, motion.omega)


def test_the_twist_nearest_to_the_middle_of_the_scan_counts() -> None:
    scan = timed(100, 0.001)
    slow, fast = Speed(0.1, 0.0, 0.0), Speed(0.5, 0.0, 0.0)
    assert speed_during(scan) is None
    assert speed_during(scan, odometry(10, 0, slow), odometry(10, 90_000_000, fast)) == fast
    assert speed_during(scan, odometry(10, 20_000_000, slow), odometry(10, 90_000_000, fast)) == slow
    assert speed_during(scan, odometry(9, 860_000_000, slow)) == slow
    assert speed_during(scan, odometry(9, 840_000_000, slow)) is None  # said too long before
    assert speed_during(scan, odometry(10, 260_000_000, slow)) is None


def test_the_clock_that_goes_back_takes_twists_along() -> None:
    driven = OdometryHistory()
    driven.take(odometry(10, 0, Speed(0.1, 0.0, 0.0)))
    driven.take(odometry(5, 0, SPEED))
    assert driven.speed(5 * 10**9) == SPEED
    assert driven.speed(10 * 10**9) is None


@pytest.mark.parametrize("time_increment", [0.0, -0.001, math.nan, math.inf])
def test_a_scan_that_says_no_time_is_taken_at_once(time_increment: float) -> None:
    look = looked(timed(2, time_increment), odometry(10, 0))
    assert (look.time_increment, look.laser.motion, look.notes) == (0.0, None, {})
    assert look.view.motion is None


STILL = Speed(0.0, 0.0, 0.0)


def test_a_robot_that_stands_still_or_is_not_to_be_corrected_has_no_note() -> None:
    for look in (looked(timed(100, 0.001), odometry(10, HALF, STILL)), looked(timed(100, 0.001), motion=False)):
        assert look.notes == {}
        assert look.view.motion is None


def test_a_time_increment_in_another_unit_is_replaced_as_in_logs() -> None:
    look = looked(timed(100, 1.0, scan_time=0.1), odometry(10, HALF, SPEED))
    assert look.time_increment == pytest.approx(0.001)
    assert known(look.laser.motion).time_increment == pytest.approx(0.001)
    assert "100 s, expected at most 1.0 s; 0.1 s" in look.notes["time_increment"]


def test_a_scanner_s_way_is_that_of_the_robot_and_the_mount() -> None:
    motion = motion_of(0.02, Mount(BASE_FROM_LASER), SPEED)
    first = robot_at(0.0).compose(BASE_FROM_LASER)
    for k, place in enumerate(motion.places(5).tolist()):
        seen = first.inverse().compose(robot_at(0.02 * k).compose(BASE_FROM_LASER))
        assert place == pytest.approx([seen.x, seen.y, seen.theta], abs=1e-4)


def test_a_scanner_upside_down_moves_the_right_way_round() -> None:
    driven = OdometryHistory()
    driven.take(odometry(10))
    look = look_of(moving_scan(10, flipped=True), Mount(BASE_FROM_LASER, flipped=True), driven, IDENTITY, motion=True)
    found = linefix.locate(linefix.index_map(ROOM), linefix.assemble([look.view]))
    pose = known(found.pose)
    assert math.hypot(pose.x - MAP_FROM_BASE.x, pose.y - MAP_FROM_BASE.y) < 0.03
    assert abs(pose.theta - MAP_FROM_BASE.theta) < 0.02


def test_a_motion_that_is_not_known_is_published(domain: int, room: linefix.MapIndex) -> None:
    """The pose, too, with the rotation that the walls show, and a covariance in which the speed has its place."""
    with running(NodeOptions(agree=1, domain=domain), room):
        robot = Robot(domain)
        robot.mounts.publish(mount())
        scan = replace(moving_scan(10, speed=Speed(0.2, 0.0, 0.8)), header=messages.Header(messages.Time(10), "laser"))
        told = robot.until(
            robot.diagnostics,
            lambda: robot.scans.publish(scan),
            lambda one: "motion of the sensor" in one.status[0].message,
        )
        assert told.status[0].level == 1
        assert '"laser": By its time_increment of' in told.status[0].message
        found = robot.until(robot.poses, lambda: robot.scans.publish(scan))
    angle, turn = found.pose.pose.orientation, math.sqrt(found.pose.covariance[35])
    wrong = abs(2.0 * math.atan2(angle.z, angle.w) - MAP_FROM_BASE.theta)
    assert wrong < 2.0 * turn < 0.03
    assert math.sqrt(found.pose.covariance[0]) > 0.025
