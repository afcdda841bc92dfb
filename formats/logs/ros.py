"""Scans of ROS bags."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

from registration import InputError
from vectorization import LaserScan

from ..files import name_of
from ..report import Notes, shown
from .bags import ODOMETRY, OLD_TRANSFORMS, TRANSFORMS, Bag, opened
from .lasers import laser_of
from .scan import Log, LoggedScan, LogOptions, none_usable
from .stamps import Stamps
from .topics import scan_connections
from .transforms import Transforms, matrix_of, planar, stamp_of

STATIC = "tf_static"
BASES = ("base_link", "base_footprint")
ODOM = "odom"


def read_bag(path: Path, options: LogOptions) -> Log:
    """Open the scans of a bag; poses come from tf, or from odometry where that has no way to the sensor.

    Raises
    ------
    FormatError
        When it is no bag, or has no scans; while iterating, when it is broken.
    """
    with opened(path) as bag:
        form = bag.format
        count = sum(c.msgcount for c in scan_connections(bag, options.topic, Notes()))
    return Log(form, name_of(path), partial(_scans, path, options), count)


def _scans(path: Path, options: LogOptions, notes: Notes) -> Iterator[LoggedScan]:
    with opened(path, notes) as bag:
        wanted = scan_connections(bag, options.topic, notes)
        frames = _transforms(bag, notes)
        stamps, first = Stamps(notes), ""
        for connection, received, message in bag.received(wanted):
            try:
                laser = laser_of(message, notes)
            except InputError as error:
                first = first or error.message
                notes.add_dropped("broken_scan", f"scans that cannot be used, such as: {error.message}", 1)
                continue
            scan = _scan(
                connection.topic, message, laser, stamps.of(stamp_of(message.header), received), frames, options
            )
            if scan.pose is None:
                notes.add_dropped("no_pose", "scans whose pose the log does not say (they are kept)", 1)
            notes.add_read("scans", f"scans of {shown(connection.topic)}", 1)
            yield scan
        if "scans" not in notes.read:
            raise none_usable(bag.name, notes, first)


def _transforms(bag: Bag, notes: Notes) -> Transforms:
    frames = Transforms(bag.name)
    moving = set()
    for connection, message in bag.messages(bag.connections(TRANSFORMS, OLD_TRANSFORMS)):
        static = connection.topic.strip("/") == STATIC
        for one in message.transforms:
            matrix = matrix_of(one.transform.translation, one.transform.rotation)
            frames.add(one.header.frame_id, one.child_frame_id, stamp_of(one.header), matrix, static=static)
            moving.add(one.child_frame_id.strip("/"))
        notes.add_read("transforms", "messages of tf", 1)
    for _connection, message in bag.messages(bag.connections(ODOMETRY)):
        child = message.child_frame_id.strip("/") or BASES[0]
        if child not in moving:
            pose = message.pose.pose
            matrix = matrix_of(pose.position, pose.orientation)
            frames.add(message.header.frame_id or ODOM, child, stamp_of(message.header), matrix, static=False)
            notes.add_read("odometry", "messages of odometry", 1)
    return frames


def _scan(
    topic: str, message: Any, laser: LaserScan, stamp: int, frames: Transforms, options: LogOptions
) -> LoggedScan:
    frame = str(message.header.frame_id)
    above = frames.above(frame)
    outer = (options.pose_frame or (ODOM if ODOM in above else above[-1])).strip("/")
    base = next((b for b in BASES if b in above), None)
    known = frames.lookup(outer, frame, stamp) if len(above) > 1 else None
    mounted = frames.lookup(base, frame, stamp) if base else None
    pose, flipped = planar(known) if known is not None else (None, False)
    mount, upside_down = planar(mounted) if mounted is not None else (None, flipped)
    return LoggedScan(
        stamp, topic, shown(frame), laser, float(message.time_increment), pose, outer if pose else "", mount,
        flipped or upside_down, base if base and mount else "",
    )  # fmt: skip
