"""Recordings for tests: an mcap with any channels, written by Foxglove's library, with messages made by rosbags."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from mcap.writer import CompressionType, Writer
from rosbags.typesys import Stores, get_typestore

SECOND = 10**9
BEGUN = 1_600_000_000 * SECOND  # when the recorder received the first message
SCAN, GRID = "sensor_msgs/msg/LaserScan", "nav_msgs/msg/OccupancyGrid"
TYPES = {"cdr": get_typestore(Stores.ROS2_HUMBLE), "ros1": get_typestore(Stores.ROS1_NOETIC)}


@dataclass(frozen=True)
class Laser:
    """Fields of a LaserScan message; 91 beams over half a turn."""

    ranges: Sequence[float] = (2.0,) * 91
    angle_min: float = -np.pi / 2
    angle_max: float = np.pi / 2
    angle_increment: float = np.pi / 90
    range_min: float = 0.1
    range_max: float = 10.0

    def but(self, **fields: Any) -> Laser:
        return replace(self, **fields)


USUAL = Laser()


def header_of(encoding: str, stamp: int, frame: str) -> Any:
    types = TYPES[encoding].types
    time = types["builtin_interfaces/msg/Time"](*divmod(stamp, SECOND))
    return types["std_msgs/msg/Header"](*((0,) if encoding == "ros1" else ()), time, frame)


def scan_bytes(stamp: int, laser: Laser = USUAL, encoding: str = "cdr") -> bytes:
    kind = TYPES[encoding].types[SCAN]
    numbers = laser.angle_min, laser.angle_max, laser.angle_increment, 0.0, 0.1, laser.range_min, laser.range_max
    ranges = np.asarray(laser.ranges, dtype=np.float32)
    message = kind(header_of(encoding, stamp, "laser"), *numbers, ranges, np.zeros(0, dtype=np.float32))
    return encoded(message, SCAN, encoding)


def grid_bytes(
    cells: Any,
    position: tuple[float, float, float] = (0.0, 0.0, 0.0),
    orientation: tuple[float, ...] = (0.0, 0.0, 0.0, 1.0),
) -> bytes:
    types = TYPES["cdr"].types
    pose = types["geometry_msgs/msg/Pose"](
        types["geometry_msgs/msg/Point"](*position), types["geometry_msgs/msg/Quaternion"](*orientation)
    )
    time = types["builtin_interfaces/msg/Time"](0, 0)
    info = types["nav_msgs/msg/MapMetaData"](time, 0.1, cells.shape[1], cells.shape[0], pose)
    return encoded(types[GRID](header_of("cdr", 0, "map"), info, cells.ravel().astype(np.int8)), GRID, "cdr")


def encoded(message: Any, kind: str, encoding: str) -> bytes:
    store = TYPES[encoding]
    return bytes((store.serialize_ros1 if encoding == "ros1" else store.serialize_cdr)(message, kind))


class Recording:
    """Writes an mcap.

    Parameters
    ----------
    path : Path
    profile : str
    chunk : int
        Bytes; 0 for messages without chunks.
    """

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
