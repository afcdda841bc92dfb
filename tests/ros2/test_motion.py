"""A robot that turns and drives while its scanner scans: every beam is taken to where the scanner then was."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest

import linefix
from ros2 import messages
from ros2.frames import Frames, Mount
from ros2.gathering import looks_of
from ros2.locating import Look, locate, motion_of, seconds_of
from ros2.odometry import OdometryHistory, Speed
from ros2.options import NodeOptions
from ros2.wire import SENSOR, Publisher

from .robot import BASE_FROM_LASER, MAP_FROM_BASE, ROOM, Robot, bridge, is_at_truth, mount

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


def moving_scan(second: int, *, flipped: bool = False) -> messages.LaserScan:
    """Return what the scanner reads, each beam from where it is at that time; `flipped`: it hangs upside down."""
    sign = -1.0 if flipped else 1.0
    walls, rng, ranges = linefix.Segments.from_array(ROOM), np.random.default_rng(second), []
    little = linefix.RigidTransform(SPEED.vx * BEAT, SPEED.vy * BEAT, SPEED.omega * BEAT)
    at = MAP_FROM_BASE
    for angle in SCANNER.angles.tolist():
        beam = linefix.simulation.Scanner(1, sign * angle, SCANNER.angle_increment, sigma=SCANNER.sigma)
        ranges.append(float(linefix.simulation.scan(walls, at.compose(BASE_FROM_LASER), beam, rng).ranges[0]))
        at = at.compose(little)
    return messages.LaserScan(
        messages.Header(messages.Time(second, 5), "laser"),
        SCANNER.angle_min, SCANNER.angle_min + 719 * SCANNER.angle_increment, SCANNER.angle_increment,
        time_increment=BEAT, scan_time=0.1, range_min=0.05, range_max=30.0, ranges=ranges,
    )  # fmt: skip


def odometry(second: int, nanosec: int = HALF, speed: Speed = SPEED) -> messages.Odometry:
    twist = messages.Twist(messages.Vector3(speed.vx, speed.vy), messages.Vector3(z=speed.omega))
    message = messages.Odometry(messages.Header(messages.Time(second, nanosec), "odom"), "base_link")
    message.twist.twist = twist
    return message


@pytest.mark.parametrize("arguments", [(), ("--no-motion",)], ids=["motion", "no motion"])
def test_a_turning_robot_is_where_it_was_at_the_first_beam(
    domain: int, map_file: str, arguments: Sequence[str]
) -> None:
    """A bridge that is not to reckon with motion does not know where it is."""
    broken, scan = odometry(1), moving_scan(10)
    broken.twist.twist.angular.z = math.inf
    with bridge("--map", map_file, *arguments):
        robot = Robot(domain)
        driven = Publisher(robot.net, "/odom", messages.Odometry, SENSOR)
        robot.mounts.publish(mount())
        robot.until(
            robot.diagnostics,
            lambda: driven.publish(broken),
            lambda one: "twist" in one.status[0].message,
        )
        driven.publish(odometry(10))
        robot.until(
            robot.diagnostics,
            lambda: robot.scans.publish(scan),
            lambda one: one.header.stamp == scan.header.stamp and "no transform" not in one.status[0].message,
        )
        found = robot.poses.take()
    assert bool(found) == (not arguments)
    assert all(is_at_truth(pose) for pose in found)


def looked(scan: messages.LaserScan, *told: messages.Odometry) -> Speed | None:
    """Return how fast the robot is taken to have moved during a scan."""
    where, driven = Frames(), OdometryHistory()
    where.take(mount(), static=True)
    for one in told:
        driven.take(one)
    looks, missing = looks_of([scan], where, NodeOptions(), driven)
    assert missing == []
    return looks[0].speed


def test_the_twist_nearest_to_the_middle_of_the_scan_counts() -> None:
    scan = messages.LaserScan(messages.Header(messages.Time(10, 0), "laser"), time_increment=0.001, ranges=[1.0] * 100)
    slow, fast = Speed(0.1, 0.0, 0.0), Speed(0.5, 0.0, 0.0)
    assert looked(scan) is None
    assert looked(scan, odometry(10, 0, slow), odometry(10, 90_000_000, fast)) == fast
    assert looked(scan, odometry(10, 20_000_000, slow), odometry(10, 90_000_000, fast)) == slow
    assert looked(scan, odometry(9, 860_000_000, slow)) == slow
    assert looked(scan, odometry(9, 840_000_000, slow)) is None  # said too long before
    assert looked(scan, odometry(10, 260_000_000, slow)) is None


def test_the_clock_that_goes_back_takes_twists_along() -> None:
    driven = OdometryHistory()
    driven.take(odometry(10, 0, Speed(0.1, 0.0, 0.0)))
    driven.take(odometry(5, 0, SPEED))
    assert driven.speed(5 * 10**9) == SPEED
    assert driven.speed(10 * 10**9) is None


@pytest.mark.parametrize("time_increment", [0.0, -0.001, math.nan, math.inf])
def test_a_scan_that_says_no_time_is_taken_at_once(time_increment: float) -> None:
    scan = messages.LaserScan(time_increment=time_increment, ranges=[1.0, 1.0])
    assert seconds_of(scan) == 0.0
    assert motion_of(scan, Mount(BASE_FROM_LASER), SPEED) is None


def test_a_scanner_on_a_turning_robot_moves_with_it() -> None:
    """Two metres to the left of the robot's middle, and looking back: there a turn to the left goes forward."""
    scan = messages.LaserScan(time_increment=0.25, ranges=[1.0, 1.0])
    aside = Mount(linefix.RigidTransform(0.0, 2.0, math.pi))
    motion = motion_of(scan, aside, Speed(1.0, 0.5, 0.25))
    assert motion is not None
    assert (motion.time_increment, motion.omega) == (0.25, 0.25)
    assert (motion.vx, motion.vy) == pytest.approx((-0.5, -0.5))


def test_a_scanner_s_way_is_that_of_the_robot_and_the_mount() -> None:
    beams = 5
    scan = messages.LaserScan(time_increment=0.02, ranges=[1.0] * beams)
    motion = motion_of(scan, Mount(BASE_FROM_LASER), SPEED)
    assert motion is not None
    first = robot_at(0.0).compose(BASE_FROM_LASER)
    for k, place in enumerate(motion.places(beams).tolist()):
        seen = first.inverse().compose(robot_at(0.02 * k).compose(BASE_FROM_LASER))
        assert place == pytest.approx([seen.x, seen.y, seen.theta], abs=1e-4)


def test_a_scanner_upside_down_moves_the_right_way_round() -> None:
    scan = moving_scan(10, flipped=True)
    located = locate(linefix.index_map(ROOM), [Look(scan, Mount(BASE_FROM_LASER, flipped=True), speed=SPEED)])
    assert located.answer.usable
    pose = located.pose
    assert pose is not None
    assert math.hypot(pose.x - MAP_FROM_BASE.x, pose.y - MAP_FROM_BASE.y) < 0.03
    assert abs(pose.theta - MAP_FROM_BASE.theta) < 0.02
