"""Connections and raw messages of a recording; bags of ROS 1 and SQLite files of ROS 2, read by rosbags."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from rosbags.rosbag1 import Reader as Reader1
from rosbags.rosbag2 import Reader as Reader2

from ..errors import UnsupportedFormatError
from ..files import name_of

CDR, ROS1 = "cdr", "ros1"  # the encodings that are read here
IN_A_URI = "%?#"  # SQLite is given the path as a URI, in which these have another meaning


@dataclass(frozen=True, slots=True)
class Connection:
    """A topic in one file of a recording.

    Attributes
    ----------
    topic : str
    msgtype : str
        As ROS 2 writes it, such as ``sensor_msgs/msg/LaserScan``; empty where the file does not name it.
    encoding : str
        ``cdr`` of ROS 2 or ``ros1``; others, such as ``json``, are not read.
    msgcount : int
        Number of messages.
    key : object
        Identifier within its file.
    """

    topic: str
    msgtype: str
    encoding: str
    msgcount: int
    key: Any


class Received(NamedTuple):
    """A message: its bytes, as a file has them, or decoded."""

    connection: Connection
    received: int  # ns since the epoch, by the clock of the recorder
    message: Any


def ros_type(name: str) -> str:
    """Return the name of a message type as ROS 2 writes it, from those of ROS 1, C++ and DDS.

    These are ``sensor_msgs/LaserScan``, ``sensor_msgs::msg::LaserScan`` and ``sensor_msgs::msg::dds_::LaserScan_``.
    """
    plain = name.replace("::dds_::", "/").removesuffix("_").replace("::", "/") if "::" in name else name
    package, slash, kind = plain.partition("/")
    return f"{package}/msg/{kind}" if slash and "/" not in kind else plain


class RosbagFile:
    """An open ``.bag`` or ``.db3``.

    Attributes
    ----------
    name : str
    connections : list of Connection
    start : int
        Time of the first message, nanoseconds.

    Raises
    ------
    UnsupportedFormatError
        When a path cannot be given to SQLite.
    """

    def __init__(self, path: Path) -> None:
        self.name = name_of(path)
        first = path.suffix.lower() == ".bag"
        if not first and any(letter in str(path) for letter in IN_A_URI):
            raise UnsupportedFormatError(
                f"has one of the characters {' '.join(IN_A_URI)} in its path, which SQLite does not accept; rename it"
            )
        self._log = path.with_name(path.name + "-wal")
        self._reader: Any = Reader1(path) if first else Reader2(path)
        self._reader.open()
        self._held: list[Any] = list(self._reader.connections)
        self.start = int(self._reader.start_time) if self._reader.message_count else 0
        self.connections = [
            Connection(one.topic, one.msgtype, ROS1 if first else one.ext.serialization_format, one.msgcount, number)
            for number, one in enumerate(self._held)
        ]

    @property
    def remarks(self) -> list[tuple[str, str, int]]:
        """Code, sentence and count of each part of the file that cannot be read."""
        if self._log.is_file() and self._log.stat().st_size:
            said = f"{self._log.name} next to {self.name} is left from a killed recorder and is not read: "
            said += "sqlite3 FILE 'pragma wal_checkpoint' puts its messages into the .db3"
            return [("write_ahead_log", said, 0)]
        return []

    def messages(self, connections: Collection[Connection]) -> Iterator[Received]:
        """Yield the messages of some connections, in the order of the bag."""
        if not connections:
            return
        held = [self._held[one.key] for one in connections]
        known = {one.id: connection for one, connection in zip(held, connections, strict=True)}
        for one, received, data in self._reader.messages(connections=held):
            yield Received(known[one.id], received, bytes(data))

    def close(self) -> None:
        """Close the file."""
        self._reader.close()
