"""The bridge in a process of its own, and a robot next to it: both over loopback."""

from __future__ import annotations

import math
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

import linefix
from ros2 import Maps, Node, NodeOptions, messages
from ros2.clock import time_of
from ros2.topics import LATCHED, RELIABLE, SENSOR, Publisher, Subscription

ROOT = Path(__file__).parent.parent.parent
LOOPBACK = (
    "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name='lo' multicast='true'/></Interfaces></General>"
    "<Discovery><ParticipantIndex>auto</ParticipantIndex></Discovery></Domain></CycloneDDS>"
)
START_SECONDS = 600.0  # in which the process of the node has to start: kernels may have to be compiled first
PATIENCE = 60.0  # s for what has to come about
POLL = 0.05  # s between two looks whether it has

ROOM = np.array([[0, 0, 6, 0], [6, 0, 6, 2], [6, 2, 4, 2], [4, 2, 4, 5], [4, 5, 0, 5], [0, 5, 0, 0]], dtype=float)
UPSTAIRS = np.array(
    [[0, 0, 6, 0], [6, 0, 6, 5], [6, 5, 3, 5], [3, 5, 3, 2.6], [3, 2.6, 0, 2.6], [0, 2.6, 0, 0]], dtype=float
)
WALLS = linefix.Segments.from_array(ROOM)
FLOORS = {"hq-1": WALLS, "hq-2": linefix.Segments.from_array(UPSTAIRS)}
MAP_FROM_BASE = linefix.RigidTransform(1.0, 1.5, 0.4)
BASE_FROM_LASER = linefix.RigidTransform(0.3, -0.1, 2.0)
SCANNER = linefix.simulation.Scanner(beams=720, sigma=0.01)


def quaternion(theta: float) -> messages.Quaternion:
    return messages.Quaternion(0.0, 0.0, math.sin(0.5 * theta), math.cos(0.5 * theta))


def mount(child: str = "laser") -> messages.TFMessage:
    place = messages.Transform(
        messages.Vector3(BASE_FROM_LASER.x, BASE_FROM_LASER.y, 0.2), quaternion(BASE_FROM_LASER.theta)
    )
    return messages.TFMessage([messages.TransformStamped(messages.Header(frame_id="base_link"), child, place)])


def at_second(second: float) -> messages.Time:
    return time_of(round(1e9 * second))


def laser_scan(
    ranges: Any, second: float, frame: str = "laser", scanner: linefix.simulation.Scanner = SCANNER, **more: Any
) -> messages.LaserScan:
    """Return the message of ranges."""
    first, step = scanner.angle_min, scanner.angle_increment
    limits = {"range_min": 0.05, "range_max": 30.0, "ranges": np.asarray(ranges).tolist(), **more}
    last = first + (len(ranges) - 1) * step
    return messages.LaserScan(messages.Header(at_second(second), frame), first, last, step, **limits)


def scan_from(
    base: linefix.RigidTransform,
    second: float,
    frame: str = "laser",
    walls: linefix.Segments = WALLS,
    mounted: linefix.RigidTransform = BASE_FROM_LASER,
    scanner: linefix.simulation.Scanner = SCANNER,
) -> messages.LaserScan:
    """Return what a robot scans from a pose, map_from_base."""
    rng = np.random.default_rng(int(1e3 * second))
    ranges = linefix.simulation.scan(walls, base.compose(mounted), scanner, rng).ranges
    return laser_scan(ranges, second, frame, scanner)


def scan(second: int, *, seen: bool = True) -> messages.LaserScan:
    """Return what the robot sees; `seen` False: nothing within its range."""
    found = scan_from(MAP_FROM_BASE, second + 5e-9)
    return found if seen else replace(found, ranges=[math.inf] * 720)


def odometry_at(
    second: float, at: linefix.RigidTransform, frame: str = "odom", child: str = "base_link"
) -> messages.Odometry:
    message = messages.Odometry(messages.Header(at_second(second), frame), child)
    message.pose.pose = messages.Pose(messages.Point(at.x, at.y), quaternion(at.theta))
    return message


def grid_of_room(frame: str = "map") -> messages.OccupancyGrid:
    size, cell = 140, 0.05
    x, y = np.meshgrid(*[np.arange(size) * cell + 0.5 * cell - 0.5] * 2)
    free = (x > 0) & (y > 0) & (((x < 6) & (y < 2)) | ((x < 4) & (y < 5)))
    near = np.zeros_like(free)
    for dx in (-1, 0, 1):
        for dy in (-1, 0, 1):
            near |= np.roll(free, (dy, dx), (0, 1))
    cells = np.where(free, 0, np.where(near, 100, -1)).ravel().tolist()
    info = messages.MapMetaData(resolution=cell, width=size, height=size)
    info.origin.position = messages.Point(-0.5, -0.5, 0.0)
    return messages.OccupancyGrid(messages.Header(frame_id=frame), info, cells)


