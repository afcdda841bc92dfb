"""Agreement over DDS, and several robots in one domain."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from cyclonedds.domain import DomainParticipant

import linefix
from ros2 import NodeOptions, messages
from ros2.odometry import OdometryHistory
from ros2.topics import LATCHED, RELIABLE, SENSOR, Publisher, Subscription

from .robot import (
    BASE_FROM_LASER,
    MAP_FROM_BASE,
    WALLS,
    Robot,
    at_second,
    deliver,
    is_at_truth,
    mount,
    odometry_at,
    quaternion,
    running,
    scan_from,
    wait_until,
)


class Fleet(Robot):
    """A robot with odometry and a localizer."""

    def __init__(self, domain: int, namespace: str = "", prefix: str = "") -> None:
        super().__init__(domain, namespace)
        self.prefix = prefix
        self.odometry = Publisher(self.net, f"{namespace}/odom", messages.Odometry, SENSOR)
        self.tf = Publisher(self.net, f"{namespace if not prefix else ''}/tf", messages.TFMessage, RELIABLE)
        self.global_mounts = Publisher(self.net, "/tf_static", messages.TFMessage, LATCHED)
        self.agreed = Subscription(
            self.net, f"{namespace}/linefix/agreed_pose", messages.PoseWithCovarianceStamped, RELIABLE
        )
        self.transforms = Subscription(self.net, "/tf", messages.TFMessage, RELIABLE)

    def drive(self, at: linefix.RigidTransform, second: float, walls: linefix.Segments = WALLS) -> None:
        """Publish odometry and a scan; the odometry frame is where the map is, 1 m aside."""
        there = linefix.RigidTransform(at.x + 1.0, at.y, at.theta)
        self.odometry.publish(odometry_at(second, there, f"{self.prefix}odom", f"{self.prefix}base_link"))
        self.scans.publish(scan_from(at, second, f"{self.prefix}laser", walls))


@contextmanager
def fleet(domain: int, room: linefix.MapIndex, namespace: str = "", **options: Any) -> Iterator[Fleet]:
    """Run a bridge, and a robot whose mount is known."""
    with running(NodeOptions(domain=domain, namespace=namespace, **options), room):
        robot = Fleet(domain, namespace)
        robot.mounts.publish(mount())
        yield robot


def moved(second: float, speed: float = 0.3) -> linefix.RigidTransform:
    return linefix.RigidTransform(0.8 + speed * (second - 1.0), 1.0, 0.1 * second)


def drive_until(robot: Fleet, heard: Subscription[Any], second: float = 1.0, wanted: Any = bool) -> tuple[Any, float]:
    """Drive on until something wanted is published; return it, and the time."""
    times = [second]

    def play() -> None:
        times[0] += 0.5
        robot.drive(moved(min(times[0], 9.0)), times[0])

    return robot.until(heard, play, wanted), times[0]


def off(message: messages.PoseWithCovarianceStamped, second: float) -> float:
    at, truth = message.pose.pose.position, moved(min(second, 9.0))
    return math.hypot(at.x - truth.x, at.y - truth.y)


def stamp_of(message: messages.PoseWithCovarianceStamped) -> float:
    return float(message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec)


def test_a_pose_is_published_when_scans_agree(domain: int, room: linefix.MapIndex) -> None:
    with fleet(domain, room) as robot:
        usable, second = drive_until(robot, robot.poses)
        assert robot.initial.take() == []
        initial, _ = drive_until(robot, robot.initial, second)
        assert off(initial, stamp_of(initial)) < 0.03
        assert stamp_of(initial) - stamp_of(usable) >= 0.9  # three scans, 0.5 m or 30 degrees
        covariance = np.reshape(initial.pose.covariance, (6, 6))
        assert (np.sqrt(np.diag(covariance)[[0, 1]]) >= 0.05 - 1e-9).all()
        assert math.sqrt(covariance[5, 5]) >= math.radians(2.0) - 1e-4
        states = [one.message for one in robot.status.take()]
        assert "the pose is agreed" in states
        assert {one.markers[0].ns for one in robot.markers.take()} == {"linefix/robot"}


def test_a_pose_that_is_contradicted_is_reported_and_corrected(domain: int, room: linefix.MapIndex) -> None:
    """The robot is carried to where it sees both arms of the room, which odometry does not notice."""
    with fleet(domain, room) as robot:
        _, second = drive_until(robot, robot.initial)
        robot.status.take()
        there = linefix.RigidTransform(3.0, 3.0, -1.0)
        clock = [second]

        def play() -> None:
            clock[0] += 0.5
            robot.odometry.publish(odometry_at(clock[0], moved(second)))
            robot.scans.publish(scan_from(there, clock[0]))

        contradicted = robot.until(robot.status, play, lambda one: one.level == 2)
        assert "contradicted" in contradicted.message
        corrected = robot.until(robot.initial, play)
    assert math.hypot(corrected.pose.pose.position.x - 3.0, corrected.pose.pose.position.y - 3.0) < 0.03


def test_the_result_of_a_scan_waits_for_its_odometry(
    domain: int, room: linefix.MapIndex, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By the odometry before, the scan would contradict the agreed pose, and the pose would be corrected."""
    held: list[float] = []  # stamps of results that the node holds back

    def awaited(history: OdometryHistory, stamp: int, before: Any = OdometryHistory.awaited) -> bool:
        waits: bool = before(history, stamp)
        held.extend([stamp / messages.NS] * waits)
        return waits

    monkeypatch.setattr("ros2.node.ODOMETRY_SECONDS", 3600.0)
    monkeypatch.setattr(OdometryHistory, "awaited", awaited)
    with fleet(domain, room, agree=1) as robot:
        robot.until(robot.initial, lambda: robot.drive(moved(1.0), 1.0))
        robot.until(robot.agreed, lambda: robot.drive(moved(1.1), 1.1), lambda one: stamp_of(one) > 1.05)
        robot.initial.take()
        robot.status.take()
        further, second = moved(2.2), 1.5

        def waiting() -> bool:
            robot.scans.publish(scan_from(further, second))
            return second in held

        wait_until(waiting)
        found = robot.until(robot.agreed, lambda: robot.drive(further, second), lambda one: stamp_of(one) > 1.2)
        assert stamp_of(found) == second
        assert robot.initial.take() == []
        assert [one.message for one in robot.status.take() if one.level == 2] == []


