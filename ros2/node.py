"""The node: subscribes to scans, searches them, and publishes the pose that they agree on."""

from __future__ import annotations

import gc
import sys
import time
from collections.abc import Callable, Sequence

from cyclonedds.topic import Topic

from .connecting import connect
from .inputs import Inputs
from .localization import Localization
from .looking import Gathering, looks_of
from .maps import MapConverter, Maps
from .messages import NS, LaserScan
from .options import NodeOptions, quoted
from .reporting import WARN, answer_marker, stamped_pose, values_of, verdict_of
from .robot import Robot
from .searching import Found, Searcher
from .topics import Waiting
from .tuning import END_SECONDS, ODOMETRY_SECONDS, SAME_MAP, TRANSFORM_PERIOD_NS

BEAT = 0.2  # s between two checks whether to end
MARGIN = 1e-3  # s; so that a waiting time is over at the next check


def _to_stderr(line: str) -> None:
    print(f"linefix: {line}", file=sys.stderr, flush=True)


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

    def __init__(self, options: NodeOptions, maps: Maps | None = None, log: Callable[[str], None] = _to_stderr) -> None:
        self._options, self._unused = options, ""  # why the last map is not used
        participant = connect(options.domain)
        self._robot = Robot(participant, options, log)
        self._topics, self._health, self._odometry = self._robot.topics, self._robot.health, self._robot.odometry
        self._inputs, self._localization = Inputs(self._robot), Localization(self._robot)
        self._gathering = Gathering(len(options.scans), options.together_s)
        self._next: dict[int, Sequence[LaserScan]] = {}  # by topic; what has waited longest is first
        self._held: tuple[Found, float] | None = None  # a result that waits for odometry, and until when
        self._ended, self._searched = False, False
        self._beat = TRANSFORM_PERIOD_NS / NS if options.publish_tf else BEAT
        self._types = [one for one in participant.children if isinstance(one, Topic)]
        self._waiting = Waiting(participant, self._topics.subscriptions)
        self._searcher = Searcher(options, self._waiting.wake)
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
        """Delete readers and writers of the node, after `close`, so that other participants discover that it is gone.

        DDS waits here for subscribers that have not received everything, and without limit for one that is gone. Topics
        stay: Cyclone DDS reads the type of the first sample that it stored when it deletes samples of other types.
        """
        for name in vars(self).keys() - {"_types"}:
            delattr(self, name)
        gc.collect()

    def turn(self) -> None:
        """Take the messages and results that have come, and search the newest scans."""
        self._robot.take_clock()
        self._robot.take_transforms()
        self._localization.take_localizer()
        self._turn_maps()
        self._localization.take_requests()
        self._robot.take_odometry(self._localization.map_frames)
        self._turn_results()
        self._localization.publish_initial()
        self._turn_scans()
        if not self._inputs.transform_stops:
            self._localization.publish_transform()
        self._robot.report_undecodable()
        doubt = self._inputs.doubt
        state = self._localization.state(searched=self._searched, confirmed=not doubt)
        values = {**self._localization.values, **self._inputs.values}
        self._health.beat(state, self._robot.clock.now(), values, doubt)

    def _turn_maps(self) -> None:
        if self._converter is None:
            return
        for topic in self._topics.maps:
            for grid in topic.take():
                self._inputs.map()
                self._converter.take(grid)
        converted = self._converter.result()
        if converted is None:
            return
        name = self._topics.maps[0].name
        if converted.maps is None:
            self._unused = f"the map on {name} is not used: {converted.problem}"
            self._health.problem(self._unused)
            return
        maps, before = converted.maps, self._localization.maps
        same = maps.similarity(before)
        self._localization.use(maps, kept=same >= SAME_MAP)
        walls, frame = len(maps.walls_of(None)), maps.frame_of(None)
        changed = f"; {100.0 * (1.0 - same):.1f} % of the walls are new or gone" if before is not None else ""
        kept = "" if not changed else ", the pose is kept" if same >= SAME_MAP else ", the pose is discarded"
        self._health.log(f"map from {name}: {converted.size}, {walls} walls, frame {quoted(frame)}{changed}{kept}")

    def _turn_scans(self) -> None:
        for topic, scans in enumerate(self._topics.scans):
            for scan in scans.take():
                self._inputs.scan(scan)
                if self._options.together_s > 0.0:
                    self._gathering.take(topic, scan)
                else:
                    self._next[topic] = [scan]
        if ready := self._gathering.ready():
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
            if time.monotonic() < until and self._localization.awaits_odometry(found.stamp, self._inputs.latency):
                return
            self._held = None
            self._take_result(found)

    def _search(self, scans: Sequence[LaserScan]) -> None:
        stamp = scans[0].header.stamp
        maps = self._localization.maps
        if maps is None:
            converting = self._converter is not None and self._converter.busy
            problem = (
                "the map is being converted; scans are searched afterwards"
                if converting
                else self._unused or "no usable map has been received; start map_server, or set --map"
            )
            self._health.problem(f"{self._topics.maps[0].name}: {problem}", stamp)
            return
        looks, missing = looks_of(scans, self._robot.frames, self._options, self._odometry, self._topics.unprefixed)
        for problem in missing:
            self._health.problem(problem, stamp)
        for look in looks:
            for code, note in look.notes.items():
                told, about = f"{quoted(look.frame)}: {note}", f"{code} {look.frame}"
                self._health.problem(told, stamp, about=about, level=WARN)
        self._searched = bool(looks)
        if looks:
            self._inputs.searched()
            self._searcher.submit(maps, looks)

    def _take_result(self, found: Found) -> None:
        answer, stamp = found.answer, found.stamp
        if answer is None:
            self._health.problem(found.problem, stamp)
            return
        if found.maps is not self._localization.maps:
            return  # the map has changed meanwhile
        frame = found.maps.frame_of(answer.map_id)
        if answer.usable and answer.pose is not None and answer.covariance is not None:
            self._topics.pose.publish(stamped_pose(stamp, answer.pose, answer.covariance, frame))
        self._topics.markers.publish(answer_marker(answer, stamp, frame))
        if not self._inputs.shared:
            agreed = self._localization.take(found.maps, answer, stamp, self._inputs.latency)
            self._inputs.result(usable=answer.usable, agreed=agreed)
        self._health.publish("scan", stamp, verdict_of(answer), values_of(answer, 1e3 * found.seconds))
