"""From the results of scans to the published poses of the robot: ``initialpose``, agreed poses, the transform."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

import linefix
from formats.logs.tuning import MOST_GAP_NS

from .agreement import Agreement, Event, Observation
from .clock import NS, Clock, nanoseconds, time_of
from .deciding import InitialPose, MapToOdom
from .frames import Frames
from .health import Health, State
from .maps import UNNAMED, Maps
from .messages import PoseWithCovarianceStamped, String, Time
from .odometry import OdometryHistory
from .options import NodeOptions, quoted
from .reporting import at_least, map_marker, stamped_pose, transform_of
from .requests import Requests
from .searching import observation_of
from .topics import Topics
from .transforms import FrameError
from .tuning import SETTLE_SECONDS, TRANSFORM_PERIOD_NS, TRANSFORM_TOLERANCE_NS
from .watching import Watch


class Localization:
    """Follows the pose that scans agree on, and publishes it.

    Parameters
    ----------
    options : NodeOptions
    topics : Topics
    health : Health
    frames : Frames
    odometry : OdometryHistory
        The node owns both.
    clock : Clock
    """

    def __init__(
        self,
        options: NodeOptions,
        topics: Topics,
        health: Health,
        frames: Frames,
        odometry: OdometryHistory,
        clock: Clock,
    ) -> None:
        self._maps: Maps | None = None
        self._map_name = UNNAMED  # of the last agreed pose
        self._localizer_map: str | None = None  # of the last pose that was published to a localizer
        self._options, self._topics, self._health = options, topics, health
        self._frames, self._odometry, self._clock = frames, odometry, clock
        self._agreement, self._initial = Agreement(options.agree), InitialPose(options.when)
        self._watch, self._correction = Watch(transforms=not options.publish_tf), MapToOdom()
        self._requests = Requests(topics.named_requests, topics.results)
        self._pending: tuple[Time, Observation, str] | None = None
        self._settled = 0.0  # when the subscribers of initialpose are connected in both directions
        self._transformed = 0  # the time of the last transform that was published, nanoseconds

    def use(self, maps: Maps, *, kept: bool = False) -> None:
        """Take other maps, and forget the pose unless it is kept; the walls of a single map are published at once."""
        self._maps = maps
        if not kept:
            self._map_name, self._localizer_map = UNNAMED, None
            self.begin_again()
        if not maps.several:
            self._publish_walls(None)

    def _publish_walls(self, map_id: str | None) -> None:
        if self._maps is not None:
            walls, frame = self._maps.walls_of(map_id), self._maps.frame_of(map_id)
            self._topics.walls.publish(map_marker(walls, frame))

    def _frame_of(self, scan: Observation | None) -> str:
        return "map" if scan is None or self._maps is None else self._maps.frame_of(scan.map_id)

    @property
    def odom_frame(self) -> str:
        """The odometry frame: as odometry names it, else that of the options."""
        return self._options.frame(self._odometry.frame or self._options.odom_frame)

    def begin_again(self) -> None:
        """Forget the pose: the robot was carried, or the map has changed."""
        self._agreement.reset()
        self._correction = MapToOdom()
        self._watch.reset()
        self._initial.want()
        self._pending = None

    def take_requests(self) -> None:
        """Take requests for a pose."""
        if self._topics.requests.take() or self._requests.take():
            self.begin_again()
        self._requests.expire()

    def take_localizer(self, pose: PoseWithCovarianceStamped) -> None:
        """Take the pose of the robot's localizer.

        Raises
        ------
        FrameError
            When it is no pose, or one in another frame than a map.
        """
        frame = pose.header.frame_id.strip("/")
        if self._maps is not None and frame and frame not in self._maps.frames.values():
            raise FrameError(f"found a pose in {quoted(frame)}, expected one in the frame of a map; it is not used")
        self._watch.take(pose)

    def take(
        self, answer: linefix.AssociationResult, stamped: Time, received: Callable[[int], int | None]
    ) -> Observation | None:
        """Take the result of a scan, and return it where it is agreed.

        `received` returns when a scan with a stamp was received.
        """
        stamp = nanoseconds(stamped) or nanoseconds(self._clock.now())
        got, doubted = received(stamp), self._agreement.doubts_odometry(stamp)
        known = self._odometry.known(stamp, got, doubted=doubted)
        if known is None and doubted and got is not None and not self._odometry.same_place(stamp, got):
            self._health.warn(self._odometry.clocks(stamp, got), stamped, "clocks")
        scan = observation_of(answer, known, stamp)
        event = self._agreement.take(scan)
        if self._agreement.latest is None:
            self._correction = MapToOdom()  # where the clock was set back, the agreement forgets the pose
        self._correction.take(event, scan)
        if event is Event.CONTRADICTED:
            self._pending = None
            self._health.note("a scan contradicts the agreed pose; drive on until a new pose is agreed")
        if event not in (Event.AGREED, Event.CONFIRMED):
            return None
        self._follow(scan.map_id)
        names = self._frame_of(scan), self.odom_frame
        # The same coordinates on another map are another place, and the map of the localizer is known by what it got.
        agrees = None
        if scan.map_id == self._localizer_map:
            agrees = self._watch.compare(scan, names, self._frames, self._odometry)
        else:
            self._initial.want()
        reason = self._initial.decide(event, localizer_agrees=agrees, lost=self._watch.lost, now=time.monotonic())
        self._publish_agreed(stamped, scan, reason)
        return scan

    def _follow(self, map_id: str | None) -> None:
        """Publish the map of the agreed pose where it is another one than before."""
        name = UNNAMED if self._maps is None else self._maps.name_of(map_id)
        if name == self._map_name:
            return
        changed = f"the map changed from {self._map_name} to {name}" if self._map_name else f"the map is {name}"
        self._map_name = name
        self._topics.map_id.publish(String(name))
        if map_id is not None:
            self._publish_walls(map_id)
            self._health.log(changed)

    def _publish_agreed(self, stamp: Time, scan: Observation, reason: str | None) -> None:
        if scan.pose is None or scan.covariance is None:
            return
        agreed = stamped_pose(stamp, scan.pose, scan.covariance, self._frame_of(scan))
        self._topics.agreed.publish(agreed)
        self._requests.answer(agreed, self._map_name)
        if reason is not None:
            self._pending = stamp, scan, reason
            self.publish_initial()

    def publish_initial(self) -> None:
        """Publish the pose that waits to be, unless a subscriber has come that would not receive it yet.

        A new subscriber wants the pose. It is published only to known subscribers: to one that is discovered in the
        meantime it would go twice.
        """
        if self._topics.initial.joined():
            self._initial.want()
            self._settled = time.monotonic() + SETTLE_SECONDS
        if self._pending is None or time.monotonic() < self._settled:
            return
        (stamp, scan, reason), self._pending = self._pending, None
        if scan.pose is None or scan.covariance is None:
            return
        if reason == "lost":
            self._health.beat(State.LOST, self._clock.now(), self.values)
        subscribed = self._topics.initial.subscribed
        self._initial.published(subscribed=subscribed, now=time.monotonic())
        self._watch.reset()
        x, y, degrees = scan.pose.x, scan.pose.y, math.degrees(scan.pose.theta)
        name, place = self._topics.initial.name, f"x {x:.2f} m, y {y:.2f} m, {degrees:.0f} degrees"
        place = place if scan.map_id is None else f"{place} on {scan.map_id}"
        if not subscribed:
            if self._topics.tf is None:  # else the transform is enough
                problem = f"not published, because {name} has no subscriber ({reason}): {place}"
                self._health.note(problem, "no subscriber")
            return
        widened = at_least(scan.covariance, self._options.min_sigma, self._options.min_sigma_theta)
        self._topics.initial.publish(stamped_pose(stamp, scan.pose, widened, self._frame_of(scan)))
        self._localizer_map = scan.map_id
        line = f"published {name} ({reason}): {place}"
        self._health.note(line, line)

    def publish_transform(self) -> None:
        """Publish the transform from the map to the odometry frame, if that is wanted and it is time."""
        newest = self._odometry.newest
        if self._topics.tf is None or newest is None:
            return
        stamp, odometry, known = newest
        if -MOST_GAP_NS < stamp - self._transformed < TRANSFORM_PERIOD_NS:
            return
        map_from_odom = self._correction.advance(stamp, odometry, known.part, known.unknown_ns / NS)
        if map_from_odom is None or self._agreement.refuted:
            return
        # On a grid of times: messages end the waiting at any time, and the rate would be less.
        next_one = self._transformed + TRANSFORM_PERIOD_NS
        self._transformed = next_one if 0 <= stamp - next_one < TRANSFORM_PERIOD_NS else stamp
        ahead = time_of(stamp + TRANSFORM_TOLERANCE_NS)
        frames = self._frame_of(self._agreement.latest), self.odom_frame
        self._topics.tf.publish(transform_of(ahead, frames, map_from_odom))

    def state(self, *, searched: bool) -> State:
        """Return the state of the pose; `searched` is whether the last scans could be searched."""
        if self._agreement.latest is None:
            return State.SEARCHING if searched else State.NO_SCAN
        if self._agreement.contradicted:
            return State.CONTRADICTED
        return State.LOST if self._watch.lost else State.AGREED

    @property
    def values(self) -> dict[str, str]:
        """The state as keys and values, for diagnostics."""
        agreeing, moved, turned = self._agreement.progress
        latest = self._agreement.latest
        values = {
            "scans that agree": f"{agreeing} of {self._options.agree}",
            "moved": f"{moved:.2f} m, {math.degrees(turned):.0f} degrees",
        }
        if latest is not None and latest.pose is not None:
            values["pose"] = f"{latest.pose.x:.3f} {latest.pose.y:.3f} {latest.pose.theta:.4f}"
            values["stamp"] = f"{latest.stamp / 1e9:.3f}"
            values["map_id"] = self._map_name
        return values