def test_a_subscriber_receives_the_pose_once(domain: int, room: linefix.MapIndex) -> None:
    """Also one that subscribes when the pose is agreed already, the first of all."""
    logged: list[str] = []
    with running(NodeOptions(domain=domain, namespace="/lone", agree=1), room, logged.append):
        net = DomainParticipant(domain)
        scans = Publisher(net, "/lone/scan", messages.LaserScan, SENSOR)
        mounts = Publisher(net, "/lone/tf_static", messages.TFMessage, LATCHED)
        mounts.publish(mount())

        def agreed() -> bool:
            scans.publish(scan_from(MAP_FROM_BASE, 1.0))
            return any("no subscriber" in line for line in logged)

        wait_until(agreed, lambda: logged)
        robot = Fleet(domain, "/lone")
        robot.until(robot.initial, lambda: scans.publish(scan_from(MAP_FROM_BASE, 2.0)))
        for second in (3.0, 4.0, 5.0):
            robot.until(
                robot.poses,
                lambda second=second: scans.publish(scan_from(MAP_FROM_BASE, second)),  # type: ignore[misc]
                lambda one, second=second: stamp_of(one) == second,  # type: ignore[misc]
            )
        assert robot.initial.take() == []


def amcl_at(pose: linefix.RigidTransform, second: float) -> messages.PoseWithCovarianceStamped:
    place = messages.Pose(messages.Point(pose.x, pose.y), quaternion(pose.theta))
    covariance = np.diag([0.01, 0.01, 0.0, 0.0, 0.0, 0.01]).ravel().tolist()
    return messages.PoseWithCovarianceStamped(
        messages.Header(at_second(second), "map"), messages.PoseWithCovariance(place, covariance)
    )


def localized(robot: Fleet, error: float, second: float = 1.0) -> Any:
    """Return a drive with a localizer that is off by some metres."""
    amcl = Publisher(robot.net, "/amcl_pose", messages.PoseWithCovarianceStamped, LATCHED)
    clock = [second]

    def play() -> None:
        clock[0] += 0.5
        at = moved(min(clock[0], 9.0))
        amcl.publish(amcl_at(linefix.RigidTransform(at.x + error, at.y, at.theta), clock[0]))
        robot.drive(at, clock[0])

    amcl.publish(amcl_at(linefix.RigidTransform(moved(second).x + error, moved(second).y, moved(second).theta), second))
    deliver(amcl)
    return play


def drive_on(robot: Fleet, play: Any, heard: Subscription[Any]) -> None:
    """Drive on until the bridge has published something for five more scans."""
    for _ in range(5):
        robot.until(heard, play)


def test_a_bridge_that_starts_again_leaves_a_localizer_alone_that_has_the_pose(
    domain: int, room: linefix.MapIndex
) -> None:
    with fleet(domain, room) as robot:
        play = localized(robot, 0.05)
        drive_on(robot, play, robot.agreed)
        assert robot.initial.take() == []


@pytest.mark.parametrize("when", ["start", "lost"])
def test_a_localizer_that_is_lost_is_reported(domain: int, room: linefix.MapIndex, when: Any) -> None:
    with fleet(domain, room, when=when) as robot:
        right = localized(robot, 0.0)
        robot.until(robot.agreed, right)
        wrong = localized(robot, 1.5, 5.0)
        lost = robot.until(robot.status, wrong, lambda one: one.level == 2)
        assert "localizer" in lost.message
        if when == "lost":
            robot.until(robot.initial, wrong)
        else:
            drive_on(robot, wrong, robot.agreed)
            assert robot.initial.take() == []


