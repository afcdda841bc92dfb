"""The bridge in a process of its own, and a robot beside it that plays a bag: both over loopback."""

from __future__ import annotations

import math
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.rosbag2 import Reader, Writer
from rosbags.typesys import Stores, get_typestore

import linefix
from bridge import messages
from bridge.wire import LATCHED, RELIABLE, SENSOR, Heard, Told

ROOT = Path(__file__).parent.parent.parent
TYPES = get_typestore(Stores.ROS2_HUMBLE)
LOOPBACK = (
    "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name='lo' multicast='true'/></Interfaces></General>"
    "<Discovery><ParticipantIndex>auto</ParticipantIndex></Discovery></Domain></CycloneDDS>"
)
PATIENCE = 60.0  # s for what has to come about

ROOM = np.array([[0, 0, 6, 0], [6, 0, 6, 2], [6, 2, 4, 2], [4, 2, 4, 5], [4, 5, 0, 5], [0, 5, 0, 0]], dtype=float)
MAP_FROM_BASE = linefix.RigidTransform(1.0, 1.5, 0.4)
BASE_FROM_LASER = linefix.RigidTransform(0.3, -0.1, 2.0)
SCANNER = linefix.simulation.Scanner(beams=720, sigma=0.01)


def quaternion(theta: float) -> messages.Quaternion:
    return messages.Quaternion(0.0, 0.0, math.sin(0.5 * theta), math.cos(0.5 * theta))


def mount(child: str = "laser") -> messages.TFMessage:
    place = messages.Transform(
        messages.Vector3(BASE_FROM_LASER.x, BASE_FROM_LASER.y, 0.2), quaternion(BASE_FROM_LASER.theta)
    )
    return messages.TFMessage([messages.TransformStamped(messages.Header(frame_id="base_link"), child, place)])


def scan(second: int, *, seen: bool = True) -> messages.LaserScan:
    """Return what the robot sees; `seen` False: nothing within its range."""
    truth = MAP_FROM_BASE.compose(BASE_FROM_LASER)
    walls = linefix.Segments.from_array(ROOM)
    ranges = linefix.simulation.scan(walls, truth, SCANNER, np.random.default_rng(second)).ranges
    return messages.LaserScan(
        messages.Header(messages.Time(second, 5), "laser"),
        SCANNER.angle_min, SCANNER.angle_min + 719 * SCANNER.angle_increment, SCANNER.angle_increment,
        range_min=0.05, range_max=30.0, ranges=ranges.tolist() if seen else [math.inf] * 720,
    )  # fmt: skip


@pytest.fixture
def domain(monkeypatch: pytest.MonkeyPatch, worker_id: str) -> int:
    number = 100 + int(worker_id.removeprefix("gw") or 0) if worker_id != "master" else 100
    monkeypatch.setenv("CYCLONEDDS_URI", LOOPBACK)
    monkeypatch.setenv("ROS_DOMAIN_ID", str(number))
    return number


@contextmanager
def bridge(*arguments: str) -> Iterator[subprocess.Popen[str]]:
    program = "import sys; from service.commands.entry import run; sys.exit(run(['ros2', *sys.argv[1:]]))"
    process = subprocess.Popen(
        [sys.executable, "-c", program, *arguments], cwd=ROOT, env=dict(os.environ), stderr=subprocess.PIPE, text=True
    )
    try:
        assert process.stderr is not None
        assert "listening" in process.stderr.readline()
        yield process
        process.send_signal(signal.SIGTERM)
        assert process.wait(PATIENCE) == 0
    finally:
        process.kill()
        process.communicate()


class Robot:
    """The topics of a robot, and what the bridge says to it."""

    def __init__(self, domain: int) -> None:
        from cyclonedds.domain import DomainParticipant

        net = DomainParticipant(domain)
        self.scans = Told(net, "/scan", messages.LaserScan, SENSOR)
        self.mounts = Told(net, "/tf_static", messages.TFMessage, LATCHED)
        self.maps = Told(net, "/map", messages.OccupancyGrid, LATCHED)
        self.asking = Told(net, "/linefix/locate", messages.Empty, RELIABLE)
        self.initial = Heard(net, "/initialpose", messages.PoseWithCovarianceStamped, RELIABLE)
        self.poses = Heard(net, "/linefix/pose", messages.PoseWithCovarianceStamped, RELIABLE)
        self.markers = Heard(net, "/linefix/markers", messages.MarkerArray, LATCHED)
        self.diagnostics = Heard(net, "/diagnostics", messages.DiagnosticArray, RELIABLE)

    def until(self, heard: Heard[Any], play: Callable[[], None], wanted: Callable[[Any], bool] = bool) -> Any:
        """Play again and again until something wanted is heard; return it."""
        ends = time.monotonic() + PATIENCE
        while time.monotonic() < ends:
            play()
            time.sleep(0.05)
            for message in heard.take():
                if wanted(message):
                    return message
        raise AssertionError(f"nothing on {heard.name}; told: {self.diagnostics.take()}")


@pytest.fixture
def map_file(tmp_path: Path) -> str:
    file = tmp_path / "room.json"
    linefix.write_map(linefix.LineMap(linefix.Segments.from_array(ROOM)), file)
    return str(file)


