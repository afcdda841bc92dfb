"""The messages of ROS 2 that the node receives and publishes, as types of DDS; their names end in ``dds_::Name_``.

Each is an attribute of this module, such as ``messages.LaserScan``. Its fields are those of the definition in
``rosbags``; each has a default: zero, empty, and no rotation.
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


NAMES = {name.rpartition("/")[2]: name for name in ROS.fielddefs}


def __getattr__(name: str) -> Any:
    """Return the type of a message by its short name, such as ``LaserScan``."""
    if name not in NAMES:
        raise AttributeError(f"found no message {name}")
    return message(NAMES[name])


# Most transforms on a topic that robots share are of others, and four million cells take too long to decode at once.
SerializedTransforms: Any = message("tf2_msgs/msg/TFMessage", serialized=True)
SerializedGrid: Any = message("nav_msgs/msg/OccupancyGrid", serialized=True)


def nanoseconds(stamp: Any) -> int:
    """Return a ``Time`` as one number."""
    return int(stamp.sec) * NS + int(stamp.nanosec)
