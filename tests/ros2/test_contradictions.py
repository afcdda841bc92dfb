"""Odometry, stamps and publishers that contradict the scans: no pose is agreed or published by them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from itertools import count

import numpy as np
import pytest

import linefix
from registration import IDENTITY, RigidTransform
from ros2 import Maps, NodeOptions, messages
from ros2.agreement import Agreement, Event
from ros2.clock import Clock, time_of
from ros2.deciding import MapToOdom
from ros2.maps import convert
from ros2.odometry import OdometryHistory
from ros2.topics import RELIABLE, SENSOR, STREAM, Publisher
from tests.association.scenes import known

from .robot import ROOM, Robot, grid_of_room, mount, odometry_at, quaternion, running, scan, wait_until
from .test_agreement import LONG, SECOND, SLOW, at_times, drive, events, frozen
from .test_deciding import confirmed


def test_odometry_that_freezes_refutes_the_agreed_pose() -> None:
    scans = frozen(at_times(drive(SLOW), 0.1), 40)
    agreement = Agreement()
    refuted = []
    for one in scans:
        agreement.take(one)
        refuted.append(agreement.refuted)
    assert not any(refuted[:41])
    assert refuted.index(True) <= 50  # within 1 s
    assert all(refuted[50:])


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


def test_no_transform_is_published_before_a_scan_confirms_odometry_that_jumped() -> None:
    correction, here = MapToOdom(), RigidTransform(1.0, 2.0, 0.3)
    first = confirmed(0, here)
    correction.take(first, new=True)
    assert correction.advance(SECOND, here) is not None
    assert correction.advance(SECOND, IDENTITY, (1,)) is None
    assert correction.advance(SECOND, here, (), 0.4) is not None
    assert correction.advance(SECOND, IDENTITY, (), 1.0) is None  # the gap may hide a restart
    correction.take(replace(first, stamp=2 * SECOND, odometry=IDENTITY, part=(1,)), new=False)
    current = known(correction.advance(2 * SECOND, IDENTITY, (1,)))
    assert (current.x, current.y) == pytest.approx(
        (known(first.pose).x, known(first.pose).y)
    )  # at once, not at 0.2 m/s


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
        newest = known(history.newest)
        stamps.append((newest[0], newest[2].part))
    assert stamps == [(k * SECOND // 10, stamps[0][1]) for k in range(20, 30)]


def test_a_clock_of_odometry_that_was_set_counts_from_its_second_stamp() -> None:
    clock = Clock(simulated=True)
    history, stamps = OdometryHistory(clock), []
    for k in range(20, 26):
        clock.take(messages.Clock(time_of(k * SECOND // 10)))
        stamp = k * SECOND // 10 + (100 * SECOND if k >= 23 else 0)
        history.take(messages.Odometry(messages.Header(time_of(stamp), "odom"), "base_link"))
        stamps.append(known(history.newest)[0] - k * SECOND // 10)
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
        maps = known(convert(bytes(grid_of_room().serialize()), surface).maps)
        return float(maps.walls_of(None).endpoints[:, 0].min())

    assert left(0.0) - left(1.0) == pytest.approx(0.05, abs=1e-6)


@contextmanager
def playing(domain: int, namespace: str = "") -> Iterator[tuple[Robot, Callable[..., list[str]]]]:
    """Run a node and a robot; what is given plays scans, and more, until the node logs a line, and returns its log."""
    logged: list[str] = []
    room = Maps(linefix.index_map(ROOM), {"room": "map"})
    with running(NodeOptions(domain=domain, namespace=namespace), room, logged.append):
        robot, stamps = Robot(domain, namespace), count(2)

        def until(expected: str, play: Callable[[int], object]) -> list[str]:
            def found() -> bool:
                play(next(stamps))
                robot.scans.publish(replace(scan(1), header=messages.Header(messages.Time(next(stamps)), "laser")))
                return any(expected in line for line in logged)

            wait_until(found, lambda: (expected, logged))
            return logged

        yield robot, until


def test_two_lasers_of_one_frame_are_named_and_not_agreed(domain: int) -> None:
    with playing(domain) as (robot, until):
        robot.mounts.publish(mount())
        second = Publisher(robot.net, "/scan", messages.LaserScan, SENSOR)
        logged = until(
            'several publishers send scans of the frame "laser", expected one',
            lambda stamp: second.publish(replace(scan(1), header=messages.Header(messages.Time(stamp), "laser"))),
        )
    assert not [line for line in logged if "state agreed" in line]


def test_transforms_without_the_prefix_are_named(domain: int) -> None:
    expected = "/tf_static has it without the prefix robot7/: if only this robot uses it, add -r tf:=/tf"
    with playing(domain, "/robot7") as (robot, until):
        mounts = Publisher(robot.net, "/tf_static", messages.TFMessage, STREAM)
        until(expected, lambda _: mounts.publish(mount()))


def test_a_localizer_in_another_frame_is_not_lost(domain: int) -> None:
    with playing(domain) as (robot, until):
        robot.mounts.publish(mount())
        amcl = Publisher(robot.net, "/amcl_pose", messages.PoseWithCovarianceStamped, RELIABLE)
        pose = messages.PoseWithCovariance(messages.Pose(messages.Point(9.0), quaternion(0.0)))
        message = messages.PoseWithCovarianceStamped(messages.Header(messages.Time(3), "odom"), pose)
        expected = '/amcl_pose: found a pose in "odom", expected one in the frame of a map'
        until(expected, lambda _: amcl.publish(message))


def test_usable_scans_that_do_not_agree_are_logged(domain: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Those of a robot at rest, while odometry moves."""
    monkeypatch.setattr("ros2.inputs.SILENT_SECONDS", 0.5)
    with playing(domain) as (robot, until):
        robot.mounts.publish(mount())
        odometry = Publisher(robot.net, "/odom", messages.Odometry, STREAM)

        def moves(stamp: int) -> None:
            for k in range(10):
                second = stamp + 0.2 * k
                odometry.publish(odometry_at(second, RigidTransform(0.5 * second, 0.0, 0.0)))

        until("scans are usable, but have not agreed", moves)
