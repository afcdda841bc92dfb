"""Which topic of a recording is read."""

from __future__ import annotations

from collections.abc import Mapping

from ..errors import IncompleteFileError
from ..report import Notes, shown
from .bags import SCAN, Bag
from .recording import CDR, ROS1, Connection

# Scans of other types, and what makes LaserScan messages of them.
CONVERTED = {
    "sensor_msgs/msg/PointCloud2": "convert PointCloud2 with pointcloud_to_laserscan, and record its scan",
    "sensor_msgs/msg/MultiEchoLaserScan": "convert MultiEchoLaserScan with laser_proc, and record its first echo",
    "foxglove/msg/LaserScan": "foxglove LaserScan messages are not read; record sensor_msgs/LaserScan",
    "foxglove.LaserScan": "foxglove.LaserScan messages are not read; record sensor_msgs/LaserScan",
}


def scan_connections(bag: Bag, topic: str | None, notes: Notes) -> list[Connection]:
    """Return the connections of one topic of scans: the one that is named, or that with most messages.

    Raises
    ------
    IncompleteFileError
        When there is none; the error names the topics that there are.
    """
    counts = counts_of(bag, SCAN)
    if topic is not None:
        chosen = named_topic(bag, SCAN, topic, counts)
    elif any(counts.values()):
        chosen = max(sorted(counts), key=lambda one: counts[one])
    else:
        hints = [hint for kind, hint in CONVERTED.items() if any(one.msgtype == kind for one in bag.connections())]
        what = "".join(f"; {hint}" for hint in hints)
        raise IncompleteFileError(f"has no messages of LaserScan{what}; {bag.topics()}")
    others = [one for one in sorted(counts) if one != chosen]
    if topic is None and others:
        told = ", ".join(map(shown, others))
        notes.add_assumed("topic", f"LaserScan of {shown(chosen)}, which has most messages; not used: {told}")
    return [one for one in bag.connections(SCAN) if one.topic == chosen]


def counts_of(bag: Bag, kind: str) -> dict[str, int]:
    """Return the number of messages of each topic of a type."""
    counts: dict[str, int] = {}
    for one in bag.connections(kind):
        counts[one.topic] = counts.get(one.topic, 0) + one.msgcount
    return counts


def named_topic(bag: Bag, kind: str, topic: str, counts: Mapping[str, int]) -> str:
    """Return a topic as the recording calls it; the slash in front may be left out.

    Raises
    ------
    IncompleteFileError
        When there is no such topic, it has no messages, or messages of another type.
    """
    short = kind.rpartition("/")[2]
    name = next((one for one in (topic, f"/{topic.lstrip('/')}", topic.lstrip("/")) if one in counts), None)
    if name is not None and counts[name]:
        return name
    other = next((one for one in bag.connections() if one.topic.lstrip("/") == topic.lstrip("/")), None)
    if name is not None:
        wrong = f"has no messages on {shown(name)}"
    elif other is not None:
        code = "" if other.encoding in (CDR, ROS1) else f" as {shown(other.encoding)}"
        wrong = f"has no {short} on {shown(topic)}, which is {shown(other.msgtype) or 'of no type'}{code}"
    else:
        wrong = f"has no {short} on {shown(topic)}"
    raise IncompleteFileError(f"{wrong}; {bag.topics()}")
