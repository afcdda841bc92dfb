"""The node: subscribes to scans, searches them, and publishes the pose that they agree on."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Sequence

import linefix

from .agreement import Agreement, Event, Observation
from .connecting import connect
from .correcting import MapToOdom
from .deciding import InitialPose
from .frames import NS, FrameError, Frames, planar
from .gathering import Gathering, looks_of
from .health import Health, State
from .locating import Located
from .looking import HERE
from .map_conversion import MapConverter
from .messages import LaserScan, Odometry, Time
from .odometry import OdometryHistory, nanoseconds
from .options import NodeOptions
from .reporting import answer_marker, at_least, map_marker, stamped_pose, transform_of, values_of, verdict_of
from .requests import Requests
from .searching import Found, Searcher
from .silence import Silence
from .text import quoted
from .topics import Topics
from .tuning import END_SECONDS, SETTLE_SECONDS, TRANSFORM_PERIOD_NS, TRANSFORM_TOLERANCE_NS
from .watching import Watch
from .wire import Waiting

BEAT = 0.2  # s, after which it is looked anyway whether to end
LITTLE = 1e-3  # s; so that the time is over when it is looked again


def _to_stderr(line: str) -> None:
    print(f"linefix: {line}", file=sys.stderr, flush=True)


class Node:
    """Between a robot that speaks ROS 2 and the search.

    Parameters
    ----------
    options : NodeOptions
    index : MapIndex, optional
        None: the map comes over `options.map_topic`.
    frame : str
        Of the map; a map that comes over its topic brings its own.
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
        index: linefix.MapIndex | None = None,
        frame: str = "map",
        log: Callable[[str], None] = _to_stderr,
    ) -> None:
        self._options, self._index, self._frame, self._generation = options, index, frame, 0
        self._frames, self._odometry = Frames(), OdometryHistory()
        self._gathering = Gathering(len(options.scans), options.together_s)
        self._next: dict[int, Sequence[LaserScan]] = {}  # by topic; what has waited longest is first
        self._agreement, self._initial = Agreement(options.agree), InitialPose(options.when)
        self._watch, self._correction = Watch(), MapToOdom()
        self._ended, self._searched = False, False
        self._pending: tuple[Time, Observation, str] | None = None
        self._settled = 0.0  # when the subscribers of initialpose are connected in both directions
        self._transformed = 0  # the time of the last transform that was published, nanoseconds
        participant = connect(options.domain)
        self._topics = Topics(participant, options, lambda problem: self._health.problem(problem))
        prefix = f"{options.namespace.strip('/')}/" if options.namespace else ""
        names = prefix, options.hardware_id or options.namespace.strip("/")
        self._health = Health(self._topics.diagnostics, self._topics.status, names, log)
        self._silence = Silence(options, self._topics, self._health.note)
        self._requests = Requests(self._topics.named_requests, self._topics.results)
        self._waiting = Waiting(participant, self._topics.subscriptions)
        self._searcher = Searcher(self._waiting.wake)
        self._converter = MapConverter(self._waiting.wake) if options.map_topic else None
        if index is not None:
            self._topics.walls.publish(map_marker(index, frame))

    @property
    def _odom_frame(self) -> str:
        return self._options.frame(self._odometry.frame or self._options.odom_frame)

    def wait_until_ready(self) -> None:
        """Return when a map that comes would be converted at once."""
        if self._converter is not None:
            self._converter.ready.wait()

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
        if self._converter is not None:
            self._converter.end()
        return self._searcher.end(END_SECONDS)

    def turn(self) -> None:
        """Take the messages and results that have come, and search the newest scans."""
        self._turn_transforms()
        self._turn_maps()
        self._turn_requests()
        for odometry in self._topics.odometry.take():
            self._take_odometry(odometry)
        found = self._searcher.result()
        if found is not None:
            self._take_result(found)
        self._publish_initial()
        self._turn_scans()
        self._health.beat(self._state, self._now, self._values)

    def _turn_transforms(self) -> None:
        for topic in self._topics.transforms:
            for message in topic.take():
                for problem in self._frames.take(message, static=topic.static, prefix=topic.prefix):
                    self._health.problem(f"{topic.subscription.name}: {problem}")
        for pose in self._topics.amcl.take():
            try:
                self._watch.take(pose)
            except FrameError as error:
                self._health.problem(f"{self._topics.amcl.name}: {error}")

    def _turn_maps(self) -> None:
        if self._converter is None:
            return
        for maps in self._topics.maps:
            for grid in maps.take():
                self._converter.take(grid)
        converted = self._converter.result()
        if converted is None:
            return
        topic = self._topics.maps[0].name
        if converted.index is None:
            self._health.problem(f"the map on {topic} is not used: {converted.problem}")
            return
        self._index, self._frame = converted.index, converted.frame
        self._generation += 1
        self._begin_again()
        walls = len(self._index.segments)
        self._health.note(f"map from {topic}: {converted.size}, {walls} walls, frame {quoted(self._frame)}")
        self._topics.walls.publish(map_marker(self._index, self._frame))

    def _turn_requests(self) -> None:
        if self._topics.requests.take() or self._requests.take():
            self._begin_again()
        if self._topics.initial.joined():
            self._initial.want()
            self._settled = max(self._settled, time.monotonic() + SETTLE_SECONDS)
        self._requests.expire()

    def _begin_again(self) -> None:
        """Forget the pose: the robot was carried, or the map has changed."""
        self._agreement.reset()
        self._correction.reset()
        self._watch.reset()
        self._initial.want()
        self._pending = None

    def _turn_scans(self) -> None:
        for topic, scans in enumerate(self._topics.scans):
            for scan in scans.take()[-1:]:
                self._silence.scan()
                if self._options.together_s > 0.0:
                    self._gathering.take(topic, scan)
                else:
                    self._next[topic] = [scan]
        ready = self._gathering.ready()
        if ready:
            self._next[0] = ready
        while self._next and not self._searcher.busy:
            self._search(self._next.pop(next(iter(self._next))))
        self._silence.look(has_map=self._index is not None)

    def _take_odometry(self, message: Odometry) -> None:
        try:
            self._odometry.take(message, self._child_from_base(message.child_frame_id))
        except ValueError as error:  # those of the libraries are such, too
            self._health.problem(f"{self._topics.odometry.name}: {error}", message.header.stamp)
            return
        self._publish_transform()

    def _child_from_base(self, child: str) -> linefix.RigidTransform:
        """Return where the base is in the child frame of odometry."""
        child = self._options.frame(child)
        base = self._options.base_of(child)
        if child in ("", base):
            return HERE
        matrix = self._frames.between(child, base)
        if matrix is None:
            raise FrameError(
                f"found odometry of {quoted(child)}, expected a transform from it to {quoted(base)}; publish one, "
                "or set the base frame with --base"
            )
        return planar(matrix)[0]

    def _search(self, scans: Sequence[LaserScan]) -> None:
        stamp = scans[0].header.stamp
        if self._index is None:
            converting = self._converter is not None and self._converter.busy
            problem = "the map is being converted" if converting else "no map has been published"
            self._health.problem(f"{self._topics.maps[0].name}: {problem}", stamp)
            return
        looks, missing = looks_of(scans, self._frames, self._options, self._odometry)
        for problem in missing:
            self._health.problem(problem, stamp)
        for look in looks:
            for code, note in look.notes.items():
                self._health.warn(f"{quoted(look.frame)}: {note}", stamp, f"{code} {look.frame}")
        self._searched = bool(looks)
        if looks:
            self._silence.searched()
            self._searcher.submit(self._index, looks, self._generation)

    def _take_result(self, found: Found) -> None:
        if found.located is None:
            self._health.problem(found.problem, found.stamp)
            return
        if found.generation != self._generation:
            return  # the map has changed meanwhile
        located, milliseconds = found.located, 1e3 * found.seconds
        if located.answer.usable and located.pose is not None and located.covariance is not None:
            pose = stamped_pose(located.stamp, located.pose, located.covariance, self._frame)
            self._topics.pose.publish(pose)
        self._topics.markers.publish(answer_marker(located, self._frame))
        self._agree(located)
        self._health.publish("scan", located.stamp, verdict_of(located), values_of(located, milliseconds))

    def _agree(self, located: Located) -> None:
        stamp = nanoseconds(located.stamp) or time.time_ns()
        scan = located.observation(self._odometry_at(stamp), stamp)
        event = self._agreement.take(scan)
        self._correction.take(event, scan)
        if event is Event.CONTRADICTED:
            self._pending = None
            self._health.note("the agreed pose is contradicted by a scan")
        if event not in (Event.AGREED, Event.CONFIRMED):
            return
        names = self._frame, self._odom_frame
        agrees = self._watch.compare(scan, names, self._frames, self._odometry)
        reason = self._initial.decide(event, localizer_agrees=agrees, lost=self._watch.lost, now=time.monotonic())
        self._publish_agreed(located.stamp, scan, reason)

    def _publish_agreed(self, stamp: Time, scan: Observation, reason: str | None) -> None:
        if scan.pose is None or scan.covariance is None:
            return
        agreed = stamped_pose(stamp, scan.pose, scan.covariance, self._frame)
        self._topics.agreed.publish(agreed)
        self._requests.answer(agreed)
        if reason is not None:
            self._pending = stamp, scan, reason
            self._publish_initial()

    def _publish_initial(self) -> None:
        """Publish the pose that waits to be, unless a subscriber has come that would not receive it yet."""
        if self._pending is None or time.monotonic() < self._settled:
            return
        (stamp, scan, reason), self._pending = self._pending, None
        if scan.pose is None or scan.covariance is None:
            return
        if reason == "lost":
            self._health.beat(State.LOST, self._now, self._values)
        widened = at_least(scan.covariance, self._options.min_sigma, self._options.min_sigma_theta)
        self._topics.initial.publish(stamped_pose(stamp, scan.pose, widened, self._frame))
        subscribed = self._topics.initial.subscribed
        self._initial.published(subscribed=subscribed, now=time.monotonic())
        self._watch.reset()
        x, y, degrees = scan.pose.x, scan.pose.y, math.degrees(scan.pose.theta)
        nobody = "" if subscribed else ", to which nobody subscribes"
        self._health.note(
            f"published {self._topics.initial.name}{nobody} ({reason}): x {x:.2f} m, y {y:.2f} m, {degrees:.0f} degrees"
        )

    def _odometry_at(self, stamp: int) -> linefix.RigidTransform | None:
        """Return odom_from_base, by odometry or else by transforms."""
        found = self._odometry.at(stamp)
        if found is not None:
            return found
        base = self._options.base_of(self._odom_frame)
        matrix = self._frames.lookup(self._odom_frame, base, stamp)
        return None if matrix is None else planar(matrix)[0]

    def _publish_transform(self) -> None:
        newest = self._odometry.newest
        if self._topics.tf is None or newest is None:
            return
        stamp, odometry = newest
        if 0 <= stamp - self._transformed < TRANSFORM_PERIOD_NS:
            return
        map_from_odom = self._correction.advance(stamp, odometry)
        if map_from_odom is None:
            return
        self._transformed = stamp
        ahead = stamp + TRANSFORM_TOLERANCE_NS
        frames = self._frame, self._odom_frame
        self._topics.tf.publish(transform_of(Time(ahead // NS, ahead % NS), frames, map_from_odom))

    @property
    def _state(self) -> State:
        if self._index is None:
            return State.NO_MAP
        if self._agreement.latest is None:
            return State.SEARCHING if self._searched else State.NO_SCAN
        if self._agreement.contradicted:
            return State.CONTRADICTED
        return State.LOST if self._watch.lost else State.AGREED

    @property
    def _now(self) -> Time:
        now = time.time_ns()
        return Time(now // NS, now % NS)

    @property
    def _values(self) -> dict[str, str]:
        agreeing, moved, turned = self._agreement.progress
        latest = self._agreement.latest
        values = {
            "scans that agree": f"{agreeing} of {self._options.agree}",
            "moved": f"{moved:.2f} m, {math.degrees(turned):.0f} degrees",
        }
        if latest is not None and latest.pose is not None:
            values["pose"] = f"{latest.pose.x:.3f} {latest.pose.y:.3f} {latest.pose.theta:.4f}"
            values["stamp"] = f"{latest.stamp / 1e9:.3f}"
        return values