def is_at_truth(message: messages.PoseWithCovarianceStamped) -> bool:
    at, turn = message.pose.pose.position, message.pose.pose.orientation
    away = math.hypot(at.x - MAP_FROM_BASE.x, at.y - MAP_FROM_BASE.y)
    return away < 0.03 and abs(2.0 * math.atan2(turn.z, turn.w) - MAP_FROM_BASE.theta) < 0.02


def bag(folder: Path) -> Path:
    """Write a bag of ROS 2: the mount, a scan that sees nothing, then scans that see the room."""
    path = folder / "bag"
    with Writer(path, version=8) as writer:
        static = writer.add_connection("/tf_static", "tf2_msgs/msg/TFMessage", typestore=TYPES)
        scans = writer.add_connection("/scan", "sensor_msgs/msg/LaserScan", typestore=TYPES)
        writer.write(static, 0, mount().serialize())
        for second in range(1, 9):
            writer.write(scans, second * 10**9, scan(second, seen=second > 1).serialize())
    return path


def test_a_bag_that_is_played_gives_an_initial_pose(domain: int, map_file: str, tmp_path: Path) -> None:
    kinds: dict[str, Any] = {"/tf_static": messages.TFMessage, "/scan": messages.LaserScan}
    with bridge("--map", map_file):
        robot = Robot(domain)
        with Reader(bag(tmp_path)) as reader:
            played = [(c.topic, kinds[c.topic].deserialize(raw)) for c, _, raw in reader.messages()]
        robot.mounts.say(played[0][1])
        blind, *seeing = [message for _, message in played[1:]]
        said = robot.until(
            robot.diagnostics,
            lambda: robot.scans.say(blind),
            lambda one: one.header.stamp.sec == 1 and "tf_static" not in one.status[0].message,
        )
        assert said.status[0].level == 1
        assert robot.initial.take() == []
        robot.scans.say(seeing[0])
        found = robot.until(robot.initial, lambda: None)
    assert found.header.stamp.sec == 2  # the first scan that is usable
    assert is_at_truth(found)
    assert found.header.frame_id == "map"
    assert found.header.stamp.nanosec == 5
    covariance = np.reshape(found.pose.covariance, (6, 6))
    assert (np.diag(covariance)[[0, 1, 5]] > 0.0).all()
    assert (np.diag(covariance)[[2, 3, 4]] == 0.0).all()


def test_it_is_silent_until_asked_again(domain: int, map_file: str) -> None:
    with bridge("--map", map_file):
        robot = Robot(domain)
        robot.mounts.say(mount())
        robot.until(robot.initial, lambda: robot.scans.say(scan(1)))
        robot.until(robot.poses, lambda: robot.scans.say(scan(2)), lambda one: one.header.stamp.sec == 2)
        assert robot.initial.take() == []
        robot.asking.say(messages.Empty())
        again = robot.until(robot.initial, lambda: robot.scans.say(scan(3)))
        assert again.header.stamp.sec == 3
        assert robot.markers.take()[0].markers[0].ns == "linefix/map"


def test_without_a_mount_it_says_what_is_missing(domain: int, map_file: str) -> None:
    with bridge("--map", map_file):
        robot = Robot(domain)
        said = robot.until(robot.diagnostics, lambda: robot.scans.say(scan(1)))
        assert said.status[0].level == 2
        assert "/tf_static does not say where laser is in base_link" in said.status[0].message
        assert robot.poses.take() == []


def test_the_map_may_come_as_a_grid(domain: int) -> None:
    """And a scanner that has the robot's own frame needs no mount."""
    size, cell = 140, 0.05
    x, y = np.meshgrid(*[np.arange(size) * cell + 0.5 * cell - 0.5] * 2)
    free = (x > 0) & (y > 0) & (((x < 6) & (y < 2)) | ((x < 4) & (y < 5)))
    near = np.zeros_like(free)
    for dx in (-1, 0, 1):
        for dy in (-1, 0, 1):
            near |= np.roll(free, (dy, dx), (0, 1))
    cells = np.where(free, 0, np.where(near, 100, -1)).ravel().tolist()
    info = messages.MapMetaData(resolution=cell, width=size, height=size)
    info.origin.position = messages.Point(-0.5, -0.5, 0.0)
    with bridge("--base", "laser"):
        robot = Robot(domain)
        robot.maps.say(messages.OccupancyGrid(messages.Header(frame_id="floor"), info, cells))
        found = robot.until(robot.initial, lambda: robot.scans.say(scan(1)))
    truth = MAP_FROM_BASE.compose(BASE_FROM_LASER)
    assert found.header.frame_id == "floor"
    assert math.hypot(found.pose.pose.position.x - truth.x, found.pose.pose.position.y - truth.y) < 0.05


def test_what_is_broken_is_told_and_the_next_is_answered(domain: int, map_file: str) -> None:
    with bridge("--map", map_file):
        robot = Robot(domain)
        turned = mount()
        turned.transforms[0].transform.rotation = messages.Quaternion(0.0, 0.0, 0.0, 0.0)
        robot.until(
            robot.diagnostics, lambda: robot.mounts.say(turned), lambda one: "mount is not" in one.status[0].message
        )
        robot.mounts.say(mount())
        broken = scan(1)
        broken.angle_increment = 0.0
        robot.until(
            robot.diagnostics, lambda: robot.scans.say(broken), lambda one: "scan is not" in one.status[0].message
        )
        robot.until(robot.initial, lambda: robot.scans.say(scan(2)))
