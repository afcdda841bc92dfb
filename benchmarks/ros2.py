"""Each log over DDS to the bridge, a process of its own: whether what it says is right, and what the way costs.

``python -m benchmarks ros2``
"""

from __future__ import annotations

import math
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from cyclonedds.domain import DomainParticipant

import linefix
from association import MapIndex, associate
from formats.logs.lasers import laser_of
from formats.report import Notes
from ros2 import messages
from ros2.odometry import nanoseconds
from ros2.transforms import NS
from ros2.wire import LATCHED, RELIABLE, SENSOR, Publisher, Subscription, Waiting

from .collection import Collection, Query
from .outcomes import is_right, offset, progress
from .queries import logs
from .ranges import Log
from .table import Row, at_most, print_rows, quantile

ROOT = Path(__file__).parents[1]
LOOPBACK = (
    "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name='lo' multicast='true'/></Interfaces></General>"
    "<Discovery><ParticipantIndex>auto</ParticipantIndex></Discovery></Domain></CycloneDDS>"
)
DOMAINS = 60, 40  # the first that is used, and how many: others may measure at the same time
PATIENCE = 30.0  # s for what has to come about
MORE_MS = 3.0  # than `associate` takes, in the median
BASE_FROM_LASER = linefix.RigidTransform(0.25, 0.0, 0.0)
PERIOD = NS // 10  # between scans, and
STEPS = 5  # so much odometry with each: 50 Hz
SETTLING = 1.5  # s; a new subscriber gets the pose after a second
STEPS_TIMED = ("way", "search", "vectorize")


@dataclass(frozen=True, slots=True)
class Exchange:
    """The result of a scan, over DDS and in this process.

    Attributes
    ----------
    query : Query
    stamp : int
        Its time, nanoseconds.
    said : RigidTransform or None
        Of the robot, by the bridge; None where it said no pose.
    usable : bool
        By the search in this process.
    way, vectorize, search : float
        Milliseconds: from before the scan is published until its pose is read, or what the bridge says instead; and
        in this process.
    """

    query: Query
    stamp: int
    said: linefix.RigidTransform | None
    usable: bool
    way: float
    vectorize: float
    search: float


class Player:
    """A robot that plays a log and subscribes to the topics of the bridge."""

    def __init__(self, domain: int) -> None:
        net = DomainParticipant(domain)
        self._scans = Publisher(net, "/scan", messages.LaserScan, SENSOR)
        self._odometry = Publisher(net, "/odom", messages.Odometry, SENSOR)
        self._mounts = Publisher(net, "/tf_static", messages.TFMessage, LATCHED)
        self._initial = Subscription(net, "/initialpose", messages.PoseWithCovarianceStamped, RELIABLE)
        self._poses = Subscription(net, "/linefix/pose", messages.PoseWithCovarianceStamped, RELIABLE)
        self._diagnostics = Subscription(net, "/diagnostics", messages.DiagnosticArray, RELIABLE)
        self._waiting = Waiting(net, [self._poses, self._diagnostics])

    def meet(self, blind: messages.LaserScan) -> None:
        """Say where the scanner sits, and wait until a scan that sees nothing is answered."""
        place = messages.Transform(messages.Vector3(BASE_FROM_LASER.x, BASE_FROM_LASER.y, 0.3))
        header = messages.Header(frame_id="base_link")
        self._mounts.publish(messages.TFMessage([messages.TransformStamped(header, blind.header.frame_id, place)]))
        ends = time.monotonic() + PATIENCE
        while time.monotonic() < ends:
            self._scans.publish(blind)
            self._waiting.wait(0.2)
            if any(
                told.header.stamp == blind.header.stamp and "no transform" not in told.status[0].message
                for told in self._diagnostics.take()
            ):
                time.sleep(0.5)  # for what was sent meanwhile
                self._diagnostics.take()
                return
        raise RuntimeError("the bridge does not answer")

    def ask(self, scan: messages.LaserScan, driven: Sequence[messages.Odometry]) -> tuple[float, list[messages.Pose]]:
        """Publish a scan; return milliseconds until it is answered, and the poses that were said of it."""
        for one in driven:
            self._odometry.publish(one)
        time.sleep(0.01)
        poses: list[messages.Pose] = []
        answered = math.nan
        begun = time.perf_counter()
        self._scans.publish(scan)
        while (now := time.perf_counter()) < begun + PATIENCE:
            self._waiting.wait(1.0)
            found = [told.pose.pose for told in self._poses.take() if told.header.stamp == scan.header.stamp]
            now = time.perf_counter()
            poses += found
            ended = any(told.header.stamp == scan.header.stamp for told in self._diagnostics.take())
            if math.isnan(answered) and (found or ended):
                answered = 1e3 * (now - begun)
            if ended:  # the diagnostics are the last message about a scan
                return answered, poses
        raise RuntimeError("the bridge does not answer")

    def initial(self) -> list[int]:
        """Return the stamps of ``/initialpose`` published since the last call."""
        return [nanoseconds(told.header.stamp) for told in self._initial.take()]


@contextmanager
def running_bridge(map_file: Path, domain: int) -> Iterator[None]:
    """Run ``linefix ros2`` as long as needed."""
    program = "import sys; from cli.entry import run; sys.exit(run(['ros2', *sys.argv[1:]]))"
    command = [sys.executable, "-c", program, "--map", str(map_file), "--agree", "1"]
    environment = {**os.environ, "ROS_DOMAIN_ID": str(domain), "CYCLONEDDS_URI": LOOPBACK}
    process = subprocess.Popen(command, cwd=ROOT, env=environment, stderr=subprocess.PIPE, text=True)
    try:
        assert process.stderr is not None
        said = process.stderr.readline()
        if "listening" not in said:
            raise RuntimeError(said + process.stderr.read())
        yield
    finally:
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=PATIENCE)


