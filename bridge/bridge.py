"""The node: subscribes to scans, searches them, publishes poses, until it is told to end."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from cyclonedds.domain import DomainParticipant

import linefix

from .frames import Frames
from .gathering import Gathering, looks_of
from .locating import Located
from .map_conversion import MapConverter
from .messages import (
    DiagnosticArray,
    Empty,
    LaserScan,
    MarkerArray,
    Odometry,
    PoseWithCovarianceStamped,
    SerializedGrid,
    TFMessage,
    Time,
)
from .odometry import Heard as Driven
from .reporting import answer_marker, complaint, diagnosis, map_marker, stamped_pose
from .searching import Found, Searcher
from .tuning import END_SECONDS, REPEAT_SECONDS
from .wire import LATCHED, RELIABLE, SENSOR, STREAM, Heard, Told, Waiting

BEAT = 0.2  # s, after which it is looked anyway whether to end
LITTLE = 1e-3  # s; so that the time is over when it is looked again
MOST_PROBLEMS = 100  # different ones that are remembered


@dataclass(frozen=True, slots=True)
class BridgeOptions:
    """Topics, frames, and when poses are published.

    Attributes
    ----------
    scans : tuple of str
        Topics of scans.
    together : float
        Seconds; scans of several topics that are taken no farther apart are searched as one. 0: each by itself.
    odometry : str
        Topic of odometry: the motion of the robot between such scans, and during each.
    motion : bool
        Take every beam to where the scanner was, where a scan has a `time_increment` and odometry a twist.
    map_topic : str or None
        Of an OccupancyGrid, for a bridge that was given no map.
    base_frame : str
        The base frame of the robot.
    when : "lost" or "always"
        When ``/initialpose`` is published: for the first usable scan, and for the next one after each message on
        ``/linefix/locate`` and each new subscriber; or for each.
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


