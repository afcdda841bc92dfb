"""Write files to try Linefix on, as a robot's are: ``hq.yaml`` with ``hq.pgm``, and ``drive.mcap``.

``python -m examples.sample [FOLDER]``, by default into ``out``, draws an office floor, and drives through it
with a laser and with odometry that drifts. Furniture that is on no map stands in the rooms.
"""

from __future__ import annotations

import argparse
import math
import tempfile
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore
from scipy import ndimage

from registration import RigidTransform, Segments
from simulation import OfficePlan, Scanner, World, offices, scan

Floats = NDArray[np.float64]

SEED = 11
CELL = 0.05  # m
MARGIN = 0.5  # m of unknown space about the map
FREE, UNKNOWN, OCCUPIED = 254, 205, 0  # as map_saver writes them
STEP = 0.25  # m between scans
SPEED = 0.5  # m/s
DRIFT = (0.01, 0.01, math.radians(0.8))  # m, m, rad after a metre; standard deviations
SCANNER = Scanner.over(2.0 * math.pi, 720, range_max=12.0, sigma=0.01)
BOXES = 5


def main() -> None:
    """Write the files and print their names."""
    parser = argparse.ArgumentParser(prog="python -m examples.sample", description="Write a map and a drive to try.")
    parser.add_argument("folder", nargs="?", type=Path, default=Path("out"), help="where to, by default out")
    folder: Path = parser.parse_args().folder
    try:
        write_sample(folder)
    except OSError as error:
        parser.error(f"{folder} cannot be written to: {error.strerror}")


def write_sample(folder: Path) -> None:
    """Write the files into a folder, which is made if need be."""
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(SEED)
    floor = offices(rng, OfficePlan(rooms=4, corridors=1))
    way = way_through(floor)
    write_grid(folder, floor.segments, way[0])
    write_drive(folder / "drive.mcap", with_furniture(floor, rng), way, rng)
    print(f"{folder / 'hq.yaml'}, {folder / 'hq.pgm'}: a floor of 8 rooms on a corridor")
    print(f"{folder / 'drive.mcap'}: {len(way)} scans of a drive through it")


def way_through(floor: World) -> list[RigidTransform]:
    """Drive along the corridor, and into every other room and back; a pose every `STEP`."""
    rooms, doors = floor.poses[::2], floor.poses[1::2]
    stops: list[tuple[float, float]] = []
    middle = 0.5 * (min(door.y for door in doors) + max(door.y for door in doors))
    for room, door in sorted(zip(rooms, doors, strict=True), key=lambda pair: pair[1].x)[::2]:
        before, within = (door.x, middle), (door.x, door.y + 0.6 * (room.y - door.y))
        stops += [before, within, (room.x, room.y), within, before]
    poses = []
    for (ax, ay), (bx, by) in pairwise(stops):
        far, heading = math.hypot(bx - ax, by - ay), math.atan2(by - ay, bx - ax)
        shares = np.arange(0.0, 1.0, STEP / max(far, STEP)).tolist()
        poses += [RigidTransform(ax + t * (bx - ax), ay + t * (by - ay), heading) for t in shares]
    return poses


def with_furniture(floor: World, rng: np.random.Generator) -> Segments:
    """Put boxes into corners of rooms, out of the way."""
    boxes = []
    for room in floor.poses[::2][:BOXES]:
        x, y = room.x + 0.8, room.y + rng.choice((-1.4, 1.4))
        a, b = rng.uniform(0.15, 0.3, 2)
        corners = np.array([(x - a, y - b), (x - a, y + b), (x + a, y + b), (x + a, y - b)])
        boxes.append(np.hstack([corners, np.roll(corners, -1, axis=0)]))
    return Segments.from_array(np.vstack([floor.segments.endpoints, *boxes]))


def write_grid(folder: Path, walls: Segments, inside: RigidTransform) -> None:
    """Write the grid that a mapping drive leaves: walls, what was driven through, and the unknown about it."""
    ends = walls.endpoints.reshape(-1, 2)
    low, high = ends.min(axis=0) - MARGIN, ends.max(axis=0) + MARGIN
    columns, rows = np.ceil((high - low) / CELL).astype(int).tolist()
    wall = np.zeros((rows, columns), dtype=bool)
    for x0, y0, x1, y1 in walls.endpoints:
        count = 2 + int(2.0 * math.hypot(x1 - x0, y1 - y0) / CELL)
        at = ((np.linspace((x0, y0), (x1, y1), count) - low) / CELL).astype(int)
        wall[at[:, 1], at[:, 0]] = True
    regions, _ = ndimage.label(~wall)
    here = ((np.array((inside.x, inside.y)) - low) / CELL).astype(int)
    cells = np.full((rows, columns), UNKNOWN, dtype=np.uint8)
    cells[regions == regions[here[1], here[0]]] = FREE
    cells[wall] = OCCUPIED
    Image.fromarray(cells[::-1]).save(folder / "hq.pgm")
    origin = f"[{low[0]:.3f}, {low[1]:.3f}, 0.0]"
    about = f"resolution: {CELL}\norigin: {origin}\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    (folder / "hq.yaml").write_text(f"image: hq.pgm\nmode: trinary\n{about}")


