"""Logs: text as CARMEN writes it, bags written by rosbags."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from formats import (
    FormatError,
    ImportOptions,
    IncompleteFileError,
    LogOptions,
    MalformedFileError,
    UnsupportedFormatError,
    read_log,
    read_map,
)
from registration import RigidTransform

from .bags import FOUR_BEAMS, GRID, KINDS, SECOND, Robots, near, yawed
from .reading import counts, notes

FLASER = "FLASER 4 1.0 2.0 81.91 3.0 10 20 1.5 9 20 0 100.25 host 100.25\n"
ROBOTLASER = (
    "ROBOTLASER1 0 -1.5 1.0 0.5 30 0.01 0 3 1 2 30 2 7 8 1 2 0.5 1 2 0.5 0 0 0 0 0 50.5 host 50.5\n"
    "RAWLASER1 0 -1.5 1.0 0.5 30 0.01 0 3 1 2 30 0 51.5 host 51.5\n"
)


def written(tmp_path: Path, content: str) -> Path:
    path = tmp_path / "robot.log"
    path.write_text(content)
    return path


def test_flaser_looks_over_half_a_turn_and_says_where_the_laser_was(tmp_path: Path) -> None:
    log = read_log(written(tmp_path, "# a comment\nPARAM a 1\n" + FLASER + "ODOM 1 2 3 0 0 0 1 host 1\n"))
    (scan,) = list(log)
    np.testing.assert_allclose(np.degrees(scan.laser.angles), [-90, -45, 0, 45], atol=1e-9)
    np.testing.assert_array_equal(scan.laser.cleaned, [1.0, 2.0, math.inf, 3.0])
    assert scan.stamp_ns == 100_250_000_000
    assert near(scan.pose, 10, 20, 1.5)
    assert near(scan.mount, 1, 0, 1.5)
    assert counts(log, "read", "dropped") == {"scans": 1, "message_param": 1, "message_odom": 1}


FIELD, STEP = "PARAM laser_front_laser_fov", "PARAM laser_front_laser_resolution"


@pytest.mark.parametrize(
    ("params", "beams", "first", "last", "said"),
    [
        ("", 180, -90, 89, None), ("", 361, -90, 90, None), ("", 541, -135, 135, "number of ranges"),
        ("", 1081, -135, 135, "number of ranges"), ("", 381, -95, 95, "number of ranges"),
        ("", 682, -119.71, 119.71, "number of ranges"), ("", 401, -50, 50, "number of ranges"),
        (f"{FIELD} 360\n", 1440, -180, 179.75, "by the PARAM"), (f"{STEP} 0.25\n", 1081, -135, 135, "by the PARAM"),
        (f"{FIELD} 190\n", 191, -95, 95, "by the PARAM"), (f"{FIELD} 180\n{STEP} 1.0\n", 180, -90, 89, None),
        (f"{FIELD} 240\n{STEP} 0.36\n", 667, -120, 119.76, "by the PARAM"),
        (f"{FIELD} 180\n{STEP} 0.25\n", 541, -135, 135, "contradict"),
        (f"{FIELD} 4.18879\n", 301, -120, 120, "which has radians"),
        (f"{FIELD} 4.712389\n{STEP} 0.00872665\n", 541, -135, 135, "which has radians"),
    ],
)  # fmt: skip
def test_the_field_of_view_of_flaser(
    tmp_path: Path, params: str, beams: int, first: float, last: float, said: str | None
) -> None:
    log = read_log(written(tmp_path, f"{params}FLASER {beams} {'1.0 ' * beams} 0 0 0 0 0 0 1 host 1\n"))
    (scan,) = log
    np.testing.assert_allclose(np.degrees(scan.laser.angles[[0, -1]]), [first, last], atol=0.01)
    assert ("field_of_view" in notes(log)) is (said is not None)
    assert said is None or said in notes(log)["field_of_view"].message


@pytest.mark.parametrize(
    ("params", "remedy"), [("", f"`{FIELD} 240`"), (f"{FIELD} 180\n{STEP} 0.25\n", f"correct .*{FIELD}.*{STEP}")]
)
@pytest.mark.parametrize("beams", [500, 1440])
def test_an_unknown_number_of_beams_needs_a_param(tmp_path: Path, params: str, remedy: str, beams: int) -> None:
    scan = f"FLASER {beams} {'1.0 ' * beams} 1 0 0 1 0 0 1 host 1\n"
    with pytest.raises(MalformedFileError, match=f"{beams} ranges.*{remedy}"):
        list(read_log(written(tmp_path, params + scan)))
    log = read_log(written(tmp_path, f"{FIELD} 240\n{scan}"))
    assert [found.pose for found in log] == [RigidTransform(1.0, 0.0, 0.0)]
    assert "no_odometry" not in notes(log)


def test_settings_that_are_used_are_not_dropped(tmp_path: Path) -> None:
    log = read_log(written(tmp_path, f"{FIELD} 180\nPARAM robot_length 0.5 1 host 1\n{FLASER}"))
    list(log)
    assert counts(log, "read", "dropped") == {"settings": 1, "scans": 1, "message_param": 1}


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
    for _ in range(2):  # the second time again from the beginning
        assert len(list(log)) == 1
        assert counts(log, "read", "dropped") == {"scans": 1, "broken_line": 4, "other_lines": 1}


@pytest.mark.parametrize("kind", KINDS)
def test_a_bag_gives_scans_where_tf_has_the_sensor(tmp_path: Path, kind: str) -> None:
    bag = Robots(kind, tmp_path)
    bag.transform("/tf_static", 0, "base_link", "laser", (0.5, 0.1, 0.3), yawed(0.0, upside_down=True))
    bag.transform("/tf", SECOND, "odom", "base_link", (1.0, 0.0, 0.3))
    bag.transform("/tf", 3 * SECOND // 2, "odom", "base_link", (2.0, 0.0, 0.3), yawed(math.pi / 2))
    bag.transform("/tf", SECOND, "map", "odom", (100.0, 0.0, 0.3))
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
    assert counts(log, "read", "dropped") == {"scans": 4, "transforms": 4, "no_pose": 1}
    in_map = next(iter(read_log(bag.path, LogOptions(odometry="map"))))
    assert near(in_map.pose, 101.5, 0.1, 0.0)


def test_the_topic_with_most_scans_is_taken_and_broken_scans_are_dropped(bag: Robots) -> None:
    bag.scan(1, "/rear")
    for ns in (2, 3):
        bag.scan(ns, "/front")
    bag.scan(4, "/front", laser=FOUR_BEAMS.but(angle_increment=0.0))
    path = bag.done()
    log = read_log(path)
    assert [scan.topic for scan in log] == ["/front"] * 2
    assert counts(log)["broken_scan"] == 1
    assert "/rear" in notes(log)["topic"].message
    assert [scan.topic for scan in read_log(path, LogOptions(topic="/rear"))] == ["/rear"]
    with pytest.raises(IncompleteFileError, match="no LaserScan on /none"):
        list(read_log(path, LogOptions(topic="/none")))


@pytest.mark.parametrize("kind", KINDS)
def test_a_grid_in_a_bag_is_a_map(tmp_path: Path, kind: str) -> None:
    cells = np.full((60, 80), -1)
    cells[9:51, 9:71] = 100
    cells[10:50, 10:70] = 0
    bag = Robots(kind, tmp_path)
    bag.write("/map", GRID, 1, bag.messages.grid(cells, (5.0, 0.0, 0.0), frame="world"))
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


@pytest.mark.parametrize("kind", ["mcap", "sqlite3"])
def test_a_bag_names_no_files_but_its_own(tmp_path: Path, kind: str) -> None:
    bag = Robots(kind, tmp_path)
    bag.scan(0)
    path = bag.done()
    [held] = [file for file in path.iterdir() if file.name != "metadata.yaml"]
    held.rename(tmp_path / held.name)
    metadata = path / "metadata.yaml"
    told = metadata.read_text()
    for elsewhere in (f"../{held.name}", str(tmp_path / held.name)):
        metadata.write_text(told.replace(held.name, elsewhere))
        with pytest.raises(MalformedFileError, match="missing"):
            list(read_log(path))


@pytest.mark.parametrize(
    ("kind", "message"),
    [
        ("bag", "is a broken bag: .*; .* `rosbag reindex` repairs it"),
        ("mcap", "is a broken bag: .*; .* `mcap recover` repairs"),
        ("sqlite3", "is a broken bag: [^;]*$"),
    ],
)
def test_broken_bags_are_refused_in_one_line(tmp_path: Path, kind: str, message: str) -> None:
    bag = Robots(kind, tmp_path)
    for k in range(200):
        bag.scan(k * SECOND)
    path = bag.done()
    file = path if path.is_file() else next(one for one in path.iterdir() if one.name != "metadata.yaml")
    content = file.read_bytes()
    file.write_bytes(content[: len(content) // 2])
    with pytest.raises(MalformedFileError, match=message) as caught:
        list(read_log(path))
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
        list(read_log(tmp_path / name))


@pytest.mark.parametrize("folder", ["100%", "a%2f..", "what?", "no#1"])
def test_a_path_that_sqlite_takes_for_another_is_refused(tmp_path: Path, folder: str) -> None:
    """Class of attack: path traversal. SQLite is given a URI, of which these signs are no part of the path."""
    bag = Robots("sqlite3", tmp_path)
    bag.scan(SECOND)
    path = bag.done().rename(tmp_path / folder)
    for one in (path, next(path.glob("*.db3"))):
        with pytest.raises(UnsupportedFormatError, match="rename it"):
            list(read_log(one))
    bag = Robots("mcap", path)
    bag.scan(SECOND)
    assert len(list(read_log(bag.done()))) == 1
