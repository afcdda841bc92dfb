"""Scans and grids of ROS bags."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.interfaces import Connection

from registration import InputError, RigidTransform
from vectorization import LaserScan

from ..errors import IncompleteFileError, MalformedFileError, TooLargeError, UprightFrameError
from ..files import name_of
from ..grids.cells import Grid
from ..limits import MAX_CELLS, MAX_RESOLUTION, MIN_RESOLUTION
from ..report import Notes, shown
from .bags import GRID, SCAN, Bag, opened
from .scan import Log, LoggedScan, LogOptions
from .sensors import Sensor, Sensors, note_tilt, time_increment_of
from .transforms import matrix_of, planar, stamp_of
from .trees import read_frames


def read_bag(path: Path, options: LogOptions) -> Log:
    """Open the scans of a bag; poses come from tf, or from odometry where that has no way to the sensor.

    Raises
    ------
    FormatError
        When it is no bag, or has no scans; while iterating, when it is broken.
    """
    with opened(path) as bag:
        form = bag.format
        count = sum(c.msgcount for c in _chosen(bag, SCAN, options.topic, Notes()))
    return Log(form, name_of(path), partial(_scans, path, options), count)


def _scans(path: Path, options: LogOptions, notes: Notes) -> Iterator[LoggedScan]:
    with opened(path) as bag:
        wanted = _chosen(bag, SCAN, options.topic, notes)
        sensors = Sensors(read_frames(bag, notes), options, notes)
        for connection, message in bag.messages(wanted):
            sensor = sensors.of(connection.topic, str(message.header.frame_id))
            try:
                scan = _scan(connection.topic, message, sensor, notes)
            except UprightFrameError as error:
                notes.add_dropped("upright_frame", f"scans in the frame {error}", 1)
                continue
            except InputError as error:
                notes.add_dropped("broken_scan", f"scans that are none, such as: {error.message}", 1)
                continue
            if scan.pose is None and sensor.odometry is not None:
                notes.add_dropped("no_pose", "scans whose pose the log does not say (they are kept)", 1)
            notes.add_read("scans", f"scans of {shown(connection.topic)}", 1)
            yield scan
        if "scans" not in notes.read and "upright_frame" in notes.dropped:
            raise IncompleteFileError(
                f"no scan is left; {notes.dropped['upright_frame'].message}", argument=name_of(path)
            )


def _chosen(bag: Bag, kind: str, topic: str | None, notes: Notes) -> list[Connection]:
    """Return the connections of one topic.

    Raises
    ------
    IncompleteFileError
        When there is none.
    """
    short = kind.rpartition("/")[2]
    found = bag.connections(kind)
    counts: dict[str, int] = {}
    for connection in found:
        counts[connection.topic] = counts.get(connection.topic, 0) + connection.msgcount
    if topic is None and len(counts) > 1:
        topic = max(sorted(counts), key=lambda t: counts[t])
        others = ", ".join(shown(t) for t in sorted(counts) if t != topic)
        notes.add_assumed("topic", f"{short} of {shown(topic)}, which has most; not of {shown(others)}")
    if not counts or (topic is not None and topic not in counts):
        raise IncompleteFileError(f"has no {short}" + (f" on {shown(topic)}" if topic else ""), argument=bag.name)
    return [c for c in found if topic is None or c.topic == topic]


def _scan(topic: str, message: Any, sensor: Sensor, notes: Notes) -> LoggedScan:
    laser = LaserScan(
        float(message.angle_min),
        float(message.angle_increment),
        np.asarray(message.ranges, dtype=np.float64),
        float(message.range_min),
        float(message.range_max),
    )
    return _placed(topic, laser, time_increment_of(message, notes), stamp_of(message.header), sensor, notes)


def _placed(
    topic: str, laser: LaserScan, time_increment: float, stamp: int, sensor: Sensor, notes: Notes
) -> LoggedScan:
    """Return a scan with where its sensor was, and how it moved."""
    place = sensor.place(stamp)
    note_tilt(sensor, place, notes)
    motion = sensor.motion(time_increment, len(laser.ranges), stamp, notes)
    outer = sensor.odometry.outer if place.pose is not None and sensor.odometry is not None else ""
    base = sensor.base if place.mount is not None else ""
    moved = replace(laser, motion=motion)
    return LoggedScan(
        stamp, topic, shown(sensor.frame), moved, time_increment, place.pose, outer, place.mount, place.flipped, base
    )


def read_bag_grid(path: Path, topic: str | None, notes: Notes) -> tuple[Grid, str, str]:
    """Read the last grid of a bag.

    Returns
    -------
    Grid
    str
        The frame that it is in.
    str
        The format of the bag.

    Raises
    ------
    FormatError
        When the bag is broken, or has no grid.
    """
    with opened(path) as bag:
        last: Any = None
        for _connection, message in bag.messages(_chosen(bag, GRID, topic, notes)):
            last = message
            notes.add_read("grids", "grids, of which the last is taken", 1)
        if last is None:
            raise IncompleteFileError("has no OccupancyGrid", argument=bag.name)
        return *grid_of(last, bag.name), bag.format


def grid_of(message: Any, name: str) -> tuple[Grid, str]:
    """Return the cells of a message, and the frame that they are in.

    Raises
    ------
    FormatError
        When its fields do not fit each other, or it is too large.
    """
    width, height = int(message.info.width), int(message.info.height)
    resolution = float(np.float32(message.info.resolution))
    if width * height > MAX_CELLS:
        raise TooLargeError(f"expected at most {MAX_CELLS} cells", argument=name)
    if width * height != len(message.data) or not MIN_RESOLUTION <= resolution <= MAX_RESOLUTION:
        raise MalformedFileError("has a grid whose cells do not fit its size or resolution", argument=name)
    values = np.asarray(message.data, dtype=np.int8).reshape(height, width).astype(np.float32)
    occupancy = np.where((values >= 0) & (values <= 100), values / np.float32(100), np.float32(np.nan))
    try:
        origin, _ = planar(matrix_of(message.info.origin.position, message.info.origin.orientation))
    except ValueError as error:
        raise MalformedFileError("has a grid without an origin", argument=name) from error
    grid = Grid(occupancy, round(resolution, 7), RigidTransform(origin.x, origin.y, origin.theta))
    return grid, shown(str(message.header.frame_id)) or "map"
