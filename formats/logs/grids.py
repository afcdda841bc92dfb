"""Occupancy grids of recordings: which of them is the map, and its message to a grid."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from registration import RigidTransform

from ..errors import IncompleteFileError, MalformedFileError, TooLargeError
from ..grids.cells import Grid
from ..grids.tuning import INFLATED, LETHAL_CELLS, UPRIGHT
from ..limits import MAX_CELLS, MAX_RESOLUTION, MIN_RESOLUTION
from ..report import Notes, shown
from .bags import GRID, NAMED, Bag, opened
from .topics import counts_of, named_topic

LETHAL, INSCRIBED = 100, 99  # costs of an obstacle, and of what is nearer to one than the robot is wide
ZERO = 1e-6  # a quaternion shorter than this was never set


@dataclass(frozen=True, slots=True)
class BagGrid:
    """A grid, and where it comes from.

    Attributes
    ----------
    grid : Grid
    frame : str
        The frame that it is in.
    format : str
        Of the bag.
    """

    grid: Grid
    frame: str
    format: str


def read_bag_grid(path: Path, topic: str | None, notes: Notes) -> BagGrid:
    """Read the last grid of the topic that is the map.

    Raises
    ------
    FormatError
        When the bag is broken, has no grid, or several and none that is clearly the map.
    """
    with opened(path, notes) as bag:
        counts = counts_of(bag, GRID)
        if topic is not None:
            wanted = {named_topic(bag, GRID, topic, counts)}
        elif any(counts.values()):
            wanted = {one for one in counts if counts[one]}
        else:
            raise IncompleteFileError(f"has no messages of OccupancyGrid; {bag.topics()}")
        grids = _last_grids(bag, wanted)
        if not grids:
            raise MalformedFileError(f"has no grid with cells on {', '.join(map(shown, sorted(wanted)[:NAMED]))}")
        chosen = next(iter(grids)) if len(wanted) == 1 else _map_among(grids, notes)
        notes.add_read("grids", f"grids of {shown(chosen)}, of which the last is used", counts[chosen])
        if is_costmap(chosen, grids[chosen]):
            told = f"{shown(chosen)} is a costmap, whose inflated obstacles lie in front of the walls"
            notes.add_assumed("costmap", f"{told}; set the option topic to the map")
        return BagGrid(*grid_of(grids[chosen], notes), bag.format)


def _last_grids(bag: Bag, topics: Collection[str]) -> dict[str, Any]:
    """Return the last message with cells of each topic."""
    found: dict[str, Any] = {}
    for connection, _, message in bag.received([one for one in bag.connections(GRID) if one.topic in topics]):
        if len(message.data) or connection.topic not in found:
            found[connection.topic] = message
    return {topic: found[topic] for topic in sorted(found)}


def _map_among(grids: dict[str, Any], notes: Notes) -> str:
    """Return the topic that is the map.

    Raises
    ------
    IncompleteFileError
        When it is not clear; the error lists the topics.
    """
    maps = [topic for topic in grids if not is_costmap(topic, grids[topic])]
    called = [topic for topic in maps if topic.rpartition("/")[2] == "map"]
    chosen = next((topic for topic in called if topic.strip("/") == "map"), None)
    for those in (called, maps):
        if chosen is None and len(those) == 1:
            chosen = those[0]
    if chosen is None:
        sizes = [f"{shown(topic)} ({_size(grids[topic])})" for topic in grids][:NAMED]
        raise IncompleteFileError(
            f"has several grids, and none is clearly the map: {', '.join(sizes)}; choose one with the option topic "
            "(--topic)"
        )
    others = [f"{shown(topic)} ({_size(grids[topic])})" for topic in grids if topic != chosen][:NAMED]
    notes.add_assumed(
        "topic", f"the grid of {shown(chosen)} ({_size(grids[chosen])}) is the map; not {', '.join(others)}"
    )
    return chosen


def _size(message: Any) -> str:
    info = message.info
    return f"{info.width} x {info.height} cells of {float(info.resolution):.3g} m"


def is_costmap(topic: str, message: Any) -> bool:
    """Tell whether a grid is a costmap of the navigation: by its topic, or as obstacles are inflated in it.

    Around each obstacle (100) a costmap has a rim of 99; a map has free, occupied or unknown cells there.
    """
    if "costmap" in topic.lower():
        return True
    cells = _cells(message)
    if cells is None:
        return False
    lethal = cells == LETHAL
    beside: list[NDArray[np.int8]] = []
    for rows, obstacles in ((cells, lethal), (cells.T, lethal.T)):
        beside += [rows[1:][obstacles[:-1]], rows[:-1][obstacles[1:]]]
    around = np.concatenate(beside)
    around = around[(around >= 0) & (around != LETHAL)]
    return len(around) >= LETHAL_CELLS and float((around == INSCRIBED).mean()) >= INFLATED


def _cells(message: Any) -> NDArray[np.int8] | None:
    """Return the cells of a message, (height, width); None where they do not fit its size."""
    width, height = int(message.info.width), int(message.info.height)
    cells = np.asarray(message.data, dtype=np.int8)
    return cells.reshape(height, width) if cells.size and width * height == cells.size else None


def grid_of(message: Any, notes: Notes) -> tuple[Grid, str]:
    """Return the cells of a message, and the frame that they are in.

    Parameters
    ----------
    message : object
        With the fields of ``nav_msgs/OccupancyGrid``.
    notes : Notes
        Takes an orientation that was never set.

    Raises
    ------
    FormatError
        When its fields do not fit each other, or it is too large.
    """
    width, height = int(message.info.width), int(message.info.height)
    resolution = float(np.float32(message.info.resolution))
    if width * height > MAX_CELLS:
        raise TooLargeError(
            f"expected at most {MAX_CELLS} cells, found {width} x {height}; crop the map, or make its cells larger"
        )
    cells = _cells(message)
    if cells is None or not MIN_RESOLUTION <= resolution <= MAX_RESOLUTION:
        raise MalformedFileError(
            f"has a grid whose cells do not fit its size or resolution: {len(message.data)} cells for {width} x "
            f"{height}, resolution {resolution:g} m, expected {MIN_RESOLUTION:g} to {MAX_RESOLUTION:g} m"
        )
    values = cells.astype(np.float32)
    occupancy = np.where((values >= 0) & (values <= 100), values / np.float32(100), np.float32(np.nan))
    origin = _origin(message.info.origin, notes)
    return Grid(occupancy, round(resolution, 7), origin), shown(str(message.header.frame_id)) or "map"


def _origin(pose: Any, notes: Notes) -> RigidTransform:
    """Return where a grid lies in its frame.

    Raises
    ------
    FormatError
        When a number is not finite, or the grid does not lie flat.
    """
    place = [float(getattr(pose.position, k)) for k in "xy"]
    turn = [float(getattr(pose.orientation, k)) for k in "xyzw"]
    if not all(map(math.isfinite, (*place, *turn))):
        raise MalformedFileError(
            f"has a grid whose info.origin is not finite: position {_told(place)}, orientation {_told(turn)}"
        )
    if max(map(abs, turn)) < ZERO:
        notes.add_assumed("orientation", "the grid's orientation is not set (all 0); no rotation is assumed")
        return RigidTransform(place[0], place[1], 0.0)
    length = math.hypot(*turn)
    x, y, z, w = (value / length for value in turn)
    if 1.0 - 2.0 * (x * x + y * y) < UPRIGHT:
        raise MalformedFileError(
            f"has a grid that is not horizontal: info.origin.orientation is {_told(turn)}, expected a rotation about z"
        )
    return RigidTransform(place[0], place[1], math.atan2(2.0 * (x * y + z * w), 1.0 - 2.0 * (y * y + z * z)))


def _told(values: list[float]) -> str:
    return "(" + ", ".join(f"{value:g}" for value in values) + ")"
