"""Logs: text as CARMEN writes it, bags written by rosbags."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from formats import (
    FormatError,
    ImportOptions,
    IncompleteFileError,
    LoggedScan,
    LogOptions,
    MalformedFileError,
    UnsupportedFormatError,
    read_log,
    read_map,
)
from registration import RigidTransform

FLASER = "FLASER 4 1.0 2.0 81.91 3.0 10 20 1.5 9 20 0 100.25 host 100.25\n"
ROBOTLASER = (
    "ROBOTLASER1 0 -1.5 3.0 0.5 30 0.01 0 3 1 2 30 2 7 8 1 2 0.5 1 2 0.5 0 0 0 0 0 50.5 host 50.5\n"
    "RAWLASER1 0 -1.5 3.0 0.5 30 0.01 0 3 1 2 30 0 51.5 host 51.5\n"
)


def written(tmp_path: Path, content: str) -> Path:
    path = tmp_path / "robot.log"
    path.write_text(content)
    return path


def near(pose: RigidTransform | None, x: float, y: float, theta: float) -> bool:
    assert pose is not None
    return np.allclose([pose.x, pose.y, pose.theta], [x, y, theta], atol=1e-6)


def test_flaser_looks_over_half_a_turn_and_says_where_the_laser_was(tmp_path: Path) -> None:
    log = read_log(written(tmp_path, "# a comment\nPARAM a 1\n" + FLASER + "ODOM 1 2 3 0 0 0 1 host 1\n"))
    (scan,) = list(log)
    np.testing.assert_allclose(np.degrees(scan.laser.angles), [-90, -45, 0, 45], atol=1e-9)
    np.testing.assert_array_equal(scan.laser.cleaned, [1.0, 2.0, math.inf, 3.0])
    assert scan.stamp_ns == 100_250_000_000
    assert near(scan.pose, 10, 20, 1.5)
    assert near(scan.mount, 1, 0, 1.5)
    assert {n.code: n.count for n in log.report.read} == {"scans": 1}
    assert {n.code: n.count for n in log.report.dropped} == {"message_param": 1, "message_odom": 1}


def test_an_odd_number_of_beams_has_one_at_either_end(tmp_path: Path) -> None:
    ranges = " ".join(["1.0"] * 181)
    (scan,) = read_log(written(tmp_path, f"FLASER 181 {ranges} 0 0 0 0 0 0 1 host 1\n"))
    np.testing.assert_allclose(np.degrees(scan.laser.angles[[0, 90, 180]]), [-90, 0, 90], atol=1e-9)


FIELD, STEP = "PARAM laser_front_laser_fov", "PARAM laser_front_laser_resolution"


@pytest.mark.parametrize(
    ("params", "beams", "first", "last", "said"),
    [
        ("", 180, -90, 89, None), ("", 361, -90, 90, None), ("", 541, -135, 135, "number of ranges"),
        ("", 1081, -135, 135, "number of ranges"), ("", 381, -95, 95, "number of ranges"),
        ("", 682, -119.71, 119.71, "number of ranges"), ("", 401, -50, 50, "number of ranges"),
        ("", 500, -90, 89.64, "neither a PARAM"), (f"{STEP} 0.25\n", 1081, -135, 135, "by the PARAM"),
        (f"{FIELD} 190\n", 191, -95, 95, "by the PARAM"), (f"{FIELD} 180\n{STEP} 1.0\n", 180, -90, 89, None),
        (f"{FIELD} 240\n{STEP} 0.36\n", 667, -120, 119.76, "by the PARAM"),
        (f"{FIELD} 180\n{STEP} 0.25\n", 541, -135, 135, "contradict"),
    ],
)  # fmt: skip
def test_the_field_of_view_of_flaser(
    tmp_path: Path, params: str, beams: int, first: float, last: float, said: str | None
) -> None:
    log = read_log(written(tmp_path, f"{params}FLASER {beams} {'1.0 ' * beams} 0 0 0 0 0 0 1 host 1\n"))
    (scan,) = log
    np.testing.assert_allclose(np.degrees(scan.laser.angles[[0, -1]]), [first, last], atol=0.01)
    found = [n.message for n in log.report.assumed if n.code == "field_of_view"]
    assert (said is None and not found) or (said is not None and said in found[0])


def test_a_greatest_range_of_flaser_is_no_return(tmp_path: Path) -> None:
    path = written(tmp_path, "PARAM robot_front_laser_max 5.6 1 host 1\nFLASER 3 1.0 5.6 4.0 0 0 0 0 0 0 1 host 1\n")
    np.testing.assert_array_equal(next(iter(read_log(path))).laser.cleaned, [1.0, math.inf, 4.0])


def test_robotlaser_has_its_angles_and_poses_behind_the_remissions(tmp_path: Path) -> None:
    path = written(tmp_path, ROBOTLASER)
    (scan,) = read_log(path)
    np.testing.assert_allclose(scan.laser.angles, [-1.5, -1.0, -0.5])
    np.testing.assert_array_equal(scan.laser.cleaned, [1.0, 2.0, math.inf])
    assert (scan.stamp, near(scan.pose, 1, 2, 0.5)) == (50.5, True)
    (raw,) = read_log(path, LogOptions(topic="RAWLASER1"))
    assert (raw.stamp, raw.pose) == (51.5, None)


def test_broken_lines_are_dropped_and_counted(tmp_path: Path) -> None:
    content = "FLASER 5 1.0\nFLASER -1 2\nFLASER x\n" + FLASER + "FLASER 1 nan nan nan nan 0 0 0 1 host 1\nnothing\n"
    log = read_log(written(tmp_path, content))
    assert len(list(log)) == 1
    counts = {n.code: n.count for n in log.report.dropped}
    assert counts == {"broken_line": 4, "other_lines": 1}
    assert len(list(log)) == 1  # read again from the beginning
    assert {n.code: n.count for n in log.report.dropped} == counts


Write = Callable[[Any, Any], None]
ROS1, ROS2 = get_typestore(Stores.ROS1_NOETIC), get_typestore(Stores.ROS2_HUMBLE)
ROS1.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms", "tf2_msgs/msg/TFMessage"))
KINDS = ["bag", "sqlite3", "mcap"]


class Recorder:
    """Writes the same messages as a bag of either ROS."""

    def __init__(self, kind: str, folder: Path) -> None:
        self.types = ROS1 if kind == "bag" else ROS2
        self.path = folder / ("robot.bag" if kind == "bag" else f"robot_{kind}")
        if kind == "bag":
            self.writer: Any = Writer1(self.path)
        else:
            plugin = StoragePlugin.MCAP if kind == "mcap" else StoragePlugin.SQLITE3
            self.writer = Writer2(self.path, version=9, storage_plugin=plugin)
        self.kind = kind
        self.topics: dict[str, Any] = {}
        self.writer.open()

    def type(self, name: str, *values: Any) -> Any:
        return self.types.types[name](*values)

    def time(self, ns: int) -> Any:
        return self.type("builtin_interfaces/msg/Time", *divmod(ns, 10**9))

    def header(self, ns: int, frame: str) -> Any:
        stamp = self.time(ns)
        return self.type("std_msgs/msg/Header", *((0,) if self.kind == "bag" else ()), stamp, frame)

    def point(self, name: str, x: float, y: float, z: float = 0.0) -> Any:
        return self.type(f"geometry_msgs/msg/{name}", x, y, z)

    def turn(self, yaw: float, roll: float = 0.0) -> Any:
        s, c, sr, cr = math.sin(yaw / 2), math.cos(yaw / 2), math.sin(roll / 2), math.cos(roll / 2)
        return self.type("geometry_msgs/msg/Quaternion", c * sr, s * sr, s * cr, c * cr)

    def write(self, topic: str, kind: str, ns: int, message: Any) -> None:
        if topic not in self.topics:
            self.topics[topic] = self.writer.add_connection(topic, kind, typestore=self.types)
        to_bytes = self.types.serialize_ros1 if self.kind == "bag" else self.types.serialize_cdr
        self.writer.write(self.topics[topic], ns, to_bytes(message, kind))

    def scan(self, ns: int, topic: str = "/scan", increment: float = 0.1, frame: str = "laser") -> None:
        kind = "sensor_msgs/msg/LaserScan"
        ranges = np.array([1.0, np.inf, np.nan, 2.0], dtype=np.float32)
        numbers = (-0.2, 0.1, increment, 0.001, 0.1, 0.05, 10.0)
        values = (numbers[0], 0.1, *numbers[2:], ranges, np.zeros(0, dtype=np.float32))
        self.write(topic, kind, ns, self.type(kind, self.header(ns, frame), *values))

    def frame(
        self, ns: int, parent: str, child: str, pose: tuple[float, float, float], roll: float = 0.0, *, static: bool
    ) -> None:
        place = self.type(
            "geometry_msgs/msg/Transform", self.point("Vector3", *pose[:2], 0.3), self.turn(pose[2], roll)
        )
        one = self.type("geometry_msgs/msg/TransformStamped", self.header(ns, parent), child, place)
        kind = "tf2_msgs/msg/TFMessage"
        self.write("/tf_static" if static else "/tf", kind, ns, self.type(kind, [one]))

    def odometry(self, ns: int, x: float) -> None:
        kind = "nav_msgs/msg/Odometry"
        pose = self.type("geometry_msgs/msg/Pose", self.point("Point", x, 0.0), self.turn(0.0))
        still = self.type("geometry_msgs/msg/Twist", self.point("Vector3", 0, 0), self.point("Vector3", 0, 0))
        sure = np.zeros(36)
        twist = self.type("geometry_msgs/msg/TwistWithCovariance", still, sure)
        place = self.type("geometry_msgs/msg/PoseWithCovariance", pose, sure)
        self.write("/odom", kind, ns, self.type(kind, self.header(ns, "odom"), "base_link", place, twist))

    def grid(self, cells: Any, resolution: float, origin: tuple[float, float, float]) -> None:
        kind = "nav_msgs/msg/OccupancyGrid"
        pose = self.type("geometry_msgs/msg/Pose", self.point("Point", *origin[:2]), self.turn(origin[2]))
        info = self.type("nav_msgs/msg/MapMetaData", self.time(0), resolution, cells.shape[1], cells.shape[0], pose)
        self.write("/map", kind, 1, self.type(kind, self.header(1, "world"), info, cells.ravel().astype(np.int8)))

    def done(self) -> Path:
        self.writer.close()
        return self.path


SECOND = 10**9


@pytest.mark.parametrize("kind", KINDS)
def test_a_bag_gives_scans_where_tf_has_the_sensor(tmp_path: Path, kind: str) -> None:
    bag = Recorder(kind, tmp_path)
    bag.frame(0, "base_link", "laser", (0.5, 0.1, 0.0), math.pi, static=True)
    bag.frame(SECOND, "odom", "base_link", (1.0, 0.0, 0.0), static=False)
    bag.frame(3 * SECOND // 2, "odom", "base_link", (2.0, 0.0, math.pi / 2), static=False)
    bag.frame(SECOND, "map", "odom", (100.0, 0.0, 0.0), static=False)
    for ns in (SECOND, 5 * SECOND // 4, 3 * SECOND // 2, 9 * SECOND):
        bag.scan(ns)
    log = read_log(bag.done())
    first, between, last, late = list(log)
    assert near(first.pose, 1.5, 0.1, 0.0)
    # Halfway the base stands at 1.5 m, turned by 45 degrees.
    c = math.cos(math.pi / 4)
    assert near(between.pose, 1.5 + 0.5 * c - 0.1 * c, 0.5 * c + 0.1 * c, math.pi / 4)
    assert near(last.pose, 2.0 - 0.1, 0.5, math.pi / 2)
    assert late.pose is None  # seven seconds after the last transform
    for scan in (first, between, last):
        assert near(scan.mount, 0.5, 0.1, 0.0)
        assert (scan.flipped, scan.pose_frame, scan.frame_id, scan.topic) == (True, "odom", "laser", "/scan")
    assert first.stamp_ns == SECOND
    assert first.time_increment == pytest.approx(0.001)
    np.testing.assert_array_equal(first.laser.cleaned, [1.0, math.inf, math.nan, 2.0])
    assert log.report.format == {"bag": "rosbag1", "sqlite3": "rosbag2", "mcap": "rosbag2"}[kind]
    counts = {n.code: n.count for n in (*log.report.read, *log.report.dropped)}
    assert counts == {"scans": 4, "transforms": 4, "no_pose": 1}
    in_map = next(iter(read_log(bag.path, LogOptions(pose_frame="map"))))
    assert near(in_map.pose, 101.5, 0.1, 0.0)


def test_a_single_mcap_is_read_without_its_folder(tmp_path: Path) -> None:
    bag = Recorder("mcap", tmp_path)
    bag.scan(SECOND)
    (file,) = bag.done().glob("*.mcap")
    log = read_log(file)
    assert [scan.pose for scan in log] == [None]
    assert log.report.format == "mcap"


@pytest.mark.parametrize("kind", KINDS)
def test_odometry_stands_in_where_tf_says_nothing(tmp_path: Path, kind: str) -> None:
    bag = Recorder(kind, tmp_path)
    bag.odometry(SECOND, 1.0)
    bag.odometry(3 * SECOND // 2, 3.0)
    bag.scan(5 * SECOND // 4, frame="base_link")
    (scan,) = read_log(bag.done())
    assert near(scan.pose, 2.0, 0.0, 0.0)


def test_the_topic_with_most_scans_is_taken_and_broken_scans_are_dropped(tmp_path: Path) -> None:
    bag = Recorder("mcap", tmp_path)
    bag.scan(1, "/rear")
    for ns in (2, 3):
        bag.scan(ns, "/front")
    bag.scan(4, "/front", increment=0.0)
    path = bag.done()
    log = read_log(path)
    assert [scan.topic for scan in log] == ["/front"] * 2
    assert {n.code: n.count for n in log.report.dropped}["broken_scan"] == 1
    assert "/rear" in next(n.message for n in log.report.assumed if n.code == "topic")
    assert [scan.topic for scan in read_log(path, LogOptions(topic="/rear"))] == ["/rear"]
    with pytest.raises(IncompleteFileError, match="no LaserScan on /none"):
        list(read_log(path, LogOptions(topic="/none")))


@pytest.mark.parametrize("kind", KINDS)
def test_a_grid_in_a_bag_is_a_map(tmp_path: Path, kind: str) -> None:
    cells = np.full((60, 80), -1)
    cells[9:51, 9:71] = 100
    cells[10:50, 10:70] = 0
    bag = Recorder(kind, tmp_path)
    bag.grid(cells, 0.1, (5.0, 0.0, 0.0))
    imported = read_map(bag.done())
    assert imported.map.frame_id == "world"
    s = imported.map.segments
    # The lower wall lies in the middle of its cells, 0.95 m up, free space on its left.
    low = np.flatnonzero(s.directions[:, 0] > 0.99)
    np.testing.assert_allclose(s.offsets[low], 0.95, atol=1e-6)
    right = np.flatnonzero(s.directions[:, 1] > 0.99)
    np.testing.assert_allclose(s.midpoints[right, 0], 5.0 + 7.05, atol=1e-6)
    with pytest.raises(IncompleteFileError, match="on /other"):
        read_map(bag.path, ImportOptions(topic="/other"))


def scans_of(path: Path) -> list[LoggedScan]:
    return list(read_log(path))


def cut(path: Path) -> None:
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])


@pytest.mark.parametrize("kind", ["mcap", "sqlite3"])
def test_a_bag_names_no_files_but_its_own(tmp_path: Path, kind: str) -> None:
    bag = Recorder(kind, tmp_path)
    bag.scan(0)
    path = bag.done()
    [held] = [file for file in path.iterdir() if file.name != "metadata.yaml"]
    held.rename(tmp_path / held.name)
    metadata = path / "metadata.yaml"
    told = metadata.read_text()
    for elsewhere in (f"../{held.name}", str(tmp_path / held.name)):
        metadata.write_text(told.replace(held.name, elsewhere))
        with pytest.raises(MalformedFileError, match="missing"):
            scans_of(path)


@pytest.mark.parametrize(
    ("kind", "spoilt", "how", "error", "message"),
    [
        ("bag", "robot.bag", cut, MalformedFileError, "is a broken bag: .*; .* `rosbag reindex` repairs it"),
        (
            "mcap",
            "robot_mcap/robot_mcap.mcap",
            cut,
            MalformedFileError,
            "is a broken bag: .*; .* `mcap recover` repairs",
        ),
        ("sqlite3", "robot_sqlite3/robot_sqlite3.db3", cut, MalformedFileError, "is a broken bag: [^;]*$"),
    ],
)
def test_broken_bags_are_refused_in_one_line(
    tmp_path: Path, kind: str, spoilt: str, how: Callable[[Path], None], error: type[FormatError], message: str
) -> None:
    bag = Recorder(kind, tmp_path)
    for k in range(200):
        bag.scan(k * SECOND)
    path = bag.done()
    how(tmp_path / spoilt)
    with pytest.raises(error, match=message) as caught:
        scans_of(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("a.pcap", "ends in one of"),
        ("missing.log", "no such file"),
        ("missing.bag", "no such file"),
        ("a.log", "no scan"),
    ],
)
def test_what_is_no_log_is_refused(tmp_path: Path, name: str, message: str) -> None:
    (tmp_path / "a.pcap").write_bytes(b"")
    (tmp_path / "a.log").write_bytes(b"PARAM a b\n")
    with pytest.raises(FormatError, match=message):
        scans_of(tmp_path / name)


@pytest.mark.parametrize("folder", ["100%", "a%2f..", "what?", "no#1"])
def test_a_path_that_sqlite_takes_for_another_is_refused(tmp_path: Path, folder: str) -> None:
    """Class of attack: path traversal. SQLite is given a URI, of which these signs are no part of the path."""
    bag = Recorder("sqlite3", tmp_path)
    bag.scan(SECOND)
    path = bag.done().rename(tmp_path / folder)
    for one in (path, next(path.glob("*.db3"))):
        with pytest.raises(UnsupportedFormatError, match="rename it"):
            list(read_log(one))
    bag = Recorder("mcap", path)
    bag.scan(SECOND)
    assert len(list(read_log(bag.done()))) == 1
