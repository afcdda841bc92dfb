"""Waits for scans, answers them, until it is told to end."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Literal

from cyclonedds.domain import DomainParticipant

import linefix
from formats import map_of_grid
from registration import InputError

from .locating import Located, Mounts, locate
from .messages import (
    DiagnosticArray,
    Empty,
    LaserScan,
    MarkerArray,
    OccupancyGrid,
    PoseWithCovarianceStamped,
    TFMessage,
    Time,
)
from .reporting import answer_marker, complaint, diagnosis, map_marker, stamped_pose
from .wire import LATCHED, RELIABLE, SENSOR, Heard, Told, Waiting

BEAT = 0.5  # s, after which it is looked anyway whether to end


@dataclass(frozen=True, slots=True)
class BridgeOptions:
    """What the bridge listens to, and when it speaks.

    Attributes
    ----------
    scans : tuple of str
        Topics of scans; each is answered by itself.
    map_topic : str or None
        Of an OccupancyGrid, for a bridge that was given no map.
    base_frame : str
        The robot's own frame.
    when : "lost" or "always"
        When ``/initialpose`` is said: by the first usable scan, and by the next one after each message on
        ``/linefix/locate``; or by each.
    domain : int
        ``ROS_DOMAIN_ID``.
    """

    scans: tuple[str, ...] = ("/scan",)
    map_topic: str | None = None
    base_frame: str = "base_link"
    when: Literal["lost", "always"] = "lost"
    domain: int = 0


class Bridge:
    """Between a robot that speaks ROS 2 and the search.

    Parameters
    ----------
    options : BridgeOptions
    index : MapIndex, optional
        None: the map comes over `options.map_topic`.
    frame : str
        Of the map; a map that comes over its topic brings its own.
    """

    def __init__(self, options: BridgeOptions, index: linefix.MapIndex | None = None, frame: str = "map") -> None:
        self._options, self._index, self._frame = options, index, frame
        self._mounts = Mounts(options.base_frame)
        self._lost, self._ended = True, False
        net = DomainParticipant(options.domain)
        self._scans = [Heard(net, topic, LaserScan, SENSOR) for topic in options.scans]
        self._mounted = Heard(net, "/tf_static", TFMessage, LATCHED)
        self._asked = Heard(net, "/linefix/locate", Empty, RELIABLE)
        self._maps = [Heard(net, options.map_topic, OccupancyGrid, LATCHED)] if options.map_topic else []
        self._initial = Told(net, "/initialpose", PoseWithCovarianceStamped, RELIABLE)
        self._pose = Told(net, "/linefix/pose", PoseWithCovarianceStamped, RELIABLE)
        self._markers = Told(net, "/linefix/markers", MarkerArray, LATCHED)
        self._diagnostics = Told(net, "/diagnostics", DiagnosticArray, RELIABLE)
        self._waiting = Waiting(net, [*self._scans, self._mounted, self._asked, *self._maps])
        if index is not None:
            self._markers.say(map_marker(index, frame))

    def run(self) -> None:
        """Answer scans until `end` is called."""
        while not self._ended:
            self._waiting.wait(BEAT)
            self.turn()

    def end(self) -> None:
        """Make `run` return soon; from any thread or handler of a signal."""
        self._ended = True
        self._waiting.end()

    def turn(self) -> None:
        """Take what has come, and answer the newest scan of each topic."""
        for message in self._mounted.take():
            self._hear_mounts(message)
        for topic in self._maps:
            for grid in topic.take():
                self._hear_map(grid)
        if self._asked.take():
            self._lost = True
        for scans in self._scans:
            for scan in scans.take()[-1:]:
                self._hear_scan(scan)

    def _hear_mounts(self, message: TFMessage) -> None:
        try:
            self._mounts.hear(message)
        except ValueError as error:  # those of the libraries are such, too
            self._diagnostics.say(complaint(Time(), f"a mount is not taken: {error}"))

    def _hear_map(self, grid: OccupancyGrid) -> None:
        try:
            imported = map_of_grid(grid)
            self._index, self._frame = linefix.index_map(imported), imported.map.frame_id
        except InputError as error:
            self._diagnostics.say(complaint(grid.header.stamp, f"the map is not taken: {error}"))
            return
        self._lost = True
        self._markers.say(map_marker(self._index, self._frame))

    def _hear_scan(self, scan: LaserScan) -> None:
        mount, stamp = self._mounts.of(scan.header.frame_id), scan.header.stamp
        if self._index is None:
            self._diagnostics.say(complaint(stamp, "no map has come yet"))
            return
        if mount is None:
            missing = f"/tf_static does not say where {scan.header.frame_id} is in {self._options.base_frame}"
            self._diagnostics.say(complaint(stamp, missing))
            return
        begun = time.perf_counter()
        try:
            located = locate(self._index, scan, mount)
        except InputError as error:
            self._diagnostics.say(complaint(stamp, f"a scan is not taken: {error}"))
            return
        self._tell(located, 1e3 * (time.perf_counter() - begun))

    def _tell(self, located: Located, milliseconds: float) -> None:
        pose = stamped_pose(located, self._frame)
        if pose is not None and located.answer.usable:
            self._pose.say(pose)
            if self._lost or self._options.when == "always":
                self._initial.say(pose)
            self._lost = False
        self._markers.say(answer_marker(located, self._frame))
        self._diagnostics.say(diagnosis(located, milliseconds))
