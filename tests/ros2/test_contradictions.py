"""Odometry, stamps and publishers that contradict the scans: no pose is agreed or published by them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import linefix
from registration import IDENTITY, RigidTransform
from ros2 import Maps, NodeOptions, messages
from ros2.agreement import Agreement, Event, Observation
from ros2.clock import Clock, time_of
from ros2.deciding import MapToOdom
from ros2.maps import convert
from ros2.odometry import OdometryHistory
from ros2.topics import RELIABLE, SENSOR, STREAM, Publisher

from .robot import ROOM, Robot, grid_of_room, is_at_truth, mount, quaternion, running, scan, wait_until
from .test_agreement import SECOND, drive, events, first_agreed
from .test_deciding import confirmed

LONG = [RigidTransform(0.2 * k, 0.0, 0.0) for k in range(40)]


def frozen(scans: list[Observation], since: int) -> list[Observation]:
    """Return scans whose odometry stands still from one of them on."""
    return [replace(one, odometry=scans[min(k, since)].odometry) for k, one in enumerate(scans)]


def test_a_robot_that_drives_with_frozen_odometry_is_not_agreed() -> None:
    tenths = [replace(one, stamp=k * SECOND // 10) for k, one in enumerate(drive([*_slow(0.05, 100)]))]
    assert first_agreed(frozen(tenths, 0)) is None


def _slow(step: float, count: int) -> list[RigidTransform]:
    return [RigidTransform(step * k, 0.0, 0.0) for k in range(count)]


def test_odometry_that_freezes_refutes_the_agreed_pose() -> None:
    scans = frozen([replace(one, stamp=k * SECOND // 10) for k, one in enumerate(drive(_slow(0.05, 100)))], 40)
    agreement = Agreement()
    refuted = []
    for one in scans:
        agreement.take(one)
        refuted.append(agreement.refuted)
    assert not any(refuted[:41])
    assert refuted.index(True) <= 50  # within 1 s
    assert all(refuted[50:])


def test_a_mount_that_is_turned_by_180_degrees_is_never_agreed() -> None:
    turned = RigidTransform(0.0, 0.0, math.pi)
    scans = [replace(one, pose=one.pose.compose(turned)) for one in drive(LONG) if one.pose is not None]
    assert first_agreed(scans) is None


def test_turning_in_place_does_not_hide_a_mount_that_is_turned() -> None:
    turned = RigidTransform(0.0, 0.0, math.pi)
    way = [*LONG, *(RigidTransform(LONG[-1].x, 0.0, 0.2 * k) for k in range(20))]
    scans = [replace(one, pose=one.pose.compose(turned)) for one in drive(way) if one.pose is not None]
    assert first_agreed(scans) is None
    assert first_agreed(drive(way)) is not None


@pytest.mark.parametrize("ahead", [100, 6, -100])
def test_a_single_stamp_of_another_time_is_left_out(ahead: int) -> None:
    scans = drive(LONG)
    scans[20] = replace(scans[20], stamp=scans[20].stamp + ahead * SECOND, odometry=None)
    found = events(scans)
    assert found[20] is Event.NOTHING
    assert found.count(Event.AGREED) == 1
    assert found[21] is Event.CONFIRMED


def test_a_long_pause_of_the_scans_is_no_other_clock() -> None:
    scans = drive(LONG)
    later = [replace(one, stamp=one.stamp + (100 * SECOND if k >= 20 else 0)) for k, one in enumerate(scans)]
    found = events(later)
    assert found[20:22] == [Event.NOTHING, Event.CONFIRMED]
    assert found.count(Event.AGREED) == 1


def test_an_agreed_pose_is_confirmed_over_a_jump_of_odometry() -> None:
    before, after = drive(LONG)[:20], drive(LONG)[20:]
    jump = RigidTransform(4.0, -2.0, 1.0)
    moved = [replace(one, odometry=jump.compose(one.odometry), part=(1,)) for one in after if one.odometry is not None]
    agreement = Agreement()
    found = [agreement.take(one) for one in [*before, *moved]]
    assert found[3] is Event.AGREED
    assert set(found[4:]) == {Event.CONFIRMED}


def test_where_another_pose_is_likely_twice_the_way_is_needed() -> None:
    doubtful = [replace(one, rival=k == 1) for k, one in enumerate(drive(LONG))]
    assert first_agreed(doubtful) == 5  # 1 m, and six scans
    still = [replace(one, rival=True) for one in drive([IDENTITY] * 40)]
    assert first_agreed(still) is None
    assert first_agreed(drive([IDENTITY] * 40)) is not None


def test_no_transform_is_published_before_a_scan_confirms_odometry_that_jumped() -> None:
    correction, here = MapToOdom(), RigidTransform(1.0, 2.0, 0.3)
    first = confirmed(0, here)
    correction.take(Event.AGREED, first)
    assert correction.advance(SECOND, here) is not None
    assert correction.advance(SECOND, IDENTITY, (1,)) is None
    assert correction.advance(SECOND, here, (), 0.4) is not None
    assert correction.advance(SECOND, IDENTITY, (), 1.0) is None  # the gap may hide a restart
    correction.take(Event.CONFIRMED, replace(first, stamp=2 * SECOND, odometry=IDENTITY, part=(1,)))
    current = correction.advance(2 * SECOND, IDENTITY, (1,))
    assert current is not None
    assert first.pose is not None
    assert (current.x, current.y) == pytest.approx((first.pose.x, first.pose.y))  # at once, not at 0.2 m/s


@pytest.mark.parametrize("ahead", [100, 6, -100])
@pytest.mark.parametrize("topic", ["odometry", "tf"])
def test_a_single_stamp_of_odometry_of_another_time_is_left_out(ahead: int, topic: str) -> None:
    clock = Clock(simulated=True)
    history, stamps = OdometryHistory(clock), []
    for k in range(20, 30):
        clock.take(messages.Clock(time_of(k * SECOND // 10)))
        stamp = k * SECOND // 10 + (ahead * SECOND if k == 25 else 0)
        message = messages.Odometry(messages.Header(time_of(stamp), "odom"), "base_link")
        for _ in range(2):  # transforms are looked up at each message
            if topic == "tf":
                history.take_transform(stamp, np.eye(4), "odom")
            else:
                history.take(message)
        newest = history.newest
        assert newest is not None
        stamps.append((newest[0], newest[2].part))
    assert stamps == [(k * SECOND // 10, stamps[0][1]) for k in range(20, 30)]


def test_a_clock_of_odometry_that_was_set_counts_from_its_second_stamp() -> None:
    clock = Clock(simulated=True)
    history, stamps = OdometryHistory(clock), []
    for k in range(20, 26):
        clock.take(messages.Clock(time_of(k * SECOND // 10)))
        stamp = k * SECOND // 10 + (100 * SECOND if k >= 23 else 0)
        history.take(messages.Odometry(messages.Header(time_of(stamp), "odom"), "base_link"))
        assert history.newest is not None
        stamps.append(history.newest[0] - k * SECOND // 10)
    assert stamps == [0, 0, 0, 0, 100 * SECOND, 100 * SECOND]


def test_ages_are_those_of_a_simulation() -> None:
    clock = Clock(simulated=True)
    assert not clock.started
    clock.take(messages.Clock(time_of(5 * SECOND)))
    odometry = OdometryHistory(clock)
    odometry.take(messages.Odometry(messages.Header(time_of(5 * SECOND), "odom"), "base_link"))
    assert clock.now() == messages.Time(5, 0)
    assert odometry.silent_s == 0.0  # however long the simulation stands still
    clock.take(messages.Clock(time_of(6 * SECOND)))
    assert odometry.silent_s == 1.0


def test_surfaces_of_walls_are_where_the_option_says() -> None:
    def left(surface: float | None) -> float:
        maps = convert(bytes(grid_of_room().serialize()), surface).maps
        assert maps is not None
        return float(maps.walls_of(None).endpoints[:, 0].min())

    assert left(0.0) - left(1.0) == pytest.approx(0.05, abs=1e-6)


def played(
    domain: int, expected: str, play: Callable[[Robot, Callable[[], None]], Callable[[], None]], **options: str
) -> list[str]:
    """Return the log of a node up to a line."""
    logged: list[str] = []
    room = Maps(linefix.index_map(ROOM), {"room": "map"})
    with running(NodeOptions(domain=domain, **options), room, logged.append):  # type: ignore[arg-type]
        robot, seconds = Robot(domain, options.get("namespace", "")), [1]

        def scans() -> None:
            seconds[0] += 1
            robot.scans.publish(replace(scan(1), header=messages.Header(messages.Time(seconds[0]), "laser")))

        again = play(robot, scans)

        def found() -> bool:
            again()
            return any(expected in line for line in logged)

        wait_until(found, lambda: (expected, logged))
    return logged


def test_two_lasers_of_one_frame_are_named_and_not_agreed(domain: int) -> None:
    def play(robot: Robot, scans: Callable[[], None]) -> Callable[[], None]:
        robot.mounts.publish(mount())
        second = Publisher(robot.net, "/scan", messages.LaserScan, SENSOR)
        stamp = [100]

        def both() -> None:
            stamp[0] += 1
            other = replace(scan(1), header=messages.Header(messages.Time(stamp[0]), "laser"))
            second.publish(other)
            scans()

        return both

    logged = played(domain, 'several publishers send scans of the frame "laser", expected one', play)
    assert not [line for line in logged if "state agreed" in line]


def test_transforms_without_the_prefix_are_named(domain: int) -> None:
    def play(robot: Robot, scans: Callable[[], None]) -> Callable[[], None]:
        mounts = Publisher(robot.net, "/tf_static", messages.TFMessage, STREAM)

        def both() -> None:
            mounts.publish(mount())
            scans()

        return both

    expected = "/tf_static has it without the prefix robot7/: if only this robot uses it, add -r tf:=/tf"
    played(domain, expected, play, namespace="/robot7")


def test_a_localizer_in_another_frame_is_not_lost(domain: int) -> None:
    def play(robot: Robot, scans: Callable[[], None]) -> Callable[[], None]:
        robot.mounts.publish(mount())
        amcl = Publisher(robot.net, "/amcl_pose", messages.PoseWithCovarianceStamped, RELIABLE)

        def both() -> None:
            pose = messages.PoseWithCovariance(messages.Pose(messages.Point(9.0), quaternion(0.0)))
            amcl.publish(messages.PoseWithCovarianceStamped(messages.Header(messages.Time(3), "odom"), pose))
            scans()

        return both

    played(domain, '/amcl_pose: found a pose in "odom", expected one in the frame of a map', play)


def test_static_transforms_are_used_that_are_published_best_effort(domain: int, room: linefix.MapIndex) -> None:
    with running(NodeOptions(agree=1, domain=domain), room):
        robot = Robot(domain)
        mounts = Publisher(robot.net, "/tf_static", messages.TFMessage, STREAM)

        def play() -> None:
            mounts.publish(mount())
            robot.scans.publish(scan(1))

        assert is_at_truth(robot.until(robot.initial, play))


def test_usable_scans_that_do_not_agree_are_logged(domain: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ros2.inputs.SILENT_SECONDS", 0.5)

    def play(robot: Robot, scans: Callable[[], None]) -> Callable[[], None]:
        robot.mounts.publish(mount())
        odometry, at = Publisher(robot.net, "/odom", messages.Odometry, STREAM), [0]

        def both() -> None:  # the scans are those of a robot at rest
            for _ in range(5):
                at[0] += 1
                message = messages.Odometry(messages.Header(time_of(SECOND + at[0] * SECOND // 5), "odom"), "base_link")
                message.pose.pose = messages.Pose(messages.Point(0.1 * at[0]), quaternion(0.0))
                odometry.publish(message)
            scans()

        return both

    played(domain, "scans are usable, but have not agreed", play)