def message_of(log: Log, number: int, at: int) -> messages.LaserScan:
    """Return a scan of a log as a robot publishes it at a time, nanoseconds."""
    laser = log.laser(number)
    return messages.LaserScan(
        messages.Header(messages.Time(at // NS, at % NS), "laser"),
        laser.angle_min, float(log.angles[-1]), laser.angle_increment,
        range_min=laser.range_min, range_max=laser.range_max, ranges=laser.ranges.tolist(),
    )  # fmt: skip


def planar_of(pose: messages.Pose) -> linefix.RigidTransform:
    """Return a pose of a message as one in the plane."""
    turn = pose.orientation
    return linefix.RigidTransform(pose.position.x, pose.position.y, 2.0 * math.atan2(turn.z, turn.w))


def odometry_of(pose: linefix.RigidTransform, at: int) -> list[messages.Odometry]:
    """Return what odometry says before a scan."""
    half = 0.5 * pose.theta
    place = messages.Pose(messages.Point(pose.x, pose.y), messages.Quaternion(z=math.sin(half), w=math.cos(half)))
    stamps = [at - k * PERIOD // STEPS for k in range(STEPS)][::-1]
    return [
        messages.Odometry(
            messages.Header(messages.Time(stamp // NS, stamp % NS), "odom"),
            "base_link",
            messages.PoseWithCovariance(place),
        )
        for stamp in stamps
    ]


def search(index: MapIndex, message: messages.LaserScan) -> tuple[bool, float, float]:
    """Answer a scan in this process; return whether that is usable, and the milliseconds of both steps."""
    laser = laser_of(messages.LaserScan.deserialize(message.serialize()), Notes())
    begun = time.perf_counter()
    scan = linefix.scan_of(laser)
    between = time.perf_counter()
    answer = associate(index, scan)
    return answer.usable, 1e3 * (between - begun), 1e3 * (time.perf_counter() - between)


def play(collection: Collection) -> tuple[list[Exchange], list[int]]:
    """Play a log to a bridge of its own; return the stamps, too, that ``/initialpose`` was said for."""
    name, domain = collection.name, DOMAINS[0] + os.getpid() % DOMAINS[1]
    log, index = Log.load(name), collection.index((name, name))
    exchanges: list[Exchange] = []
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "map.json"
        linefix.write_map(linefix.LineMap(index.segments), file)
        os.environ["CYCLONEDDS_URI"] = LOOPBACK
        with running_bridge(file, domain):
            player = Player(domain)
            blind = message_of(log, 0, NS)
            blind.ranges = [math.inf] * len(blind.ranges)
            player.meet(blind)
            search(index, blind)
            for k, query in enumerate(collection.queries):
                at = 2 * NS + k * PERIOD
                message = message_of(log, query.number, at)
                way, poses = player.ask(message, odometry_of(query.pose, at))
                usable, vectorize, searched = search(index, message)
                said = planar_of(poses[0]) if poses else None
                exchanges.append(Exchange(query, at, said, usable, way, vectorize, searched))
                progress(f"{name}, over DDS", k + 1, len(collection.queries))
            time.sleep(SETTLING)
            return exchanges, player.initial()


def ros2(quick: int) -> list[Row]:
    """Print the table; nothing without data."""
    rows: list[Row] = []
    for collection in logs(quick):
        rows += _rows(collection, *play(collection))
    if rows:
        print_rows("Logs over DDS to the bridge", rows)
    else:
        print("\nLogs over DDS to the bridge: no logs are here.")
    return rows


def _rows(collection: Collection, exchanges: Sequence[Exchange], initial: Sequence[int]) -> list[Row]:
    name, count = collection.name, len(exchanges)
    usable = [one for one in exchanges if one.usable]
    right, where = _first(collection, exchanges, initial)
    same = sum((one.said is not None) == one.usable for one in exchanges)
    more = [one.way - one.search for one in usable]
    way, found, vectorized = (quantile((getattr(one, step) for one in usable), 0.5) for step in STEPS_TIMED)
    return [
        Row(f"{name}: poses on /initialpose", where, "right", right),
        Row(f"{name}: as usable as without DDS", f"{same} of {count} scans", "all", same == count),
        at_most(f"{name}: pose after scan, ms more than associate, median", quantile(more, 0.5), MORE_MS, form=".2f"),
        at_most("  p95", quantile(more, 0.95), form=".2f"),
        Row("  medians, ms: scan to pose, associate, vectorize", f"{way:.2f}, {found:.2f}, {vectorized:.2f}"),
    ]


def _first(collection: Collection, exchanges: Sequence[Exchange], initial: Sequence[int]) -> tuple[bool, str]:
    """Return whether the poses on ``/initialpose`` are right, and where the first of them is."""
    of_stamp = {one.stamp: one for one in exchanges}
    published = [of_stamp[stamp] for stamp in initial]
    if not published or published[0].said is None:
        return False, "none"
    truths = [one.query.pose.compose(BASE_FROM_LASER.inverse()) for one in published]
    distance, angle = offset(published[0].said, truths[0])
    right = all(is_right(one.said, truth, collection) for one, truth in zip(published, truths, strict=True))
    number = published[0].query.number
    return right, f"scan {number}, {100.0 * distance:.1f} cm, {angle:.2f} deg off, published {len(initial)} time(s)"
