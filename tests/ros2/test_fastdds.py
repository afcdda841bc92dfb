"""The node and a robot that uses eProsima Fast DDS, the default middleware of ROS 2: every topic in both directions.

It is built from IDL where a compiler and Debian's packages ``libfastrtps-dev`` and ``fastddsgen`` are installed.
"""

from __future__ import annotations

import queue
import shutil
import signal
import subprocess
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import numpy as np
import pytest

import linefix
from ros2 import NodeOptions

from .robot import BASE_FROM_LASER, FLOORS, PATIENCE, POLL, ROOM, SCANNER, bridge, floors, grid_of_room, running

SOURCES = Path(__file__).parent / "fastdds"
WALLS = linefix.Segments.from_array(ROOM)
HEADER = Path("/usr/include/fastdds/dds/domain/DomainParticipant.hpp")
MISSING = [tool for tool in ("fastddsgen", "g++") if shutil.which(tool) is None]

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(bool(MISSING) or not HEADER.exists(), reason="apt-get install libfastrtps-dev fastddsgen g++"),
]


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the robot."""
    folder = tmp_path_factory.mktemp("fastdds")
    for name in ("ros.idl", "robot.cpp"):
        shutil.copy(SOURCES / name, folder)
    sources = ["robot.cpp", "ros.cxx", "rosPubSubTypes.cxx"]
    for command in (
        ["fastddsgen", "-replace", "ros.idl"],
        ["g++", "-I.", *sources, "-o", "robot", "-lfastrtps", "-lfastcdr", "-pthread"],
    ):
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
    return folder / "robot"


class Peer:
    """A robot in a process of its own: commands in, lines out."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self._process = process
        self._lines: queue.SimpleQueue[str] = queue.SimpleQueue()
        self.reader = threading.Thread(target=self._read)
        self.reader.start()

    def _read(self) -> None:
        for line in self._process.stdout or ():
            self._lines.put(line.strip())

    def send(self, *words: object) -> None:
        assert self._process.stdin is not None
        self._process.stdin.write(" ".join(map(str, words)) + "\n")
        self._process.stdin.flush()

    def mount(self) -> None:
        self.send("mount", BASE_FROM_LASER.x, BASE_FROM_LASER.y, BASE_FROM_LASER.theta)

    def drive(self, at: linefix.RigidTransform, second: float, walls: linefix.Segments = WALLS) -> None:
        """Publish odometry and a scan from a pose, map_from_base."""
        stamp = int(second), int(1e9 * (second % 1.0))
        self.send("odom", *stamp, at.x, at.y, at.theta)
        rng = np.random.default_rng(int(1e3 * second))
        ranges = linefix.simulation.scan(walls, at.compose(BASE_FROM_LASER), SCANNER, rng).ranges
        self.send("scan", *stamp, SCANNER.angle_min, SCANNER.angle_increment, *ranges.round(4).tolist())

    def lines(self) -> list[str]:
        found = []
        while not self._lines.empty():
            found.append(self._lines.get())
        return found

    def until(
        self, begin: str, play: Callable[[], None] = lambda: None, wanted: Callable[[list[str]], bool] = bool
    ) -> list[str]:
        """Play until a line comes that begins so and is wanted; return its words. Lines after it stay."""
        ends, seen = time.monotonic() + PATIENCE, []
        while time.monotonic() < ends:
            play()
            time.sleep(POLL)
            while not self._lines.empty():
                line = self._lines.get()
                if line.startswith(begin) and wanted(line.split()):
                    return line.split()
                seen.append(line)
        raise AssertionError(f"no line that begins with {begin}: {seen[-20:]}")


@contextmanager
def peer(program: Path, domain: int, namespace: str = "") -> Iterator[Peer]:
    """Run a robot, and wait until a bridge has discovered its subscriptions: the last but one is received."""
    with peer_without_bridge(program, domain, namespace) as found:
        found.until("status")
        yield found


