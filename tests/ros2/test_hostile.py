"""No message from outside ends the bridge, blocks it, or keeps it from what comes after."""

from __future__ import annotations

import math
import signal
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import linefix
from ros2 import NodeOptions, messages
from ros2.frames import Frames
from ros2.topics import LATCHED, STREAM, Publisher
from ros2.tuning import MAX_FRAMES

from .robot import PATIENCE, Robot, bridge, is_at_truth, mount, running, scan, wait_until


class NotUtf8(str):
    """Text that is written as bytes that no decoder takes."""

    def encode(self, *_: Any) -> bytes:
        return b"\xff\xfe\xc3"


BAD = NotUtf8("bad")


def transform(parent: str, child: str, **changes: Any) -> messages.TFMessage:
    one = mount(child).transforms[0]
    one.header.frame_id = parent
    for name, value in changes.items():
        setattr(one.transform, name, value)
    return messages.TFMessage([one])


def at(x: float) -> dict[str, Any]:
    return {"translation": messages.Vector3(x, 0.0, 0.2)}


def turned(x: float, w: float) -> dict[str, Any]:
    return {"rotation": messages.Quaternion(x, 0.0, 0.0, w)}


def odometry_at(x: float) -> messages.Odometry:
    return messages.Odometry(pose=messages.PoseWithCovariance(messages.Pose(messages.Point(x))))


def twisting(omega: float) -> messages.Odometry:
    twist = messages.Twist(angular=messages.Vector3(z=omega))
    return messages.Odometry(messages.Header(frame_id="odom"), twist=messages.TwistWithCovariance(twist))


def localizer_at(x: float, variance: float) -> messages.PoseWithCovarianceStamped:
    pose = messages.PoseWithCovariance(messages.Pose(messages.Point(x)), [variance] * 36)
    return messages.PoseWithCovarianceStamped(messages.Header(frame_id="map"), pose)


LOOP = transform("x", "laser").transforms + transform("laser", "x").transforms
BROKEN: dict[str, tuple[str, Any]] = {
    "a frame that is not UTF-8": ("tf_static", transform("base_link", BAD)),
    "a parent that is not UTF-8": ("tf_static", transform(BAD, "laser")),
    "a mount of 1e308 m": ("tf_static", transform("base_link", "laser", **at(1e308))),
    "a mount that is not finite": ("tf_static", transform("base_link", "laser", **at(math.nan))),
    "a mount of 1 km": ("tf_static", transform("base_link", "laser", **at(1000.0))),
    "a quaternion of length 0": ("tf_static", transform("base_link", "laser", **turned(0.0, 0.0))),
    "a quaternion of length 1e300": ("tf_static", transform("base_link", "laser", **turned(0.0, 1e300))),
    "a quaternion of NaN": ("tf_static", transform("base_link", "laser", **turned(math.nan, 1.0))),
    "its own parent": ("tf_static", transform("laser", "laser")),
    "a loop": ("tf_static", messages.TFMessage(LOOP)),
    "an empty parent": ("tf_static", transform("", "laser")),
    "a long name": ("tf_static", transform("b" * 100_000, "laser")),
    "a scan whose frame is not UTF-8": ("scan", replace(scan(1), header=messages.Header(frame_id=BAD))),
    "a scan with a long frame": ("scan", replace(scan(1), header=messages.Header(frame_id="l" * 100_000))),
    "a scan without beams": ("scan", replace(scan(1), ranges=[])),
    "a scan with 200,000 beams": ("scan", replace(scan(1), ranges=[1.0] * 200_000)),
    "a scan of NaN": ("scan", replace(scan(1), ranges=[math.nan] * 720)),
    "a scan with steps of 1e38": ("scan", replace(scan(1), angle_increment=1e38)),
    "a scan that begins nowhere": ("scan", replace(scan(1), angle_min=math.nan)),
    "a scan that takes a year": ("scan", replace(scan(1), time_increment=1e38)),
    "a scan of a negative range": ("scan", replace(scan(1), range_max=-1.0)),
    "odometry at 1e308 m": ("odom", odometry_at(1e308)),
    "odometry of NaN": ("odom", odometry_at(math.nan)),
    "odometry with a twist of NaN": ("odom", twisting(math.nan)),
    "odometry with an infinite twist": ("odom", twisting(math.inf)),
    "a localizer at NaN": ("amcl_pose", localizer_at(math.nan, 0.0)),
    "a localizer of a covariance of NaN": ("amcl_pose", localizer_at(0.0, math.nan)),
    "odometry whose child is not UTF-8": ("odom", messages.Odometry(child_frame_id=BAD)),
}


def test_the_bridge_goes_on_after_broken_messages(domain: int, room: linefix.MapIndex) -> None:
    """Also where they are latched, so that a bridge that starts again receives them first."""
    robot = Robot(domain)
    writers = {name: Publisher(robot.net, f"/{topic}", type(one), LATCHED) for name, (topic, one) in BROKEN.items()}
    logged: list[str] = []
    with running(NodeOptions(agree=1, domain=domain), room, logged.append):
        for second, (name, (_, message)) in enumerate(BROKEN.items(), 1):
            found = pose_at(robot, second, lambda name=name, message=message: writers[name].publish(message))  # type: ignore[misc]
            assert is_at_truth(found), name
        for expected in (
            "cannot be decoded",
            "/odom: found a twist",
            "/amcl_pose: expected a position",
            "a covariance",
        ):
            wait_until(lambda expected=expected: any(expected in line for line in logged), lambda: logged)  # type: ignore[misc]
            assert sum(expected in line for line in logged if "decoded" not in line) < 3
    with running(NodeOptions(agree=1, domain=domain), room):
        assert is_at_truth(pose_at(robot, 1))


