"""Scans of ROS bags."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

from registration import InputError
from vectorization import LaserScan

from ..errors import UprightFrameError
from ..files import name_of
from ..report import Notes, shown
from .bags import opened
from .lasers import laser_of
from .scan import Log, LoggedScan, LogOptions, Stamps, none_usable
from .sensors import Place, Sensor, Sensors, note_tilt, time_increment_of
from .topics import scan_connections
from .tracks import NS
from .transforms import stamp_of
from .trees import read_frames
from .tuning import CLOCKS_APART_NS


def read_bag(path: Path, options: LogOptions) -> Log:
    """Open the scans of a bag; poses come from tf, or from odometry where that has no way to the sensor.

    Raises
    ------
    FormatError
        When it is no bag, or has no scans; while iterating, when it is broken.
    """
    with opened(path, Notes()) as bag:
        form = bag.format
        count = sum(c.msgcount for c in scan_connections(bag, options.topic, Notes()))
    return Log(form, name_of(path), partial(_scans, path, options), count)


def _scans(path: Path, options: LogOptions, notes: Notes) -> Iterator[LoggedScan]:
    with opened(path, notes) as bag:
        wanted = scan_connections(bag, options.topic, notes)
        sensors = Sensors(read_frames(bag, notes), options, notes)
        stamps, first = Stamps(notes), ""
        for connection, received, message in bag.received(wanted):
            sensor = sensors.of(connection.topic, str(message.header.frame_id))
            try:
                laser = laser_of(message, notes)
                stamp = stamps.of(stamp_of(message.header), received)
                place = sensor.place(stamp, received)
                _note_place(sensor, place, stamp, received, notes)
                increment = time_increment_of(message, notes)
                motion = sensor.motion(increment, len(laser.ranges), stamp, received, notes)
                laser = replace(laser, motion=motion)
                scan = _placed(connection.topic, laser, increment, stamp, sensor, place)
                scan = stamps.placed(scan, place.part)
            except UprightFrameError as error:
                first = first or str(error)
                notes.add_dropped("upright_frame", f"scans in the frame {error}", 1)
                continue
            except InputError as error:
                first = first or error.message
                notes.add_dropped("broken_scan", f"scans that cannot be used, such as: {error.message}", 1)
                continue
            notes.add_read("scans", f"scans of {shown(connection.topic)}", 1)
            yield scan
        if "scans" not in notes.read:
            raise none_usable(notes, first)


def _note_place(sensor: Sensor, place: Place, stamp: int, received: int, notes: Notes) -> None:
    note_tilt(sensor, place, notes)
    if place.pose is not None or sensor.odometry is None:
        return
    notes.add_dropped("no_pose", "scans without a pose in the log (they are included)", 1)
    sensor.odometry.note_gaps(notes)
    apart = sensor.clock_offset(stamp, received)
    if abs(apart) * NS > CLOCKS_APART_NS:
        notes.add_assumed(
            "clocks",
            f"scans whose stamps are {abs(apart):.1f} s {'behind' if apart > 0.0 else 'ahead of'} those of odometry "
            "that was received with them: their clocks differ, and odometry is not used for them",
            1,
        )


def _placed(
    topic: str, laser: LaserScan, time_increment: float, stamp: int, sensor: Sensor, place: Place
) -> LoggedScan:
    """Return a scan with where its sensor was."""
    outer = sensor.odometry.outer if place.pose is not None and sensor.odometry is not None else ""
    return LoggedScan(
        stamp,
        topic,
        shown(sensor.frame),
        laser,
        time_increment,
        place.pose,
        outer,
        place.mount,
        place.flipped,
        sensor.base if place.mount is not None else "",
        unknown_s=place.unknown_ns / NS,
    )
