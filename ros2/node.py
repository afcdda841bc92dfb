"""The node: subscribes to scans, searches them, and publishes the pose that they agree on."""

from __future__ import annotations

import gc
import sys
import time
import weakref
from collections.abc import Callable, Sequence

import linefix
from registration import IDENTITY

from .clock import NS, Clock
from .connecting import connect
from .frames import Frames
from .health import Health, State
from .inputs import Inputs
from .localization import Localization
from .looking import Gathering, looks_of
from .map_conversion import MapConverter
from .maps import Maps
from .messages import LaserScan, Odometry
from .odometry import OdometryHistory
from .options import NodeOptions, quoted
from .reporting import answer_marker, stamped_pose, values_of, verdict_of
from .searching import Found, Searcher, search_options
from .topics import Topics
from .transforms import FrameError, planar
from .tuning import END_SECONDS, ODOMETRY_SECONDS, SAME_MAP, TRANSFORM_PERIOD_NS
from .wire import Waiting

BEAT = 0.2  # s between two checks whether to end
MARGIN = 1e-3  # s; so that a waiting time is over at the next check


def _to_stderr(line: str) -> None:
    print(f"linefix: {line}", file=sys.stderr, flush=True)


def _problem(node: Node | None, problem: str) -> None:
    if node is not None:
        node._health.problem(problem)


