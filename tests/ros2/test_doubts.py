"""Missing or contradicting odometry, and scans that end, are no evidence."""

from __future__ import annotations

import math
import time
from dataclasses import replace

import numpy as np
import pytest

import linefix
from registration import IDENTITY
from ros2 import NodeOptions, messages
from ros2.agreement import Agreement, Event, Observation
from ros2.clock import Clock
from ros2.deciding import MapToOdom
from ros2.frames import matrix_in_space, planar
from ros2.lag import Lag
from ros2.odometry import OdometryHistory
from tests.association.scenes import known

from .robot import at_second, grid_of_room, is_at_truth, mount, odometry_at, quaternion, running, scan, wait_until
from .test_fleet import Fleet, moved

TENTH = 100_000_000


def told(stamp: int, x: float, frame: str = "odom") -> messages.Odometry:
    message = odometry_at(stamp / (10 * TENTH), IDENTITY, frame)
    message.pose.pose.position.x = x
    return message


@pytest.fixture
def soon(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("ros2.inputs.ENDED_SECONDS", "ros2.inputs.SILENT_SECONDS"):
        monkeypatch.setattr(name, 1.0)


def test_odometry_is_known_between_values_that_are_near_and_possible() -> None:
    odometry = OdometryHistory()
    for k in (*range(20), *range(50, 60)):
        odometry.take(told(k * TENTH, 0.1 * k))
    before, after = odometry.known(15 * TENTH), odometry.known(55 * TENTH)
    assert before is not None
    assert after is not None
    assert before.part == after.part
    assert after.unknown_ns - before.unknown_ns == 31 * TENTH
    assert odometry.known(30 * TENTH) is None
    assert odometry.known(60 * TENTH) is None
    assert not odometry.jump
    odometry.take(told(59 * TENTH + TENTH // 10, 4.9))
    assert odometry.jump.startswith("1.00 m within 0.010 s")
    assert odometry.known(57 * TENTH) is None


def test_odometry_of_another_clock_is_not_known() -> None:
    odometry = OdometryHistory()
    for k in range(20):
        odometry.take(told(k * TENTH, 0.1 * k))
    now = time.monotonic_ns()
    offset = odometry.clock_offset(15 * TENTH, now)
    same = now - offset
    assert odometry.known(15 * TENTH, same) is not None
    assert odometry.known(15 * TENTH, same + 8 * TENTH) is None


def test_transforms_are_odometry_until_messages_come() -> None:
    odometry = OdometryHistory()
    odometry.take_transform(TENTH, matrix_in_space(linefix.RigidTransform(1.0, 2.0, 0.5)), "odom")
    assert (odometry.frame, odometry.source) == ("odom", "tf")
    assert odometry.newest is not None
    assert odometry.newest[1].y == 2.0
    odometry.take(told(2 * TENTH, 7.0), topic="/odom")
    odometry.take_transform(3 * TENTH, matrix_in_space(linefix.RigidTransform(1.0, 2.0, 0.5)), "odom")
    assert odometry.source == "/odom"
    assert odometry.newest[1].x == 7.0


def test_messages_and_transforms_that_differ_are_two_sources() -> None:
    odometry = OdometryHistory()
    for k in range(20):
        odometry.take(told(k * TENTH, 0.112 * k), topic="/odom")  # wheels slip
        odometry.take_transform(k * TENTH, matrix_in_space(linefix.RigidTransform(0.1 * k, 0.0, 0.0)), "odom")
        assert bool(odometry.apart) == (k > 8)
    assert odometry.apart == "0.23 m and 0 degrees"
    for k in range(20, 23):
        odometry.take_transform(k * TENTH, matrix_in_space(linefix.RigidTransform(0.112 * k, 0.0, 0.0)), "odom")
        odometry.take(told(k * TENTH, 0.112 * k), topic="/odom")
    assert not odometry.apart


def test_messages_of_one_topic_in_two_frames_are_two_sources() -> None:
    odometry = OdometryHistory()
    for k in range(20):
        odometry.take(told(k * TENTH, 0.1 * k, "odom" if k < 10 else "wheels"))
    assert not odometry.frames  # one that began again
    for k in range(20, 25):
        odometry.take(told(k * TENTH, 0.1 * k, ("odom", "wheels")[k % 2]))
    assert odometry.frames == ("odom", "wheels")


@pytest.mark.parametrize(
    ("other", "expected"),
    [("tf", 'odometry on /odom and tf differ by 1.00 m and 0 degrees in "odom"'),
     ("wheels", 'odometry on /odom alternates between the frames "odom" and "wheels"')],
)  # fmt: skip
def test_two_sources_of_odometry_are_named(
    domain: int, room: linefix.MapIndex, soon: None, other: str, expected: str
) -> None:
    logged: list[str] = []
    with running(NodeOptions(domain=domain, agree=1, publish_tf=True), room, logged.append):
        robot, tick = Fleet(domain), [10]
        robot.mounts.publish(mount())

        def play() -> None:
            tick[0] += 1
            second, at = 0.1 * tick[0], moved(1.0 + 0.01 * tick[0])
            robot.drive(at, second)
            if other != "tf":
                robot.odometry.publish(told(tick[0] * TENTH, 0.0, other))
                return
            moves = messages.Transform(messages.Vector3(at.x + 2.0, at.y), quaternion(at.theta))
            header = messages.Header(at_second(second), "odom")
            robot.tf.publish(messages.TFMessage([messages.TransformStamped(header, "base_link", moves)]))

        def named(status: messages.DiagnosticStatus) -> bool:
            return bool({one.key: one.value for one in status.values}["input problem"] == expected)

        assert robot.until(robot.status, play, named).level > 0
        wait_until(lambda: any(line.startswith(expected) for line in logged), lambda: logged)


def test_a_map_that_changes_keeps_the_agreed_pose(domain: int) -> None:
    logged: list[str] = []
    with running(NodeOptions(domain=domain, agree=1, map_topic="map", base="laser"), None, logged.append):
        robot, grid = Fleet(domain), grid_of_room()
        robot.maps.publish(grid)
        robot.until(robot.initial, lambda: robot.scans.publish(scan(1)))
        for cell in range(70 * 140 + 30, 70 * 140 + 33):
            grid.data[cell] = 100
        robot.maps.publish(grid)
        wait_until(lambda: any("are new or gone, the pose is kept" in line for line in logged), lambda: logged)
        grid.info.origin.position.x += 1.0
        robot.maps.publish(grid)
        wait_until(lambda: any("are new or gone, the pose is discarded" in line for line in logged), lambda: logged)


@pytest.mark.parametrize("seen", [None, False], ids=["no scans", "no ranges"])
def test_a_pose_without_scans_is_stale_and_its_transform_ends(
    domain: int, room: linefix.MapIndex, soon: None, seen: bool | None
) -> None:
    logged: list[str] = []
    options = NodeOptions(domain=domain, agree=1, publish_tf=True, tf_max_age_s=1.0)
    with running(options, room, logged.append):
        robot, second = Fleet(domain), [1.0]
        robot.mounts.publish(mount())

        def drives() -> None:
            second[0] += 0.05
            robot.drive(moved(1.0 + 0.001 * second[0]), second[0])

        robot.until(robot.transforms, drives)
        robot.status.take()

        def blind() -> None:
            second[0] += 0.05
            still = odometry_at(second[0], linefix.RigidTransform(moved(1.0).x + 1.0, moved(1.0).y, 0.0))
            robot.odometry.publish(still)
            if seen is not None:
                empty = scan(1, seen=seen)
                empty.header.stamp = still.header.stamp
                robot.scans.publish(empty)

        stale = robot.until(robot.status, blind, lambda one: "not confirmed any more" in one.message)
        assert stale.level == 2
        expected = "no scan arrives on /scan" if seen is None else "no scan has a range"
        assert expected in stale.message
        assert {one.key: one.value for one in stale.values}["input problem"].startswith(expected)

        def silent() -> bool:
            blind()
            time.sleep(0.5)
            return not robot.transforms.take()

        wait_until(silent, lambda: logged)
        assert any(line.startswith("state stale") for line in logged)
        robot.until(robot.status, drives, lambda one: one.message == "the pose is agreed")


def test_missing_odometry_is_logged_and_that_of_the_map_frame_is_refused(
    domain: int, room: linefix.MapIndex, soon: None
) -> None:
    logged: list[str] = []
    with running(NodeOptions(domain=domain, publish_tf=True), room, logged.append):
        robot = Fleet(domain)
        robot.mounts.publish(mount())
        robot.until(robot.poses, lambda: robot.scans.publish(scan(1)), is_at_truth)
        for k in range(30):
            robot.odometry.publish(told(k * TENTH, 0.1 * k, "map"))
        wait_until(lambda: any("no odometry: no valid message on /odom" in line for line in logged), lambda: logged)
        refused = [line for line in logged if 'found odometry in "map", the frame of the map' in line]
        assert len(refused) == 1
        assert robot.transforms.take() == []


def test_the_same_problem_with_other_numbers_is_logged_once(domain: int, room: linefix.MapIndex) -> None:
    logged: list[str] = []
    with running(NodeOptions(domain=domain), room, logged.append):
        robot = Fleet(domain)
        robot.connect()
        for k in range(30):
            message = told(k * TENTH, float("nan"))
            message.pose.pose.position.y = 0.1 * k
            robot.odometry.publish(message)
        wait_until(lambda: any("expected a position" in line for line in logged), lambda: logged)
        time.sleep(0.3)
    assert len([line for line in logged if "/odom" in line]) == 1


@pytest.mark.parametrize("late", [-0.4, 0.0, 0.4])
def test_scans_of_another_clock_do_not_turn_the_pose(late: float) -> None:
    """A robot drives, turns by 180 degrees and drives back; scans have late stamps, and are searched after 0.6 s."""

    def at(tick: int) -> linefix.RigidTransform:
        second = 0.05 * (tick - 1000)
        turned = min(max(second - 4.0, 0.0), math.pi)  # rad, at 1 rad/s
        return linefix.RigidTransform(0.4 * (min(second, 4.0) - max(second - 4.0 - math.pi, 0.0)), 0.0, turned)

    clock = Clock(simulated=True)
    odometry, agreement, correction = OdometryHistory(clock), Agreement(), MapToOdom()
    lag, transforms, doubts = Lag(odometry), [], set()
    for tick in range(1000, 1250):
        clock.take(messages.Clock(messages.Time(*divmod(tick * TENTH // 2, 10 * TENTH))))
        odometry.take(odometry_at(0.05 * tick, at(tick)))
        received = (tick - 12) * TENTH // 2
        stamp = received + round(late * 10 * TENTH)
        scan = Observation(stamp, at(tick - 12), np.diag([1e-5, 1e-5, 4e-6]), True)
        lag.take(scan, received)
        shift = lag.shift(stamp, received)
        if shift:
            doubts.add(odometry.clocks(shift).partition(" on ")[0])
        fix = odometry.known(stamp + shift, received)
        if fix is not None:
            scan = replace(scan, odometry=planar(fix.matrix), part=fix.part)
        event = agreement.take(scan)
        if event in (Event.AGREED, Event.CONFIRMED):
            correction.take(scan, new=event is Event.AGREED)
        newest = known(odometry.newest)
        transforms.append(correction.advance(newest[0], newest[1], newest[2].part))
    turned = [abs(one.theta) for one in transforms if one is not None]
    assert len(turned) > 50
    assert max(turned) < math.radians(5.0)
    apart = "ahead of" if late > 0.0 else "behind"
    assert doubts == ({f"the stamps of scans are {abs(late)} s {apart} those of odometry"} if late else set())