def namespace_of(scans: Sequence[str]) -> str:
    """Return the namespace of a robot, that of its first scan topic: ``/robot1`` for ``/robot1/scan``, else empty."""
    above = scans[0].strip("/").rpartition("/")[0]
    return f"/{above}" if above else ""


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
        self._options, self._index, self._frame, self._generation = options, index, frame, 0
        self._frames, self._driven = Frames(), Driven()
        self._gathering = Gathering(len(options.scans), options.together)
        self._next: dict[int, Sequence[LaserScan]] = {}  # by topic; what has waited longest is first
        self._lost, self._ended = True, False
        self._published: dict[str, float] = {}
        self._connect(DomainParticipant(options.domain))
        self._searcher = Searcher(self._waiting.wake)
        self._converter = MapConverter(self._waiting.wake)
        if index is not None:
            self._walls.say(map_marker(index, frame))

    def _connect(self, net: DomainParticipant) -> None:
        options, above, problem = self._options, namespace_of(self._options.scans), self._complain
        self._diagnostics = Told(net, "/diagnostics", DiagnosticArray, RELIABLE)
        self._initial = Told(net, f"{above}/initialpose", PoseWithCovarianceStamped, RELIABLE)
        self._pose = Told(net, f"{above}/linefix/pose", PoseWithCovarianceStamped, RELIABLE)
        # On a topic of its own: behind ten robots it would be no longer latched.
        self._walls = Told(net, f"{above}/linefix/map_markers", MarkerArray, LATCHED)
        self._markers = Told(net, f"{above}/linefix/markers", MarkerArray, LATCHED)
        self._scans = [Heard(net, topic, LaserScan, SENSOR, problem=problem) for topic in options.scans]
        self._odometry = Heard(net, options.odometry, Odometry, STREAM, problem=problem)
        self._mounted = Heard(net, f"{above}/tf_static", TFMessage, LATCHED, RELIABLE, problem=problem)
        self._asked = Heard(net, f"{above}/linefix/locate", Empty, RELIABLE, problem=problem)
        topic = options.map_topic
        self._maps = [Heard(net, topic, SerializedGrid, LATCHED, RELIABLE, problem=problem)] if topic else []
        # Odometry is read as it comes: twenty messages would keep a scan waiting for 2 ms.
        self._waiting = Waiting(net, [*self._scans, self._odometry, self._mounted, self._asked, *self._maps])

    def run(self) -> None:
        """Search scans until `end` is called."""
        while not self._ended:
            left = self._gathering.left
            self._waiting.wait(BEAT if left is None else min(BEAT, left + LITTLE))
            self.turn()

    def end(self) -> None:
        """Make `run` return soon; from any thread or handler of a signal."""
        self._ended = True
        self._waiting.wake()

    def close(self) -> bool:
        """Cancel what goes on in the background; return whether all of it has ended."""
        self._converter.end()
        return self._searcher.end(END_SECONDS)

    def turn(self) -> None:
        """Take the messages and results that have come, and search the newest scans."""
        for mounts in self._mounted.take():
            for problem in self._frames.take(mounts, static=True):
                self._complain(f"{self._mounted.name}: {problem}")
        self._turn_maps()
        if self._asked.take() or self._initial.joined():
            self._lost = True
        for odometry in self._odometry.take():
            self._take_odometry(odometry)
        found = self._searcher.result()
        if found is not None:
            self._take_result(found)
        self._turn_scans()

    def _turn_maps(self) -> None:
        for maps in self._maps:
            for grid in maps.take():
                self._converter.take(grid)
        converted = self._converter.result()
        if converted is None:
            return
        if converted.index is None:
            self._complain(f"the map on {self._options.map_topic} is not used: {converted.problem}")
            return
        self._index, self._frame, self._lost = converted.index, converted.frame, True
        self._generation += 1
        self._walls.say(map_marker(self._index, self._frame))

    def _turn_scans(self) -> None:
        for topic, scans in enumerate(self._scans):
            for scan in scans.take()[-1:]:
                if self._options.together > 0.0:
                    self._gathering.take(topic, scan)
                else:
                    self._next[topic] = [scan]
        ready = self._gathering.ready()
        if ready:
            self._next[0] = ready
        while self._next and not self._searcher.busy:
            self._search(self._next.pop(next(iter(self._next))))

    def _take_odometry(self, message: Odometry) -> None:
        try:
            self._driven.hear(message)
        except ValueError as error:  # those of the libraries are such, too
            self._complain(f"odometry is not used: {error}", message.header.stamp)

    def _search(self, scans: Sequence[LaserScan]) -> None:
        stamp = scans[0].header.stamp
        if self._index is None:
            problem = "the map is being converted" if self._converter.busy else "no map has been published"
            self._complain(f"{self._options.map_topic}: {problem}", stamp)
            return
        looks, missing = looks_of(
            scans, self._frames, self._options.base_frame, self._driven, motion=self._options.motion
        )
        for problem in missing:
            self._complain(problem, stamp)
        if looks:
            self._searcher.submit(self._index, looks, self._generation)

    def _take_result(self, found: Found) -> None:
        if found.located is None:
            self._complain(found.problem, found.stamp)
        elif found.generation == self._generation:  # else the map has changed meanwhile
            self._publish(found.located, 1e3 * found.seconds)

    def _publish(self, located: Located, milliseconds: float) -> None:
        pose = stamped_pose(located, self._frame)
        if pose is not None and located.answer.usable:
            self._pose.say(pose)
            if self._lost or self._options.when == "always":
                self._initial.say(pose)
                self._lost = not self._initial.subscribed
        self._markers.say(answer_marker(located, self._frame))
        self._diagnostics.say(diagnosis(located, milliseconds))

    def _complain(self, problem: str, stamp: Time | None = None) -> None:
        """Publish a problem; the same one at most once in `REPEAT_SECONDS`."""
        now = time.monotonic()
        if now - self._published.get(problem, -REPEAT_SECONDS) < REPEAT_SECONDS:
            return
        if len(self._published) >= MOST_PROBLEMS:
            self._published.clear()
        self._published[problem] = now
        self._diagnostics.say(complaint(stamp or Time(), problem))