class Node:
    """Connects a robot with ROS 2 to the search.

    Parameters
    ----------
    options : NodeOptions
    maps : Maps, optional
        None: the map comes over `options.map_topic`.
    log : callable
        Takes a line.

    Raises
    ------
    ConnectionRefusedError
        When the variables of the environment do not describe a connection.
    OptionError
        When a name of a topic is none.
    """

    def __init__(
        self,
        options: NodeOptions,
        maps: Maps | None = None,
        log: Callable[[str], None] = _to_stderr,
    ) -> None:
        self._options, self._maps, self._generation = options, maps, 0
        self._clock, self._frames = Clock(simulated=options.use_sim_time), Frames()
        self._odometry = OdometryHistory(self._clock)
        self._gathering = Gathering(len(options.scans), options.together_s)
        self._next: dict[int, Sequence[LaserScan]] = {}  # by topic; what has waited longest is first
        self._unused = ""  # why the last map is not used
        self._held: tuple[Found, float] | None = None  # a result that waits for odometry, and until when
        self._ended, self._searched = False, False
        self._beat = TRANSFORM_PERIOD_NS / NS if options.publish_tf else BEAT
        participant = connect(options.domain)
        # Not in a cycle of references: the garbage collector would leave the endpoints of DDS open.
        node = weakref.ref(self)
        self._topics = Topics(participant, options, lambda problem: _problem(node(), problem))
        prefix = f"{options.namespace.strip('/')}/" if options.namespace else ""
        names = prefix, options.hardware_id or options.namespace.strip("/")
        self._health = Health(self._topics.diagnostics, self._topics.status, names, log)
        self._inputs = Inputs(options, self._topics, self._odometry, self._clock, self._health.note)
        shared = self._frames, self._odometry, self._clock
        self._localization = Localization(options, self._topics, self._health, *shared)
        self._waiting = Waiting(participant, self._topics.subscriptions)
        self._searcher = Searcher(search_options(options), self._waiting.wake)
        self._converter = MapConverter(self._waiting.wake, options.surface) if options.map_topic else None
        if maps is not None:
            self._localization.use(maps)

    def wait_until_ready(self) -> None:
        """Return when a map that comes would be converted at once."""
        if self._converter is not None:
            self._converter.ready.result()

    def run(self) -> None:
        """Search scans until `end` is called."""
        while not self._ended:
            left = self._gathering.left
            self._waiting.wait(self._beat if left is None else min(self._beat, left + MARGIN))
            self.turn()

    def end(self) -> None:
        """Make `run` return soon; from any thread or handler of a signal."""
        self._ended = True
        self._waiting.wake()

    def close(self, seconds: float = END_SECONDS) -> bool:
        """Cancel what goes on in the background; return whether all of it has ended within a time.

        False is no defect: a search looks for its cancellation between two steps, and a conversion after a start of its
        process. On a busy machine that may take longer. Both are threads that a process may leave at its end.
        """
        until = time.monotonic() + seconds
        converted = self._converter is None or self._converter.end(seconds)
        return self._searcher.end(max(0.0, until - time.monotonic())) and converted

    def leave(self) -> None:
        """Delete the topics of the node, after `close`; other participants then know that it is gone.

        DDS waits here for subscribers that have not received everything, and without limit for one that is gone.
        """
        self.__dict__.clear()
        gc.collect()

    def turn(self) -> None:
        """Take the messages and results that have come, and search the newest scans."""
        for message in self._topics.clock.take()[-1:] if self._topics.clock else ():
            self._clock.take(message)
        self._turn_transforms()
        self._turn_maps()
        self._localization.take_requests()
        for odometry in self._topics.odometry.take():
            self._take_odometry(odometry)
        self._turn_results()
        self._localization.publish_initial()
        self._turn_scans()
        if not self._inputs.transform_stops:
            self._localization.publish_transform()
        state, doubt = self._state, self._inputs.doubt
        if state is State.AGREED and doubt:
            state = State.STALE
        values = {**self._localization.values, **self._inputs.values}
        self._health.beat(state, self._clock.now(), values, doubt)

    def _turn_transforms(self) -> None:
        for topic in self._topics.transforms:
            for message in topic.take():
                for problem in self._frames.take(message, static=topic.static, prefix=topic.prefix):
                    self._health.problem(f"{topic.subscription.name}: {problem}")
                frame = self._options.frame(self._options.odom_frame)
                newest = self._frames.newest(frame, self._options.base_of(frame))
                if newest is not None:
                    self._odometry.take_transform(*newest, frame)
        for pose in self._topics.amcl.take():
            try:
                self._localization.take_localizer(pose)
            except FrameError as error:
                self._health.problem(f"{self._topics.amcl.name}: {error}")

    def _turn_maps(self) -> None:
        if self._converter is None:
            return
        for maps in self._topics.maps:
            for grid in maps.take():
                self._inputs.map()
                self._converter.take(grid)
        converted = self._converter.result()
        if converted is None:
            return
        topic = self._topics.maps[0].name
        if converted.maps is None:
            self._unused = f"the map on {topic} is not used: {converted.problem}"
            self._health.problem(self._unused)
            return
        same = converted.maps.similarity(self._maps)
        self._maps = converted.maps
        self._generation += 1
        self._localization.use(self._maps, kept=same >= SAME_MAP)
        walls, frame = len(self._maps.walls_of(None)), self._maps.frame_of(None)
        changed = f"; {100.0 * (1.0 - same):.1f} % of the walls are new or gone" if self._generation > 1 else ""
        kept = "" if not changed else ", the pose is kept" if same >= SAME_MAP else ", the pose is discarded"
        self._health.log(f"map from {topic}: {converted.size}, {walls} walls, frame {quoted(frame)}{changed}{kept}")

    def _turn_scans(self) -> None:
        for topic, scans in enumerate(self._topics.scans):
            for scan in scans.take():
                self._inputs.scan(scan)
                if self._options.together_s > 0.0:
                    self._gathering.take(topic, scan)
                else:
                    self._next[topic] = [scan]
        ready = self._gathering.ready()
        if ready:
            self._next[0] = ready
        while self._next and not self._searcher.busy:
            self._search(self._next.pop(next(iter(self._next))))
        self._inputs.look()

    def _turn_results(self) -> None:
        """Take results; each waits until odometry has reached its stamp, or long enough.

        By the odometry before, the robot would be where it was then, and a scan of a moving robot would disagree.
        """
        while True:
            if self._held is None:
                found = self._searcher.result()
                if found is None:
                    return
                self._held = found, time.monotonic() + ODOMETRY_SECONDS
            found, until = self._held
            if self._odometry.awaited(found.stamp) and time.monotonic() < until:
                return
            self._held = None
            self._take_result(found)

    def _take_odometry(self, message: Odometry) -> None:
        name, frame = self._topics.odometry.name, message.header.frame_id.strip("/")
        try:
            if self._maps is not None and frame in self._maps.frames.values():
                raise FrameError(
                    f"found odometry in {quoted(frame)}, the frame of the map, expected a frame of its own, such as "
                    "odom; choose another topic with --odom"
                )
            self._odometry.take(message, self._child_from_base(message.child_frame_id), name)
        except ValueError as error:  # those of the libraries are such, too
            self._health.problem(f"{name}: {error}", message.header.stamp)

    def _child_from_base(self, child: str) -> linefix.RigidTransform:
        """Return where the base is in the child frame of odometry."""
        child = self._options.frame(child)
        base = self._options.base_of(child)
        if child in ("", base):
            return IDENTITY
        matrix = self._frames.between(child, base)
        if matrix is None:
            raise FrameError(
                f"found odometry of {quoted(child)}, expected a transform from it to {quoted(base)}; publish one, "
                "or set the base frame with --base"
            )
        return planar(matrix)[0]

    def _search(self, scans: Sequence[LaserScan]) -> None:
        stamp = scans[0].header.stamp
        if self._maps is None:
            converting = self._converter is not None and self._converter.busy
            problem = (
                "the map is being converted; scans are searched afterwards"
                if converting
                else self._unused or "no usable map has been received; start map_server, or set --map"
            )
            self._health.problem(f"{self._topics.maps[0].name}: {problem}", stamp)
            return
        looks, missing = looks_of(scans, self._frames, self._options, self._odometry, self._topics.unprefixed)
        for problem in missing:
            self._health.problem(problem, stamp)
        for look in looks:
            for code, note in look.notes.items():
                self._health.warn(f"{quoted(look.frame)}: {note}", stamp, f"{code} {look.frame}")
        self._searched = bool(looks)
        if looks:
            self._inputs.searched()
            self._searcher.submit(self._maps.index, looks, self._generation)

    def _take_result(self, found: Found) -> None:
        answer, stamp = found.answer, found.stamp
        if answer is None:
            self._health.problem(found.problem, stamp)
            return
        if found.generation != self._generation or self._maps is None:
            return  # the map has changed meanwhile
        frame = self._maps.frame_of(answer.map_id)
        if answer.usable and answer.pose is not None and answer.covariance is not None:
            self._topics.pose.publish(stamped_pose(stamp, answer.pose, answer.covariance, frame))
        self._topics.markers.publish(answer_marker(answer, stamp, frame))
        if not self._inputs.shared:
            agreed = self._localization.take(answer, stamp, self._inputs.received)
            self._inputs.result(usable=answer.usable, agreed=agreed is not None)
        self._health.publish("scan", stamp, verdict_of(answer), values_of(answer, 1e3 * found.seconds))

    @property
    def _state(self) -> State:
        return State.NO_MAP if self._maps is None else self._localization.state(searched=self._searched)
