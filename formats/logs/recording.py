"""Connections and raw messages, as the files of a recording have them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

CDR, ROS1 = "cdr", "ros1"  # the encodings that are read here


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
    file : str
        Name of the file.
    """

    topic: str
    msgtype: str
    encoding: str
    msgcount: int
    key: Any
    file: str


class RawMessage(NamedTuple):
    """A message before it is decoded."""

    connection: Connection
    received: int  # ns since the epoch, by the clock of the recorder
    data: bytes


def ros_type(name: str) -> str:
    """Return the name of a message type as ROS 2 writes it, from those of ROS 1, C++ and DDS.

    These are ``sensor_msgs/LaserScan``, ``sensor_msgs::msg::LaserScan`` and ``sensor_msgs::msg::dds_::LaserScan_``.
    """
    plain = name.replace("::dds_::", "/").removesuffix("_").replace("::", "/") if "::" in name else name
    package, slash, kind = plain.partition("/")
    return f"{package}/msg/{kind}" if slash and "/" not in kind else plain