def floors(**frames: str) -> Maps:
    """Return two floors that are searched together; the frame of each is `map` unless it is given."""
    return Maps(linefix.index_maps(FLOORS), {name: frames.get(name, "map") for name in FLOORS})


@contextmanager
def running(
    options: NodeOptions, maps: linefix.MapIndex | Maps | None, log: Callable[[str], None] = lambda _: None
) -> Iterator[Node]:
    """Run a bridge in a thread of this process, which takes no time to start."""
    node = Node(options, Maps(maps, {"room": "map"}) if isinstance(maps, linefix.MapIndex) else maps, log)
    node.wait_until_ready()
    with ThreadPoolExecutor(1) as pool:
        ended = pool.submit(node.run)
        try:
            yield node
            assert not ended.done()
        finally:
            node.end()
            ended.result(PATIENCE)
            assert node.close(PATIENCE)


def wait_until(condition: Callable[[], object], problem: Callable[[], object] = lambda: None) -> None:
    """Return when a condition holds."""
    ends = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < ends, problem()
        time.sleep(POLL)


def deliver(publisher: Publisher[Any]) -> None:
    """Wait until a bridge has received what was published reliably."""
    wait_until(lambda: publisher.joined() or publisher.subscribed)
    assert publisher.received(PATIENCE)


@dataclass(frozen=True, slots=True)
class Bridge:
    """The process of a bridge, and the file that it logs to."""

    process: subprocess.Popen[bytes]
    log: BinaryIO

    @property
    def logged(self) -> bytes:
        return os.pread(self.log.fileno(), 100_000, 0)


@contextmanager
def bridge(*arguments: str) -> Iterator[Bridge]:
    """Run ``linefix ros2`` in a process of its own."""
    program = "import sys; from cli.entry import run; sys.exit(run(['ros2', *sys.argv[1:]]))"
    with tempfile.TemporaryFile() as log:
        process = subprocess.Popen(
            [sys.executable, "-c", program, *arguments], cwd=ROOT, env=dict(os.environ), stderr=log
        )
        try:
            found, until = Bridge(process, log), time.monotonic() + START_SECONDS
            while b"subscribed to" not in (said := found.logged):
                assert process.poll() is None, said
                assert time.monotonic() < until, said
                time.sleep(POLL)
            yield found
            if process.poll() is None:
                process.send_signal(signal.SIGTERM)
                assert process.wait(PATIENCE) == 0
        finally:
            process.kill()
            process.wait()


class Robot:
    """The topics of a robot, and what the bridge says to it."""

    def __init__(self, domain: int, namespace: str = "") -> None:
        from cyclonedds.domain import DomainParticipant

        self.net = net = DomainParticipant(domain)
        self.scans = Publisher(net, f"{namespace}/scan", messages.LaserScan, SENSOR)
        self.mounts = Publisher(net, f"{namespace}/tf_static", messages.TFMessage, LATCHED)
        self.maps = Publisher(net, f"{namespace}/map", messages.OccupancyGrid, LATCHED)
        self.asking = Publisher(net, f"{namespace}/linefix/locate", messages.Empty, RELIABLE)
        self.initial = Subscription(net, f"{namespace}/initialpose", messages.PoseWithCovarianceStamped, RELIABLE)
        self.poses = Subscription(net, f"{namespace}/linefix/pose", messages.PoseWithCovarianceStamped, RELIABLE)
        self.markers = Subscription(net, f"{namespace}/linefix/markers", messages.MarkerArray, LATCHED)
        self.walls = Subscription(net, f"{namespace}/linefix/map_markers", messages.MarkerArray, LATCHED)
        self.diagnostics = Subscription(net, "/diagnostics", messages.DiagnosticArray, RELIABLE)
        self.status = Subscription(net, f"{namespace}/linefix/status", messages.DiagnosticStatus, LATCHED)
        self._connected = False

    def connect(self) -> None:
        """Wait until the bridge has discovered the subscriptions: the last of them is received, so all are."""
        wait_until(self.status.take)
        self._connected = True

    def until(self, heard: Subscription[Any], play: Callable[[], None], wanted: Callable[[Any], bool] = bool) -> Any:
        """Play again and again until something wanted is received; return it."""
        if not self._connected:
            self.connect()
        ends = time.monotonic() + PATIENCE
        while time.monotonic() < ends:
            play()
            time.sleep(POLL)
            for message in heard.take():
                if wanted(message):
                    return message
        raise AssertionError(f"nothing on {heard.name}; told: {self.diagnostics.take()}")


def is_at_truth(message: messages.PoseWithCovarianceStamped) -> bool:
    at, turn = message.pose.pose.position, message.pose.pose.orientation
    away = math.hypot(at.x - MAP_FROM_BASE.x, at.y - MAP_FROM_BASE.y)
    return away < 0.03 and abs(2.0 * math.atan2(turn.z, turn.w) - MAP_FROM_BASE.theta) < 0.02
