"""The bridge receives a robot that plays a bag, and says where it is."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.rosbag2 import Reader, Writer
from rosbags.typesys import Stores, get_typestore

import linefix
from cli.entry import run
from ros2 import NodeOptions, messages
from ros2.topics import LATCHED, RELIABLE, Publisher

from .robot import BASE_FROM_LASER, MAP_FROM_BASE, Robot, bridge, grid_of_room, is_at_truth, mount, running, scan

TYPES = get_typestore(Stores.ROS2_HUMBLE)


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


@pytest.mark.long
def test_a_bag_that_is_played_gives_an_initial_pose(domain: int, map_file: str, tmp_path: Path) -> None:
    kinds: dict[str, Any] = {"/tf_static": messages.TFMessage, "/scan": messages.LaserScan}
    with bridge("--map", map_file, "--agree", "1"):
        robot = Robot(domain)
        with Reader(bag(tmp_path)) as reader:
            played = [(c.topic, kinds[c.topic].deserialize(raw)) for c, _, raw in reader.messages()]
        robot.mounts.publish(played[0][1])
        blind, *seeing = [message for _, message in played[1:]]
        said = robot.until(
            robot.diagnostics,
            lambda: robot.scans.publish(blind),
            lambda one: one.header.stamp.sec == 1 and "no transform" not in one.status[0].message,
        )
        assert said.status[0].level == 1
        assert robot.initial.take() == []
        robot.scans.publish(seeing[0])
        found = robot.until(robot.initial, lambda: None)
    assert found.header.stamp.sec == 2  # the first scan that is usable
    assert is_at_truth(found)
    assert found.header.frame_id == "map"
    assert found.header.stamp.nanosec == 5
    covariance = np.reshape(found.pose.covariance, (6, 6))
    assert (np.diag(covariance)[[0, 1, 5]] > 0.0).all()
    assert (np.diag(covariance)[[2, 3, 4]] == 0.0).all()


def test_it_is_silent_until_asked_again(domain: int, room: linefix.MapIndex) -> None:
    with running(NodeOptions(domain=domain, agree=1), room):
        robot = Robot(domain)
        robot.mounts.publish(mount())
        robot.until(robot.initial, lambda: robot.scans.publish(scan(1)))
        robot.until(robot.poses, lambda: robot.scans.publish(scan(2)), lambda one: one.header.stamp.sec == 2)
        assert robot.initial.take() == []
        robot.asking.publish(messages.Empty())
        again = robot.until(robot.initial, lambda: robot.scans.publish(scan(3)))
        assert again.header.stamp.sec in (2, 3)  # a scan that was published again may be searched after the request
        assert {one.markers[0].ns for one in robot.walls.take()} == {"linefix/map"}


@pytest.mark.parametrize(
    "quality", [LATCHED, pytest.param(RELIABLE, marks=pytest.mark.long)], ids=["latched", "volatile"]
)
def test_the_map_may_come_as_a_grid(domain: int, quality: Any) -> None:
    """And a scanner that has the robot's own frame needs no mount."""
    with running(NodeOptions(domain=domain, agree=1, base="laser", map_topic="map"), None):
        robot = Robot(domain)
        maps = Publisher(robot.net, "/map", messages.OccupancyGrid, quality)
        robot.until(robot.diagnostics, lambda: robot.scans.publish(scan(1)))
        maps.publish(grid_of_room("floor"))
        found = robot.until(robot.initial, lambda: robot.scans.publish(scan(1)))
    truth = MAP_FROM_BASE.compose(BASE_FROM_LASER)
    assert found.header.frame_id == "floor"
    assert math.hypot(found.pose.pose.position.x - truth.x, found.pose.pose.position.y - truth.y) < 0.05


def test_a_stored_map_is_taken_by_its_id(
    domain: int, map_file: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("LINEFIX_DATA_DIR", str(tmp_path / "data"))
    assert run(["map", "put", "hq-3", map_file]) == 0
    with bridge("--map", "hq-3", "--agree", "1"):
        robot = Robot(domain)
        robot.mounts.publish(mount())
        assert is_at_truth(robot.until(robot.initial, lambda: robot.scans.publish(scan(2))))


def test_each_scan_is_searched_with_the_options_of_the_node(
    domain: int, room: linefix.MapIndex, monkeypatch: pytest.MonkeyPatch
) -> None:
    searched: list[linefix.AssociationOptions] = []
    search = linefix.locate

    def spied(*arguments: Any, options: linefix.AssociationOptions, **named: Any) -> linefix.AssociationResult:
        searched.append(options)
        return search(*arguments, options=options, **named)

    monkeypatch.setattr(linefix, "locate", spied)
    with running(NodeOptions(domain=domain, agree=1, on_map=0.6, usable_from=0.7), room):
        robot = Robot(domain)
        robot.mounts.publish(mount())
        robot.until(robot.initial, lambda: robot.scans.publish(scan(1)))
    assert {(one.on_map, one.usable_from, one.max_alternatives) for one in searched} == {(0.6, 0.7, 10)}