def pose_at(robot: Robot, second: int, before: Callable[[], None] = lambda: None) -> messages.PoseWithCovarianceStamped:
    def play() -> None:
        before()
        robot.mounts.publish(mount())
        robot.scans.publish(scan(second))

    found: messages.PoseWithCovarianceStamped = robot.until(
        robot.poses, play, lambda one: one.header.stamp.sec == second
    )
    return found


def test_a_bad_transform_does_not_lose_those_beside_it(domain: int, room: linefix.MapIndex) -> None:
    bad = transform("base_link", "camera", rotation=messages.Quaternion(0.0, 0.0, 0.0, 0.0)).transforms
    worse = transform("base_link", "imu", translation=messages.Vector3(math.inf)).transforms
    with running(NodeOptions(agree=1, domain=domain), room):
        robot = Robot(domain)
        mixed = messages.TFMessage(bad + mount().transforms + worse)
        for expected in ('"camera" to "base_link" is not used: expected a quaternion of length 1, found 0', '"imu"'):
            robot.until(
                robot.diagnostics,
                lambda: robot.mounts.publish(mixed),
                lambda one, expected=expected: expected in one.status[0].message,  # type: ignore[misc]
            )
        robot.until(robot.initial, lambda: robot.scans.publish(scan(1)))


def test_a_mount_is_taken_after_ever_so_many_frames() -> None:
    frames = Frames()
    for begin in range(0, MAX_FRAMES + 1000, 500):
        many = [transform("base_link", f"tag_{k}").transforms[0] for k in range(begin, begin + 500)]
        assert frames.take(messages.TFMessage(many), static=True) == []
    assert frames.mount("base_link", "tag_0", None) is None
    assert frames.take(mount(), static=True) == []
    assert frames.mount("base_link", "laser", None) is not None


def noise(cells: int) -> messages.OccupancyGrid:
    data = np.random.default_rng(1).choice([0, 100, -1], cells * cells).tolist()
    info = messages.MapMetaData(resolution=0.05, width=cells, height=cells)
    return messages.OccupancyGrid(messages.Header(frame_id="map"), info, data)


@pytest.mark.long
def test_a_map_of_noise_keeps_nothing_from_going_on(domain: int) -> None:
    with bridge("--base", "laser", "--agree", "1") as program:
        robot = Robot(domain)
        robot.maps.publish(noise(1500))
        converting = robot.until(
            robot.diagnostics, lambda: robot.scans.publish(scan(1)), lambda one: "converted" in one.status[0].message
        )
        assert converting.status[0].level == 2
        program.process.send_signal(signal.SIGTERM)
        assert program.process.wait(PATIENCE) == 0


def test_mounts_are_taken_that_are_published_best_effort(domain: int, room: linefix.MapIndex) -> None:
    with running(NodeOptions(agree=1, domain=domain), room):
        robot = Robot(domain)
        mounts = Publisher(robot.net, "/tf_static", messages.TFMessage, STREAM)

        def play() -> None:
            mounts.publish(mount())
            robot.scans.publish(scan(1))

        assert is_at_truth(robot.until(robot.initial, play))


def tilted(degrees: float) -> messages.Quaternion:
    half = 0.5 * math.radians(degrees)
    return messages.Quaternion(0.0, math.sin(half), 0.0, math.cos(half))


UNUSABLE: dict[str, tuple[Callable[[], messages.TFMessage], messages.LaserScan, str]] = {
    "no mount": (messages.TFMessage, scan(1), 'no transform from "laser" to "base_link"'),
    "no step": (mount, replace(scan(1), angle_increment=0.0), 'the scan of "laser" cannot be used'),
    "no frame": (mount, replace(scan(1), header=messages.Header(messages.Time(1))), "empty frame_id"),
    "nothing but unknown ranges": (mount, replace(scan(1), ranges=[math.nan] * 720), "none of 720 ranges is a number"),
    "no range": (mount, replace(scan(1), ranges=[]), "expected at least one range, found none"),
    "steep": (
        lambda: transform("base_link", "laser", rotation=tilted(23.0)),
        scan(1),
        '"laser" is tilted by 23 degrees',
    ),
}


@pytest.mark.parametrize("what", UNUSABLE)
def test_why_a_scan_is_not_used(domain: int, room: linefix.MapIndex, what: str) -> None:
    mounts, seen, expected = UNUSABLE[what]
    with running(NodeOptions(agree=1, domain=domain), room):
        robot = Robot(domain)
        robot.mounts.publish(mounts())
        told = robot.until(
            robot.diagnostics, lambda: robot.scans.publish(seen), lambda one: expected in one.status[0].message
        )
        assert told.status[0].level == 2
        assert robot.poses.take() == []


def test_sigterm_ends_it_during_a_search(domain: int, tmp_path: Any) -> None:
    """Of many walls without order, in which nothing is found for a long time."""
    rng = np.random.default_rng(4)
    begins = rng.uniform(0.0, 60.0, (8000, 2))
    walls = np.hstack([begins, begins + rng.uniform(-2.0, 2.0, (8000, 2))])
    file = tmp_path / "noise.json"
    linefix.write_map(linefix.LineMap(linefix.Segments.from_array(walls)), file)
    ranges = rng.uniform(1.0, 20.0, 60).repeat(12)
    with bridge("--map", str(file), "--base", "laser") as program:
        robot = Robot(domain)

        def searching() -> bool:
            robot.scans.publish(replace(scan(1), ranges=ranges.tolist()))
            return b"first scan" in program.logged

        wait_until(searching, lambda: program.logged)
        program.process.send_signal(signal.SIGTERM)
        assert program.process.wait(PATIENCE) == 0
