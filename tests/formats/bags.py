"""Recordings for tests: messages of either ROS, in bags that rosbags writes and in an mcap of Foxglove's library."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from mcap.writer import CompressionType, Writer
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from formats import Log, LoggedScan, LogOptions, read_log
from registration import RigidTransform

SECOND = 10**9
BEGUN = 1_600_000_000 * SECOND  # when the recorder received the first message
SCAN, GRID, TF = "sensor_msgs/msg/LaserScan", "nav_msgs/msg/OccupancyGrid", "tf2_msgs/msg/TFMessage"
TYPES = {"cdr": get_typestore(Stores.ROS2_HUMBLE), "ros1": get_typestore(Stores.ROS1_NOETIC)}
TYPES["ros1"].register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms", TF))
KINDS = ["bag", "sqlite3", "mcap"]

Place = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
UP: Quaternion = (0.0, 0.0, 0.0, 1.0)


def yawed(radians: float, *, upside_down: bool = False) -> Quaternion:
    s, c = math.sin(radians / 2), math.cos(radians / 2)
    return (c, s, 0.0, 0.0) if upside_down else (0.0, 0.0, s, c)


def pitched(degrees: float) -> Quaternion:
    half = math.radians(degrees) / 2
    return (0.0, math.sin(half), 0.0, math.cos(half))


def near(pose: RigidTransform | None, x: float, y: float, theta: float) -> bool:
    assert pose is not None
    return np.allclose([pose.x, pose.y, pose.theta], [x, y, theta], atol=1e-6)


@dataclass(frozen=True)
class Laser:
    """Fields of a LaserScan message; 91 beams over half a turn."""

    ranges: Sequence[float] = (2.0,) * 91
    angle_min: float = -np.pi / 2
    angle_max: float = np.pi / 2
    angle_increment: float = np.pi / 90
    range_min: float = 0.1
    range_max: float = 10.0
    time_increment: float = 0.0
    scan_time: float = 0.1

    def but(self, **fields: Any) -> Laser:
        return replace(self, **fields)


USUAL = Laser()
FOUR_BEAMS = Laser((1.0, np.inf, np.nan, 2.0), -0.2, 0.1, 0.1, 0.05, 10.0, 0.001)


@dataclass(frozen=True)
class Messages:
    """Makes messages, encoded as of ROS 1 or as CDR."""

    encoding: str = "cdr"

    def type(self, name: str, *values: Any) -> Any:
        return TYPES[self.encoding].types[name](*values)

    def geometry(self, name: str, *values: Any) -> Any:
        return self.type(f"geometry_msgs/msg/{name}", *values)

    def header(self, ns: int, frame: str) -> Any:
        stamp = self.type("builtin_interfaces/msg/Time", *divmod(ns, SECOND))
        return self.type("std_msgs/msg/Header", *((0,) if self.encoding == "ros1" else ()), stamp, frame)

    def pose(self, place: Place, turn: Quaternion) -> Any:
        return self.geometry("Pose", self.geometry("Point", *place), self.geometry("Quaternion", *turn))

    def scan(self, ns: int, laser: Laser = USUAL, frame: str = "laser") -> bytes:
        one, nothing = laser, np.zeros(0, dtype=np.float32)
        angles, times = (one.angle_min, one.angle_max, one.angle_increment), (one.time_increment, one.scan_time)
        ranges = one.range_min, one.range_max, np.asarray(one.ranges, dtype=np.float32), nothing
        return self.encoded(self.type(SCAN, self.header(ns, frame), *angles, *times, *ranges), SCAN)

    def grid(self, cells: Any, place: Place = (0.0, 0.0, 0.0), turn: Sequence[float] = UP, frame: str = "map") -> bytes:
        """Cells of 0.1 m."""
        time, (rows, columns) = self.type("builtin_interfaces/msg/Time", 0, 0), cells.shape
        pose = self.geometry("Pose", self.geometry("Point", *place), self.geometry("Quaternion", *turn))
        info = self.type("nav_msgs/msg/MapMetaData", time, 0.1, columns, rows, pose)
        return self.encoded(self.type(GRID, self.header(0, frame), info, cells.ravel().astype(np.int8)), GRID)

    def encoded(self, message: Any, kind: str) -> bytes:
        store = TYPES[self.encoding]
        return bytes((store.serialize_ros1 if self.encoding == "ros1" else store.serialize_cdr)(message, kind))


def room_cells() -> Any:
    """Return the cells of a grid of a room of 4 by 3 m."""
    cells = np.full((50, 60), -1)
    cells[9:41, 9:51] = 100
    cells[10:40, 10:50] = 0
    return cells


scan_bytes, grid_bytes = Messages().scan, Messages().grid


class Recording:
    """An mcap of any channels; `chunk` in bytes, 0 for messages without chunks."""

    def __init__(
        self,
        path: Path,
        profile: str = "ros2",
        chunk: int = 4096,
        compression: CompressionType = CompressionType.NONE,
        **options: Any,
    ) -> None:
        self.path = path
        self._writer = Writer(
            str(path), chunk_size=max(1, chunk), use_chunking=chunk > 0, compression=compression, **options
        )
        self._writer.start(profile=profile, library="")
        self._channels: dict[str, int] = {}

    def put(
        self, topic: str, received: int, data: bytes, kind: str = SCAN, encoding: str = "cdr", schema: str = "ros2msg"
    ) -> None:
        self.channel(topic, kind, encoding, schema)
        self._writer.add_message(self._channels[topic], received, data, received)

    def channel(self, topic: str, kind: str = SCAN, encoding: str = "cdr", schema: str = "ros2msg") -> None:
        if topic not in self._channels:
            known = self._writer.register_schema(kind, schema, b"") if kind else 0
            self._channels[topic] = self._writer.register_channel(topic, encoding, known)

    def scans(self, count: int, topic: str = "/scan", laser: Laser = USUAL) -> None:
        for k in range(count):
            self.put(topic, BEGUN + k * SECOND, scan_bytes(BEGUN + k * SECOND, laser))

    def done(self) -> Path:
        self._writer.finish()  # type: ignore[no-untyped-call]
        return self.path


class Robots:
    """A bag of either ROS with scans, transforms and odometry of any topics; what writes to it returns it."""

    def __init__(self, kind: str, folder: Path) -> None:
        self.messages = Messages("ros1" if kind == "bag" else "cdr")
        self.path = folder / ("robot.bag" if kind == "bag" else f"robot_{kind}")
        plugin = StoragePlugin.MCAP if kind == "mcap" else StoragePlugin.SQLITE3
        self.writer: Any = Writer1(self.path) if kind == "bag" else Writer2(self.path, version=9, storage_plugin=plugin)
        self.topics: dict[str, Any] = {}
        self.writer.open()

    def write(self, topic: str, kind: str, ns: int, data: bytes) -> Robots:
        if topic not in self.topics:
            self.topics[topic] = self.writer.add_connection(topic, kind, typestore=TYPES[self.messages.encoding])
        self.writer.write(self.topics[topic], ns, data)
        return self

    def scan(self, ns: int, topic: str = "/scan", frame: str = "laser", laser: Laser = FOUR_BEAMS) -> Robots:
        return self.write(topic, SCAN, ns, self.messages.scan(ns, laser, frame))

    def transform(
        self, topic: str, ns: int, parent: str, child: str, place: Place = (0.0, 0.0, 0.0), turn: Quaternion = UP
    ) -> Robots:
        make = self.messages
        value = make.geometry("Transform", make.geometry("Vector3", *place), make.geometry("Quaternion", *turn))
        one = make.geometry("TransformStamped", make.header(ns, parent), child, value)
        return self.write(topic, TF, ns, make.encoded(make.type(TF, [one]), TF))

    def fixed(self, *chain: str, topic: str = "/tf_static") -> Robots:
        for parent, child in pairwise(chain):
            self.transform(topic, 0, parent, child, (0.2, 0.0, 0.3))
        return self

    def drive(self, topic: str, parent: str, child: str, speed: float = 1.0) -> Robots:
        for k in range(5):
            self.transform(topic, k * SECOND // 2, parent, child, (0.5 * speed * k, 0.0, 0.0))
        return self

    def rotate(self, parent: str, child: str, step: float) -> Robots:
        for k in range(5):
            self.transform("/tf", k * SECOND // 2, parent, child, (0.1, 0.0, 0.0), yawed(step * k))
        return self

    def says(self, ns: int, x: float, child: str = "base_link", topic: str = "/odom", turn: Quaternion = UP) -> Robots:
        kind, make = "nav_msgs/msg/Odometry", self.messages
        zero, sure = make.geometry("Vector3", 0.0, 0.0, 0.0), np.zeros(36)
        speed = make.geometry("TwistWithCovariance", make.geometry("Twist", zero, zero), sure)
        pose = make.geometry("PoseWithCovariance", make.pose((x, 0.0, 0.0), turn), sure)
        message = make.type(kind, make.header(ns, "odom"), child, pose, speed)
        return self.write(topic, kind, ns, make.encoded(message, kind))

    def done(self) -> Path:
        self.writer.close()
        return self.path


def read(bag: Robots, options: LogOptions | None = None) -> tuple[list[LoggedScan], Log]:
    log = read_log(bag.done(), options or LogOptions())
    return list(log), log