@pytest.mark.parametrize("prefixed", [False, pytest.param(True, marks=pytest.mark.long)])
def test_two_robots_do_not_hear_each_other(domain: int, room: linefix.MapIndex, prefixed: bool) -> None:
    """With prefixes they share the topics of transforms."""
    named = [(f"/robot{k}", f"robot{k}/" if prefixed else "") for k in (1, 2)]
    first, second = (NodeOptions(domain=domain, namespace=name, frame_prefix=prefix) for name, prefix in named)
    with running(first, room), running(second, room):
        one, other = (Fleet(domain, name, prefix) for name, prefix in named)
        for robot, aside in ((one, 0.0), (other, 1.0)):
            message = mount(f"{robot.prefix}laser")
            message.transforms[0].header.frame_id = f"{robot.prefix}base_link"
            message.transforms[0].transform.translation.x += aside
            (robot.global_mounts if prefixed else robot.mounts).publish(message)
        initial, _ = drive_until(one, one.initial)
        assert off(initial, stamp_of(initial)) < 0.03
        assert other.poses.take() == other.initial.take() == []


def test_a_new_subscriber_gets_the_pose_from_a_node_that_publishes_the_transform(
    domain: int, room: linefix.MapIndex
) -> None:
    with fleet(domain, room, publish_tf=True) as robot:
        _, second = drive_until(robot, robot.initial)
        found, second = drive_until(robot, robot.transforms, second)
        one = found.transforms[0]
        assert (one.header.frame_id, one.child_frame_id) == ("map", "odom")
        place = one.transform.translation
        assert (place.x, place.y) == pytest.approx((-1.0, 0.0), abs=0.05)
        late = Subscription(robot.net, "/initialpose", messages.PoseWithCovarianceStamped, RELIABLE)
        drive_until(robot, late, second)


def test_a_transform_from_before_the_clock_was_set_back_is_not_published(domain: int, room: linefix.MapIndex) -> None:
    with fleet(domain, room, publish_tf=True) as robot:
        _, second = drive_until(robot, robot.transforms, 50.0)
        drive_until(robot, robot.status, second, lambda one: one.message == "the pose is agreed")
        clock = [1.0]

        def rest() -> None:
            clock[0] += 0.1
            robot.drive(moved(1.0), clock[0])

        robot.until(robot.status, rest, lambda one: one.message == "no pose is agreed yet")
        robot.until(robot.poses, rest)
        robot.transforms.take()
        robot.until(robot.poses, rest)
        assert robot.transforms.take() == []


def test_odometry_may_be_of_another_frame_than_the_base(domain: int, room: linefix.MapIndex) -> None:
    footprint = messages.Transform(messages.Vector3(0.2, 0.1, 0.0), quaternion(1.0))
    with running(NodeOptions(domain=domain), room):
        robot = Fleet(domain)
        base = messages.TransformStamped(messages.Header(frame_id="wheels"), "base_link", footprint)
        robot.mounts.publish(messages.TFMessage([*mount().transforms, base]))
        base_in_wheels = linefix.RigidTransform(0.2, 0.1, 1.0)
        clock = [1.0]

        def play() -> None:
            clock[0] += 0.5
            at = moved(min(clock[0], 9.0))
            wheels = at.compose(base_in_wheels.inverse())
            robot.odometry.publish(odometry_at(clock[0], wheels, child="wheels"))
            robot.scans.publish(scan_from(at, clock[0]))

        initial = robot.until(robot.initial, play)
    assert off(initial, stamp_of(initial)) < 0.03


def test_a_mount_that_moves_is_followed(domain: int, room: linefix.MapIndex) -> None:
    with running(NodeOptions(domain=domain, agree=1), room):
        robot = Fleet(domain)
        seconds = [1.0]

        def play() -> None:
            seconds[0] += 0.5
            for k, turn in enumerate((0.0, 0.4)):  # where it looked before does not count
                message = mount()
                transform = message.transforms[0]
                transform.header.stamp = at_second(seconds[0] - 0.2 + 0.2 * k)
                transform.transform.rotation = quaternion(BASE_FROM_LASER.theta + turn - 0.4)
                robot.tf.publish(message)
            robot.scans.publish(scan_from(MAP_FROM_BASE, seconds[0]))

        robot.until(robot.poses, play, is_at_truth)


def test_scans_without_a_time_are_taken(domain: int, room: linefix.MapIndex) -> None:
    with fleet(domain, room, agree=1) as robot:
        unstamped = replace(scan_from(MAP_FROM_BASE, 1.0), header=messages.Header(frame_id="laser"))
        found = robot.until(robot.initial, lambda: robot.scans.publish(unstamped))
    assert found.header.stamp == messages.Time()
