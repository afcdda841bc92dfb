"""Waits for scans, answers them, until it is told to end."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from cyclonedds.domain import DomainParticipant

import linefix
from formats import map_of_grid
from registration import InputError

from .gathering import Gathering, looks_of
from .locating import Located, Mounts, locate
from .messages import (
    DiagnosticArray,
    Empty,
    LaserScan,
    MarkerArray,
    OccupancyGrid,
    Odometry,
    PoseWithCovarianceStamped,
    TFMessage,
    Time,
)
from .odometry import Heard as Driven
from .reporting import answer_marker, complaint, diagnosis, map_marker, stamped_pose
from .wire import LATCHED, RELIABLE, SENSOR, STREAM, Heard, Told, Waiting

BEAT = 0.5  # s, after which it is looked anyway whether to end
LITTLE = 1e-3  # s; so that the time is over when it is looked again


@dataclass(frozen=True, slots=True)
class BridgeOptions:
    """What the bridge listens to, and when it speaks.

    Attributes
    ----------
    scans : tuple of str
        Topics of scans.
    together : float
        Seconds; scans of several topics that are taken no farther apart are answered as one. 0: each by itself.
    odometry : str
        Topic that says how the robot moved between such scans, and during each.
    motion : bool
        Take every beam to where the scanner was, where a scan has a `time_increment` and odometry a twist.
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
    together: float = 0.1
    odometry: str = "/odom"
    motion: bool = True
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
        self._mounts, self._driven = Mounts(options.base_frame), Driven()
        self._gathering = Gathering(len(options.scans), options.together)
        self._lost, self._ended = True, False
        net = DomainParticipant(options.domain)
        self._scans = [Heard(net, topic, LaserScan, SENSOR) for topic in options.scans]
        self._odometry = Heard(net, options.odometry, Odometry, STREAM)
        self._mounted = Heard(net, "/tf_static", TFMessage, LATCHED)
        self._asked = Heard(net, "/linefix/locate", Empty, RELIABLE)
        self._maps = [Heard(net, options.map_topic, OccupancyGrid, LATCHED)] if options.map_topic else []
        self._initial = Told(net, "/initialpose", PoseWithCovarianceStamped, RELIABLE)
        self._pose = Told(net, "/linefix/pose", PoseWithCovarianceStamped, RELIABLE)
        self._markers = Told(net, "/linefix/markers", MarkerArray, LATCHED)
        self._diagnostics = Told(net, "/diagnostics", DiagnosticArray, RELIABLE)
        # Odometry is read as it comes: twenty messages would keep a scan waiting for 2 ms.
        self._waiting = Waiting(net, [*self._scans, self._odometry, self._mounted, self._asked, *self._maps])
        if index is not None:
            self._markers.say(map_marker(index, frame))

    def run(self) -> None:
        """Answer scans until `end` is called."""
        while not self._ended:
            left = self._gathering.left
            self._waiting.wait(BEAT if left is None else min(BEAT, left + LITTLE))
            self.turn()

    def end(self) -> None:
        """Make `run` return soon; from any thread or handler of a signal."""
        self._ended = True
        self._waiting.end()

    def turn(self) -> None:
        """Take what has come, and answer the newest scan of each topic; those that belong together as one."""
        for message in self._mounted.take():
            self._hear_mounts(message)
        for maps in self._maps:
            for grid in maps.take():
                self._hear_map(grid)
        if self._asked.take():
            self._lost = True
        for message in self._odometry.take():
            self._hear_odometry(message)
        for topic, scans in enumerate(self._scans):
            for scan in scans.take()[-1:]:
                if self._options.together > 0.0:
                    self._gathering.take(topic, scan)
                else:
                    self._hear_scans([scan])
        ready = self._gathering.ready()
        if ready:
            self._hear_scans(ready)

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

    def _hear_odometry(self, message: Odometry) -> None:
        try:
            self._driven.hear(message)
        except ValueError as error:
            self._diagnostics.say(complaint(message.header.stamp, f"odometry is not taken: {error}"))

    def _hear_scans(self, scans: Sequence[LaserScan]) -> None:
        stamp = scans[0].header.stamp
        if self._index is None:
            self._diagnostics.say(complaint(stamp, "no map has come yet"))
            return
        looks, missing = looks_of(scans, self._mounts, self._driven, motion=self._options.motion)
        for one in missing:
            self._diagnostics.say(complaint(stamp, one))
        if not looks:
            return
        begun = time.perf_counter()
        try:
            located = locate(self._index, looks)
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
