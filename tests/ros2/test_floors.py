"""Several maps over DDS: a robot that leaves a lift on another floor.

Each test has a namespace of its own, because a latched map of a node that has ended would count in the next test.
"""

from __future__ import annotations

import math
from functools import partial
from pathlib import Path
from typing import Any

import pytest

import linefix
from ros2 import NodeOptions, messages
from ros2.topics import LATCHED, RELIABLE, Publisher, Subscription

from .robot import FLOORS, bridge, deliver, floors, mount, running
from .test_fleet import Fleet, amcl_at, moved, stamp_of


class Rider(Fleet):
    """A robot that drives to and fro on a floor; its odometry does not notice a lift."""

    def __init__(self, domain: int, namespace: str, topic: str = "") -> None:
        super().__init__(domain, namespace)
        self.topic = topic or f"{namespace}/linefix/map_id"
        self.transforms = Subscription(self.net, f"{namespace}/tf", messages.TFMessage, RELIABLE)
        self.map_ids = self.map_id_reader()
        self.floor, self.second, self.steps = "hq-1", 1.0, 0
        self.mounts.publish(mount())

    def map_id_reader(self) -> Subscription[messages.String]:
        return Subscription(self.net, self.topic, messages.String, LATCHED)

    @property
    def at(self) -> linefix.RigidTransform:
        return rider_at(self.steps)

    def play(self) -> None:
        self.second, self.steps = self.second + 0.5, self.steps + 1
        self.drive(self.at, self.second, FLOORS[self.floor])

    def until_on(self, floor: str) -> None:
        """Drive on the floor until its map is agreed."""
        self.floor = floor
        assert self.until(self.map_ids, self.play).data == floor


def rider_at(steps: float) -> linefix.RigidTransform:
    return moved(1.0 + 4.0 * (1.0 - math.cos(0.15 * steps)))


def values(status: messages.DiagnosticStatus) -> dict[str, str]:
    return {one.key: one.value for one in status.values}


def test_a_robot_that_leaves_a_lift(domain: int) -> None:
    logged: list[str] = []
    options = NodeOptions(domain=domain, namespace="/lift", publish_tf=True)
    with running(options, floors(), logged.append):
        robot = Rider(domain, "/lift")
        robot.until_on("hq-1")
        robot.until(robot.initial, robot.play)
        robot.until(robot.status, robot.play, lambda one: values(one).get("map_id") == "hq-1")
        walls = robot.until(robot.walls, robot.play)
        assert len(walls.markers[0].points) == 2 * len(FLOORS["hq-1"])
        robot.initial.take()
        robot.until_on("hq-2")
        initial = robot.until(robot.initial, robot.play)
        truth = rider_at(2.0 * (stamp_of(initial) - 1.0))
        assert math.hypot(initial.pose.pose.position.x - truth.x, initial.pose.pose.position.y - truth.y) < 0.05
        robot.until(robot.status, robot.play, partial(is_on, "hq-2", "lift/linefix: localization"))
        robot.until(robot.diagnostics, robot.play, lambda one: is_on("hq-2", "lift/linefix: scan", one.status[0]))
        assert robot.map_id_reader().readers[0].take(10)[0].data == "hq-2"
        assert "the map changed from hq-1 to hq-2" in logged
        assert robot.until(robot.transforms, robot.play).transforms[0].header.frame_id == "map"


def is_on(map_id: str, name: str, status: messages.DiagnosticStatus) -> bool:
    """Return whether a status without a problem is that of a map; those of the map before may come late."""
    assert values(status).get("state") in (None, "agreed") or status.level != 0
    return (status.name, status.level, values(status).get("map_id")) == (name, 0, map_id)


def test_a_localizer_at_the_same_coordinates_of_another_floor_gets_the_pose(domain: int) -> None:
    """AMCL follows the robot on the map of the first floor, so its pose does not differ in numbers."""
    with running(NodeOptions(domain=domain, namespace="/amcl"), floors()):
        robot = Rider(domain, "/amcl")
        amcl = Publisher(robot.net, "/amcl/amcl_pose", messages.PoseWithCovarianceStamped, LATCHED)

        def play() -> None:
            amcl.publish(amcl_at(robot.at, robot.second + 0.5))
            robot.play()

        amcl.publish(amcl_at(robot.at, robot.second))
        deliver(amcl)
        for floor in ("hq-1", "hq-2"):
            robot.floor = floor
            robot.until(robot.initial, play)
            for _ in range(5):
                robot.until(robot.agreed, play)
            assert robot.initial.take() == []
            assert robot.map_ids.take()[-1].data == floor


def has_frame(frame: str, message: Any) -> bool:
    headers = [one.header for name in ("transforms", "markers") for one in getattr(message, name, [])]
    return bool((headers or [message.header])[0].frame_id == frame)


@pytest.mark.long
def test_poses_have_the_frame_of_their_map(domain: int) -> None:
    with running(NodeOptions(domain=domain, namespace="/frames", publish_tf=True), floors(**{"hq-2": "upstairs"})):
        robot = Rider(domain, "/frames")
        for floor, frame in (("hq-1", "map"), ("hq-2", "upstairs")):
            robot.until_on(floor)
            for heard in (robot.initial, robot.agreed, robot.poses, robot.transforms):
                robot.until(heard, robot.play, partial(has_frame, frame))
            markers = robot.until(robot.walls, robot.play, partial(has_frame, frame))
            assert len(markers.markers[0].points) == 2 * len(FLOORS[floor])


def test_a_file_of_parameters_names_the_maps(domain: int, tmp_path: Path) -> None:
    for name, walls in FLOORS.items():
        linefix.write_map(linefix.LineMap(walls), tmp_path / f"{name}.json")
    parameters = tmp_path / "linefix.yaml"
    maps = ", ".join(str(tmp_path / f"{name}.json") for name in FLOORS)
    parameters.write_text(f"linefix:\n  ros__parameters:\n    agree: 1\n    maps: [{maps}]\n")
    with bridge("--namespace", "file", "--params-file", str(parameters)) as started:
        assert b"; map: hq-1, hq-2; " in started.logged
        robot = Rider(domain, "/file")
        for floor in ("hq-1", "hq-2"):
            robot.until_on(floor)
            robot.until(robot.initial, robot.play)
        assert b"the map changed from hq-1 to hq-2" in started.logged
