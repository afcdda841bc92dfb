"""Every message has the bytes that rosbags gives it, filled with numbers that differ everywhere."""

from __future__ import annotations

from itertools import count
from typing import Any

import numpy as np
import pytest
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_typestore

from ros2 import messages

TYPES = get_typestore(Stores.ROS2_HUMBLE)
USED = (
    "Clock ColorRGBA DiagnosticArray DiagnosticStatus Empty Header KeyValue LaserScan MapMetaData Marker MarkerArray "
    "OccupancyGrid Odometry Point Pose PoseWithCovariance PoseWithCovarianceStamped Quaternion String TFMessage Time "
    "Transform TransformStamped Twist TwistWithCovariance Vector3"
)


def filled(name: str, numbers: Any) -> tuple[Any, Any]:
    """Return a message of ours and the same of rosbags."""
    ours, theirs = {}, {}
    for field, described in TYPES.get_msgdef(name).fields:
        ours[field], theirs[field] = value(described, numbers)
    return messages.message(name)(**ours), TYPES.types[name](**theirs)


def value(described: Any, numbers: Any) -> tuple[Any, Any]:
    kind, detail = described
    if kind == Nodetype.NAME:
        return filled(detail, numbers)
    if kind == Nodetype.BASE:
        base = detail[0]
        number = next(numbers)
        if base == "string":
            return f"text {number}", f"text {number}"
        if base == "bool":
            return bool(number % 2), bool(number % 2)
        return (number + 0.5, number + 0.5) if base.startswith("float") else (number, number)
    inner, length = detail
    made = [value(inner, numbers) for _ in range(length or 3)]
    if inner[0] == Nodetype.BASE and inner[1][0] != "string":
        return [one for one, _ in made], np.array([one for one, _ in made], dtype=inner[1][0])
    return [one for one, _ in made], [other for _, other in made]


@pytest.mark.parametrize("short", USED.split())
def test_its_bytes_are_those_of_rosbags(short: str) -> None:
    name = messages.NAMES[short]
    ours, theirs = filled(name, count(1))
    assert ours.serialize() == bytes(TYPES.serialize_cdr(theirs, name))
    assert type(ours).deserialize(ours.serialize()) == ours


def test_a_scan_has_72_bytes() -> None:
    scan = messages.LaserScan(messages.Header(messages.Time(1, 2), "laser"), ranges=[1.0, 2.0, 3.0])
    assert len(scan.serialize()) == 72


def test_a_serialized_grid_has_the_bytes_of_the_grid() -> None:
    grid = messages.OccupancyGrid(messages.Header(messages.Time(1, 2), "map"), data=[0, 100, -1])
    kept = messages.SerializedGrid.deserialize(grid.serialize())
    assert messages.OccupancyGrid.deserialize(kept.serialized) == grid
