"""Several scanners are one scan, and odometry says how the robot moved between them."""

from __future__ import annotations

import math
from typing import Any

import pytest

import linefix
from ros2 import messages
from ros2.frames import Frames
from ros2.looking import Gathering, looks_of
from ros2.odometry import OdometryHistory
from ros2.options import NodeOptions
from ros2.topics import SENSOR, Publisher
from tests.association.scenes import known

from .robot import MAP_FROM_BASE, ROOM, Robot, bridge, is_at_truth, odometry_at, quaternion, scan_from

HERE = linefix.RigidTransform(0.0, 0.0, 0.0)
FRONT, BACK = linefix.RigidTransform(0.3, 0.1, 0.0), linefix.RigidTransform(-0.3, -0.1, math.pi)
NARROW = linefix.simulation.Scanner(beams=200, angle_min=-0.7, angle_increment=0.007, sigma=0.01)
DRIVEN = linefix.RigidTransform(0.25, 0.02, 0.15)  # between the scans of the two
AT = {"front": 80_000_000, "back": 0}  # ns; when each was taken


def mounts() -> messages.TFMessage:
    return messages.TFMessage(
        [
            messages.TransformStamped(
                messages.Header(frame_id="base_link"),
                name,
                messages.Transform(messages.Vector3(at.x, at.y, 0.2), quaternion(at.theta)),
            )
            for name, at in (("front", FRONT), ("back", BACK))
        ]
    )


def seen(name: str, second: int, *, moved: bool = True) -> messages.LaserScan:
    """Return what a scanner sees; the rear one before the robot has `moved` on."""
    then = MAP_FROM_BASE.compose(DRIVEN.inverse()) if name == "back" and moved else MAP_FROM_BASE
    mounted = FRONT if name == "front" else BACK
    return scan_from(then, second + 1e-9 * AT[name], name, mounted=mounted, scanner=NARROW)


def odometry(second: int, nanosec: int, at: linefix.RigidTransform) -> messages.Odometry:
    return odometry_at(second + 1e-9 * nanosec, at)


def test_two_scanners_find_together_what_neither_finds(domain: int, map_file: str) -> None:
    with bridge("--map", map_file, "--agree", "1", "--scan", "/front", "--scan", "/back"):
        robot = Robot(domain)
        front, back = (Publisher(robot.net, f"/{name}", messages.LaserScan, SENSOR) for name in AT)
        driven = Publisher(robot.net, "/odom", messages.Odometry, SENSOR)
        robot.mounts.publish(mounts())
        for told in (front, back):
            name = "front" if told is front else "back"
            robot.until(
                robot.diagnostics,
                lambda name=name, told=told: told.publish(seen(name, 1)),  # type: ignore[misc]
                lambda one: one.status[0].message != "" and "no transform" not in one.status[0].message,
            )
        assert robot.initial.take() == []  # neither alone

        def play(second: list[int] = [1]) -> None:  # noqa: B006
            second[0] += 1
            driven.publish(odometry(second[0], 0, HERE))
            driven.publish(odometry(second[0], 90_000_000, DRIVEN))
            back.publish(seen("back", second[0]))
            front.publish(seen("front", second[0]))

        found = robot.until(robot.initial, play)
    assert found.header.stamp.nanosec == AT["front"]  # the newest
    assert is_at_truth(found)


def gathered(*names: str, moved: bool = True, told: OdometryHistory | None = None) -> tuple[Any, list[str]]:
    """Answer scans as the bridge does."""
    where = Frames()
    where.take(mounts(), static=True)
    looks, missing = looks_of(
        [seen(name, 3, moved=moved) for name in names], where, NodeOptions(), told or OdometryHistory()
    )
    together = linefix.assemble([look.view for look in looks])
    return linefix.locate(linefix.index_map(ROOM), together), missing


def test_odometry_says_how_the_robot_moved_between_them() -> None:
    """Without it the older scan is left out, and the answer names it as missing."""
    told = OdometryHistory()
    for nanosec, at in ((0, HERE), (40_000_000, linefix.RigidTransform(0.12, 0.01, 0.07)), (90_000_000, DRIVEN)):
        told.take(odometry(3, nanosec, at))
    found, missing = gathered("front", "back", told=told)
    assert missing == []
    assert math.hypot(found.pose.x - MAP_FROM_BASE.x, found.pose.y - MAP_FROM_BASE.y) < 0.03
    _, missing = gathered("front", "back")
    assert missing == ['no odometry between the newest scan and that of "back", which is left out']


def test_odometry_is_interpolated_and_forgotten() -> None:
    told = OdometryHistory()
    begin, end = 5 * messages.NS, 5 * messages.NS + messages.NS // 4
    assert told.between(begin, begin) == HERE
    assert told.between(begin, end) is None
    told.take(odometry(5, 0, HERE))
    told.take(odometry(5, 500_000_000, linefix.RigidTransform(1.0, 0.0, 0.4)))
    half = known(told.between(begin, end))
    assert (half.x, half.y, half.theta) == pytest.approx((0.5, 0.0, 0.2))
    assert told.between(begin, 7 * messages.NS) is None  # no odometry for a second
    told.take(odometry(2, 0, HERE))  # the clock went back
    assert told.between(begin, end) is not None  # a single stamp may be wrong
    told.take(odometry(2, 100_000_000, HERE))
    assert told.between(begin, end) is None
    broken = messages.Odometry()
    broken.pose.pose.orientation = messages.Quaternion(0.0, 0.0, 0.0, 0.0)
    with pytest.raises(ValueError, match="quaternion"):
        told.take(broken)


def test_scans_wait_for_one_another_for_a_while() -> None:
    waiting = Gathering(2, 3600.0)
    waiting.take(0, seen("front", 1))
    assert waiting.ready() == []
    waiting.take(1, seen("back", 1))
    assert [one.header.frame_id for one in waiting.ready()] == ["front", "back"]
    assert waiting.left is None
    gathering = Gathering(2, 0.1)
    gathering.take(1, seen("back", 2))
    gathering.take(0, seen("front", 3))  # a second later: no longer of one moment
    assert [one.header.frame_id for one in gathering.ready()] == ["front"]
    patient = Gathering(2, 0.0)
    patient.take(1, seen("back", 2))
    assert [one.header.frame_id for one in patient.ready()] == ["back"]
