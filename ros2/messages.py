"""The messages of ROS 2 that the node receives and publishes, as types of DDS; their names end in ``dds_::Name_``.

Their fields are those of the definitions in ``rosbags``; each has a default: zero, empty, and no rotation.
"""

# Annotations of messages are read while the program runs, so they are no strings here.
import types
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from typing import Any

from cyclonedds import idl
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_typestore

NS = 1_000_000_000
ROS = get_typestore(Stores.ROS2_HUMBLE)  # later ones have the same definitions of these messages
# Cyclone DDS before 11 has no byte; both are one byte.
BASES: dict[str, Any] = {"string": str, "bool": bool, "byte": getattr(idl.types, "byte", idl.types.uint8)}


def _unread(cls: Any, data: bytes, has_header: bool = True, use_version_2: bool | None = None) -> Any:
    """Return a message with its bytes in `serialized`, and its fields empty."""
    made = cls()
    made.serialized = bytes(data)
    return made


@cache
def message(name: str, *, serialized: bool = False) -> Any:
    """Return the type of a message, such as ``std_msgs/msg/Header``; `serialized`: it stays as the bytes that came."""
    package, _, short = name.split("/")
    fields = {one: _field(*kind) for one, kind in ROS.fielddefs[name][1]}

    def fill(namespace: dict[str, Any]) -> None:
        namespace["__annotations__"].update({one: kind for one, (kind, _) in fields.items()})
        namespace.update({one: field(default_factory=default) for one, (_, default) in fields.items()})
        if short == "Quaternion":
            namespace["w"] = 1.0  # as the definition says, of which rosbags leaves defaults out
        if serialized:
            namespace.update(serialized=b"", deserialize=classmethod(_unread))

    made = types.new_class(short, (idl.IdlStruct,), {"typename": f"{package}::msg::dds_::{short}_"}, fill)
    return dataclass(made)


def _field(kind: Nodetype, of: Any) -> tuple[Any, Callable[[], Any]]:
    """Return the type of a field, and what makes its default."""
    if kind is Nodetype.BASE:
        base = BASES.get(of[0]) or getattr(idl.types, of[0])
        return base, base if base in (str, bool) else float if of[0].startswith("float") else int
    if kind is Nodetype.NAME:
        return message(of), message(of)
    (inner, default), count = _field(*of[0]), of[1]
    if kind is Nodetype.ARRAY:
        return idl.types.array[inner, count], lambda: [default() for _ in range(count)]
    return idl.types.sequence[inner], list


Time: Any = message("builtin_interfaces/msg/Time")
Clock: Any = message("rosgraph_msgs/msg/Clock")
Header: Any = message("std_msgs/msg/Header")
Empty: Any = message("std_msgs/msg/Empty")
String: Any = message("std_msgs/msg/String")
ColorRGBA: Any = message("std_msgs/msg/ColorRGBA")
Point: Any = message("geometry_msgs/msg/Point")
Vector3: Any = message("geometry_msgs/msg/Vector3")
Quaternion: Any = message("geometry_msgs/msg/Quaternion")
Pose: Any = message("geometry_msgs/msg/Pose")
PoseWithCovariance: Any = message("geometry_msgs/msg/PoseWithCovariance")
PoseWithCovarianceStamped: Any = message("geometry_msgs/msg/PoseWithCovarianceStamped")
Twist: Any = message("geometry_msgs/msg/Twist")
TwistWithCovariance: Any = message("geometry_msgs/msg/TwistWithCovariance")
Transform: Any = message("geometry_msgs/msg/Transform")
TransformStamped: Any = message("geometry_msgs/msg/TransformStamped")
TFMessage: Any = message("tf2_msgs/msg/TFMessage")
Odometry: Any = message("nav_msgs/msg/Odometry")
MapMetaData: Any = message("nav_msgs/msg/MapMetaData")
OccupancyGrid: Any = message("nav_msgs/msg/OccupancyGrid")
LaserScan: Any = message("sensor_msgs/msg/LaserScan")
KeyValue: Any = message("diagnostic_msgs/msg/KeyValue")
DiagnosticStatus: Any = message("diagnostic_msgs/msg/DiagnosticStatus")
DiagnosticArray: Any = message("diagnostic_msgs/msg/DiagnosticArray")
Marker: Any = message("visualization_msgs/msg/Marker")
MarkerArray: Any = message("visualization_msgs/msg/MarkerArray")
# Most transforms on a topic that robots share are of others, and four million cells take too long to decode at once.
SerializedTransforms: Any = message("tf2_msgs/msg/TFMessage", serialized=True)
SerializedGrid: Any = message("nav_msgs/msg/OccupancyGrid", serialized=True)


def nanoseconds(stamp: Time) -> int:
    """Return a time as one number."""
    return int(stamp.sec) * NS + int(stamp.nanosec)
