"""Bags of robots: transforms and odometry of any topic, and what is read of them."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from formats import Log, LoggedScan, LogOptions, read_log

from .test_logs import SECOND, Recorder

Quaternion = tuple[float, float, float, float]
UP: Quaternion = (0.0, 0.0, 0.0, 1.0)


def pitched(degrees: float) -> Quaternion:
    half = math.radians(degrees) / 2
    return (0.0, math.sin(half), 0.0, math.cos(half))


class Robots(Recorder):
    """Writes transforms of any topic."""

    def transform(
        self,
        topic: str,
        ns: int,
        parent: str,
        child: str,
        place: tuple[float, float, float] = (0.0, 0.0, 0.0),
        turn: Quaternion = UP,
    ) -> None:
        value = self.type(
            "geometry_msgs/msg/Transform",
            self.point("Vector3", *place),
            self.type("geometry_msgs/msg/Quaternion", *turn),
        )
        one = self.type("geometry_msgs/msg/TransformStamped", self.header(ns, parent), child, value)
        kind = "tf2_msgs/msg/TFMessage"
        self.write(topic, kind, ns, self.type(kind, [one]))

    def drive(self, topic: str, parent: str, child: str, speed: float = 1.0) -> None:
        for k in range(5):
            self.transform(topic, k * SECOND // 2, parent, child, (0.5 * speed * k, 0.0, 0.0))

    def says(self, ns: int, x: float, child: str = "base_link", topic: str = "/odom", turn: Quaternion = UP) -> None:
        kind = "nav_msgs/msg/Odometry"
        place = self.type(
            "geometry_msgs/msg/Pose", self.point("Point", x, 0.0), self.type("geometry_msgs/msg/Quaternion", *turn)
        )
        zero, sure = self.point("Vector3", 0.0, 0.0), np.zeros(36)
        twist = self.type("geometry_msgs/msg/Twist", zero, zero)
        pose = self.type("geometry_msgs/msg/PoseWithCovariance", place, sure)
        speed = self.type("geometry_msgs/msg/TwistWithCovariance", twist, sure)
        self.write(topic, kind, ns, self.type(kind, self.header(ns, "odom"), child, pose, speed))


def fixed(bag: Robots, *chain: str, topic: str = "/tf_static") -> None:
    for parent, child in pairwise(chain):
        bag.transform(topic, 0, parent, child, (0.2, 0.0, 0.3))


def codes(log: Log) -> dict[str, int]:
    report = log.report
    return {note.code: note.count for note in (*report.dropped, *report.assumed)}


def read(bag: Robots, options: LogOptions | None = None) -> tuple[list[LoggedScan], Log]:
    log = read_log(bag.done(), options or LogOptions())
    return list(log), log
