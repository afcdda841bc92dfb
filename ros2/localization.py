"""From the results of scans to the published poses of the robot: ``initialpose``, agreed poses, the transform."""

from __future__ import annotations

import math
import time
from collections.abc import Collection

import linefix
from formats.logs.tuning import MOST_GAP_NS

from .agreement import Agreement, Event, Observation
from .clock import time_of
from .deciding import InitialPose, MapToOdom, Watch
from .frames import FrameError
from .health import State
from .lag import Lag
from .maps import UNNAMED, Maps
from .messages import NS, String, Time, nanoseconds
from .options import quoted
from .reporting import WARN, at_least, map_marker, stamped_pose, transform_of
from .robot import Robot
from .searching import observation_of
from .tuning import SETTLE_SECONDS, TRANSFORM_PERIOD_NS, TRANSFORM_TOLERANCE_NS


class Localization:
    """Follows the pose that scans agree on, and publishes it.

    Parameters
    ----------
    robot : Robot

    Attributes
    ----------
    maps : Maps or None
        Those that are searched.
    """

    def __init__(self, robot: Robot) -> None:
        self._robot, self._odometry = robot, robot.odometry
        self._options, self._topics, self._health = robot.options, robot.topics, robot.health
        self.maps: Maps | None = None
        self._map_name, self._frame = UNNAMED, "map"  # of the last agreed pose
        self._localizer_map: str | None = None  # of the last pose that was published to a localizer
        self._agreement, self._initial = Agreement(robot.options.agree), InitialPose(robot.options.when)
        self._watch = Watch(robot.frames, robot.odometry, transforms=not robot.options.publish_tf)
        self._correction, self._lag = MapToOdom(), Lag(robot.odometry)
        self._pending: tuple[Time, Observation, str] | None = None
        self._settled = 0.0  # when the subscribers of initialpose are connected in both directions
        self._transformed = 0  # the time of the last transform that was published, nanoseconds

    def use(self, maps: Maps, *, kept: bool = False) -> None:
        """Take other maps, and forget the pose unless it is kept; the walls of a single map are published at once."""
        self.maps = maps
        if not kept:
            self._map_name, self._localizer_map = UNNAMED, None
            self.begin_again()
        if not maps.several:
            self._publish_walls(maps, None)

    def _publish_walls(self, maps: Maps, map_id: str | None) -> None:
        self._topics.walls.publish(map_marker(maps.walls_of(map_id), maps.frame_of(map_id)))

    @property
    def map_frames(self) -> Collection[str]:
        """The frames of the maps."""
        return () if self.maps is None else self.maps.frames.values()

    def begin_again(self) -> None:
        """Forget the pose: the robot was carried, or the map has changed."""
        self._agreement.reset()
        self._correction = MapToOdom()
        self._watch.reset()
        self._initial.want()
        self._pending = None

    def take_requests(self) -> None:
        """Take requests for a pose."""
        if self._topics.requests.take():
            self.begin_again()

    def take_localizer(self) -> None:
        """Take the poses of the robot's localizer; report those that cannot be used."""
        for pose in self._topics.amcl.take():
            frame = pose.header.frame_id.strip("/")
            try:
                if self.map_frames and frame and frame not in self.map_frames:
                    expected = "expected one in the frame of a map; it is not used"
                    raise FrameError(f"found a pose in {quoted(frame)}, {expected}")
                self._watch.take(pose)
            except FrameError as error:
                self._health.problem(f"{self._topics.amcl.name}: {error}")

    def awaits_odometry(self, stamped: Time, latency: int) -> bool:
        """Return whether odometry of a scan has still to come; `latency` as of `take`."""
        stamp = nanoseconds(stamped)
        return self._odometry.awaited(stamp + self._lag.shift(stamp, stamp + latency))

    def take(self, maps: Maps, answer: linefix.AssociationResult, stamped: Time, latency: int) -> bool:
        """Take the result on maps of a scan that was received so long after its stamp, ns; return if it is agreed."""
        stamp = nanoseconds(stamped) or nanoseconds(self._robot.clock.now())
        received = stamp + latency
        if answer.usable:
            self._lag.take(observation_of(answer, None, stamp), received)
        shift = self._lag.shift(stamp, received)
        if shift:
            told = f"{self._odometry.clocks(shift)} used by its time of reception"
            self._health.problem(told, stamped, about="clocks", level=WARN)
        scan = observation_of(answer, self._odometry.known(stamp + shift, received), stamp)
        event = self._agreement.take(scan)
        if self._agreement.latest is None:
            self._correction = MapToOdom()  # where the clock was set back, the agreement forgets the pose
        if event is Event.CONTRADICTED:
            self._pending = None
            self._health.note("a scan contradicts the agreed pose; drive on until a new pose is agreed")
        if event not in (Event.AGREED, Event.CONFIRMED):
            return False
        new = event is Event.AGREED
        self._correction.take(scan, new=new)
        self._follow(maps, scan.map_id)
        # The same coordinates on another map are another place, and the map of the localizer is known by what it got.
        agrees = None
        if scan.map_id == self._localizer_map:
            agrees = self._watch.compare(scan, self._frame, self._robot.odom_frame)
        else:
            self._initial.want()
        reason = self._initial.decide(new=new, localizer_agrees=agrees, lost=self._watch.lost, now=time.monotonic())
        self._topics.agreed.publish(stamped_pose(stamped, scan.pose, scan.covariance, self._frame))
        if reason is not None:
            self._pending = stamped, scan, reason
            self.publish_initial()
        return True

    def _follow(self, maps: Maps, map_id: str | None) -> None:
        """Publish the map of the agreed pose where it is another one than before."""
        name, self._frame = maps.name_of(map_id), maps.frame_of(map_id)
        if name == self._map_name:
            return
        changed = f"the map changed from {self._map_name} to {name}" if self._map_name else f"the map is {name}"
        self._map_name = name
        self._topics.map_id.publish(String(name))
        if map_id is not None:
            self._publish_walls(maps, map_id)
            self._health.log(changed)

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
        if reason == "lost":
            self._health.beat(State.LOST, self._robot.clock.now(), self.values)
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
        self._topics.initial.publish(stamped_pose(stamp, scan.pose, widened, self._frame))
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
        self._topics.tf.publish(transform_of(ahead, (self._frame, self._robot.odom_frame), map_from_odom))

    def state(self, *, searched: bool, confirmed: bool) -> State:
        """Return the state; whether the last scans could be searched, and may confirm a pose, is given."""
        if self.maps is None:
            return State.NO_MAP
        if self._agreement.latest is None:
            return State.SEARCHING if searched else State.NO_SCAN
        if self._agreement.contradicted:
            return State.CONTRADICTED
        if self._watch.lost:
            return State.LOST
        return State.AGREED if confirmed else State.STALE

    @property
    def values(self) -> dict[str, str]:
        """The state as keys and values, for diagnostics."""
        agreeing, moved, turned = self._agreement.progress
        latest = self._agreement.latest
        values = {
            "scans that agree": f"{agreeing} of {self._options.agree}",
            "moved": f"{moved:.2f} m, {math.degrees(turned):.0f} degrees",
        }
        if latest is not None:
            values["pose"] = f"{latest.pose.x:.3f} {latest.pose.y:.3f} {latest.pose.theta:.4f}"
            values["stamp"] = f"{latest.stamp / 1e9:.3f}"
            values["map_id"] = self._map_name
        return values