def write_drive(path: Path, walls: Segments, way: list[RigidTransform], rng: np.random.Generator) -> None:
    """Write a bag of ROS 2 with ``/scan``, ``/odom`` and the frames that these are in."""
    with tempfile.TemporaryDirectory(dir=path.parent) as folder:
        bag = Path(folder) / "drive"
        with Writer(bag, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
            log = _Log(writer)
            log.frame(0, "base_link", "laser", RigidTransform(0.0, 0.0, 0.0), static=True)
            odometry, before, seconds = RigidTransform(0.0, 0.0, 0.0), way[0], 0.0
            for pose in way:
                step = before.inverse().compose(pose)
                far = math.hypot(step.x, step.y)
                x, y, theta = (rng.normal(size=3) * DRIFT * math.sqrt(far)).tolist()
                odometry = odometry.compose(RigidTransform(step.x + x, step.y + y, step.theta + theta))
                seconds, before = seconds + far / SPEED + 0.1, pose
                ns = int(1e9 * seconds)
                log.frame(ns, "odom", "base_link", odometry, static=False)
                log.odometry(ns, odometry)
                log.scan(ns, scan(walls, pose, SCANNER, rng).ranges)
        (bag / "drive.mcap").replace(path)


class _Log:
    """Messages of ROS 2 in a bag."""

    def __init__(self, writer: Writer) -> None:
        self._writer, self._types, self._topics = writer, get_typestore(Stores.ROS2_HUMBLE), dict[str, Any]()

    def scan(self, ns: int, ranges: Floats) -> None:
        numbers = (SCANNER.angle_min, SCANNER.angle_min + SCANNER.angle_increment * (len(ranges) - 1))
        limits = (SCANNER.angle_increment, 0.0, 0.0, 0.05, SCANNER.range_max)
        read, nothing = ranges.astype(np.float32), np.zeros(0, dtype=np.float32)
        kind = "sensor_msgs/msg/LaserScan"
        self._write("/scan", kind, ns, self._make(kind, self._header(ns, "laser"), *numbers, *limits, read, nothing))

    def odometry(self, ns: int, pose: RigidTransform) -> None:
        place = self._make(
            "geometry_msgs/msg/Pose", self._make("geometry_msgs/msg/Point", pose.x, pose.y, 0.0), self._turn(pose)
        )
        still = self._make("geometry_msgs/msg/Vector3", 0.0, 0.0, 0.0)
        unknown = np.zeros(36)
        twist = self._make(
            "geometry_msgs/msg/TwistWithCovariance", self._make("geometry_msgs/msg/Twist", still, still), unknown
        )
        placed = self._make("geometry_msgs/msg/PoseWithCovariance", place, unknown)
        kind = "nav_msgs/msg/Odometry"
        self._write("/odom", kind, ns, self._make(kind, self._header(ns, "odom"), "base_link", placed, twist))

    def frame(self, ns: int, parent: str, child: str, pose: RigidTransform, *, static: bool) -> None:
        place = self._make(
            "geometry_msgs/msg/Transform",
            self._make("geometry_msgs/msg/Vector3", pose.x, pose.y, 0.0),
            self._turn(pose),
        )
        one = self._make("geometry_msgs/msg/TransformStamped", self._header(ns, parent), child, place)
        kind = "tf2_msgs/msg/TFMessage"
        self._write("/tf_static" if static else "/tf", kind, ns, self._make(kind, [one]))

    def _make(self, kind: str, *values: Any) -> Any:
        return self._types.types[kind](*values)

    def _header(self, ns: int, frame: str) -> Any:
        return self._make("std_msgs/msg/Header", self._make("builtin_interfaces/msg/Time", *divmod(ns, 10**9)), frame)

    def _turn(self, pose: RigidTransform) -> Any:
        return self._make("geometry_msgs/msg/Quaternion", 0.0, 0.0, math.sin(pose.theta / 2), math.cos(pose.theta / 2))

    def _write(self, topic: str, kind: str, ns: int, message: Any) -> None:
        if topic not in self._topics:
            self._topics[topic] = self._writer.add_connection(topic, kind, typestore=self._types)
        self._writer.write(self._topics[topic], ns, self._types.serialize_cdr(message, kind))


if __name__ == "__main__":
    main()