@contextmanager
def peer_without_bridge(program: Path, domain: int, namespace: str = "") -> Iterator[Peer]:
    with subprocess.Popen(
        [program, str(domain), namespace], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        found = Peer(process)
        try:
            found.until("ready")
            yield found
        finally:
            process.kill()
            found.reader.join()


class Way:
    """Drives on at 0.3 m/s, or rests."""

    def __init__(self, robot: Peer, second: float = 1.0) -> None:
        self.robot, self.second, self._driven = robot, second, 0.0
        self.walls = WALLS

    def __call__(self) -> None:
        self.second += 0.5
        self._driven = min(2.4, self._driven + 0.15)
        self.robot.drive(linefix.RigidTransform(0.8 + self._driven, 1.0, 0.1), self.second, self.walls)

    def rest(self) -> None:
        self.second += 0.5
        self.robot.drive(linefix.RigidTransform(0.8 + self._driven, 1.0, 0.1), self.second)


def test_scans_odometry_and_mounts_in_poses_and_status_out(domain: int, room: linefix.MapIndex, program: Path) -> None:
    with running(NodeOptions(domain=domain, publish_tf=True), room), peer(program, domain) as robot:
        robot.mount()
        way = Way(robot)
        found = robot.until("initialpose", way)
        seconds = float(found[1]) + 1e-9 * float(found[2])
        assert float(found[3]) == pytest.approx(0.8 + min(2.4, 0.3 * (seconds - 1.0)), abs=0.03)
        assert float(found[4]) == pytest.approx(1.0, abs=0.03)
        assert float(found[5]) == pytest.approx(0.1, abs=0.02)
        assert found[6] == "map"
        for expected in ("pose ", "tf map odom", "diagnostics linefix: localization: the pose is agreed"):
            robot.until(expected, way)


def test_a_robot_that_starts_again_gets_the_state_and_the_pose(
    domain: int, room: linefix.MapIndex, program: Path
) -> None:
    with running(NodeOptions(domain=domain), room):
        for second in (1.0, 100.0):
            with peer(program, domain) as robot:
                robot.mount()
                way = Way(robot, second)
                robot.until("initialpose", way)
                robot.until("diagnostics linefix: localization: the pose is agreed", way)
                if second > 1.0:
                    with peer(program, domain) as late:  # while the robot sends scans: without them the pose is stale
                        late.until("status 0 the pose is agreed", way)


def test_a_grid_is_received(domain: int, program: Path) -> None:
    grid = grid_of_room()
    options = NodeOptions(domain=domain, map_topic="map", agree=1)
    with running(options, None), peer(program, domain) as robot:
        robot.mount()
        robot.send("map", grid.info.resolution, grid.info.width, grid.info.height, -0.5, -0.5, *grid.data)
        found = robot.until("initialpose", Way(robot))
    assert float(found[4]) == pytest.approx(1.0, abs=0.05)


def silent_for_five_scans(robot: Peer, way: Way) -> None:
    """Rest until five scans in succession are without an initialpose; the first may come again with odometry."""
    found: list[str] = []
    while found[-5:] != ["pose"] * 5:
        assert len(found) < 50, found
        found.append(robot.until("", way.rest, lambda words: words[0] in ("pose", "initialpose"))[0])


def test_a_request_is_received(domain: int, room: linefix.MapIndex, program: Path) -> None:
    with running(NodeOptions(domain=domain, agree=1), room), peer(program, domain) as robot:
        robot.mount()
        way = Way(robot)
        robot.until("initialpose", way)
        silent_for_five_scans(robot, way)
        robot.send("locate")
        robot.until("initialpose", way.rest)


def test_the_other_topics(domain: int, room: linefix.MapIndex, program: Path) -> None:
    """A mount that moves, a localizer, agreed poses and markers."""
    with running(NodeOptions(domain=domain), room), peer_without_bridge(program, domain) as robot:
        robot.until("marker linefix/map 12")
        way = Way(robot)

        def drive() -> None:
            stamp = int(way.second + 0.5), int(1e9 * ((way.second + 0.5) % 1.0))
            robot.send("moving_mount", *stamp, BASE_FROM_LASER.x, BASE_FROM_LASER.y, BASE_FROM_LASER.theta)
            way()

        robot.until("agreed", drive)
        robot.until("marker linefix/robot", drive)

        def elsewhere() -> None:
            drive()
            robot.send("amcl", int(way.second), int(1e9 * (way.second % 1.0)), 0.5, 4.5, 1.0)

        robot.until("status 2 the pose of the localizer", elsewhere)


def test_the_map_of_the_agreed_pose(domain: int, program: Path) -> None:
    """The robot leaves a lift on another floor; a subscriber that comes later receives only the last map."""
    with running(NodeOptions(domain=domain, namespace="/tower"), floors()), peer(program, domain, "/tower") as robot:
        robot.mount()
        way = Way(robot)
        assert robot.until("map_id", way) == ["map_id", "hq-1"]
        robot.until("initialpose", way)
        way.walls, way._driven = FLOORS["hq-2"], 0.0
        assert robot.until("map_id", way) == ["map_id", "hq-2"]
        robot.until("initialpose", way)
        with peer_without_bridge(program, domain, "/tower") as late:
            assert late.until("map_id") == ["map_id", "hq-2"]


def test_the_end_does_not_wait_for_a_robot_that_is_gone(domain: int, map_file: str, program: Path) -> None:
    """Its process was killed, so that it acknowledges nothing any more, and DDS waits for it."""
    with bridge("--map", map_file, "--publish-tf") as started:
        with peer_without_bridge(program, domain) as robot:
            robot.mount()
            way = Way(robot)
            robot.until("initialpose", way)
            way()
        asked = time.monotonic()
        started.process.send_signal(signal.SIGTERM)
        assert started.process.wait(PATIENCE) == 0
        assert time.monotonic() - asked < 5.0  # documented: 2 s


def test_two_robots_in_one_domain(domain: int, program: Path) -> None:
    """Each has a namespace and a map; the mounts of both are on one topic, with the prefix of the robot."""
    with ExitStack() as stack:
        ways = []
        for name, walls in zip(("robot1", "robot2"), FLOORS.values(), strict=True):
            options = NodeOptions(domain=domain, namespace=f"/{name}", frame_prefix=f"{name}/")
            stack.enter_context(running(options, linefix.index_map(walls)))
            ways.append(Way(stack.enter_context(peer(program, domain, f"/{name}"))))
            ways[-1].walls = walls
        right = BASE_FROM_LASER.x, BASE_FROM_LASER.y, BASE_FROM_LASER.theta
        ways[1].robot.send("global_mount", "robot2/", 5.0, 5.0, 0.0)
        ways[0].robot.send("global_mount", "robot1/", *right)
        for way, other in (ways, ways[::-1]):
            found = way.robot.until("initialpose", way)
            assert float(found[4]) == pytest.approx(1.0, abs=0.03)
            assert float(found[5]) == pytest.approx(0.1, abs=0.02)
            assert not [line for line in other.robot.lines() if line.startswith("initialpose")]
            ways[1].robot.send("global_mount", "robot2/", *right)
