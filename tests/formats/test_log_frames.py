"""Frames of bags: what is odometry, whose transforms hold, what is left out."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import pytest

from formats import FormatError, IncompleteFileError, LogOptions, read_log
from registration import RigidTransform

from .bags import SECOND, Quaternion, Robots, codes, fixed, near, pitched, read


def no_odom(bag: Robots) -> None:
    fixed(bag, "base_link", "laser")


def fixed_odom(bag: Robots) -> None:
    fixed(bag, "map", "odom", "base_footprint", "base_link", "laser")


def repeated_odom(bag: Robots) -> None:
    bag.drive("/tf", "odom", "base_link", speed=0.0)
    fixed(bag, "base_link", "laser")


def trembling_odom(bag: Robots) -> None:
    for k in range(20):
        bag.transform("/tf", k * SECOND // 10, "odom", "base_link", (0.01 * (k % 2), 0.0, 0.0), pitched(2.0 * (k % 2)))
    fixed(bag, "base_link", "laser")


def fixed_odom_in_a_moving_map(bag: Robots) -> None:
    bag.drive("/tf", "map", "odom")
    fixed(bag, "odom", "base_link", "laser")


def turning_laser(bag: Robots) -> None:
    fixed(bag, "odom", "base_link")
    for k in range(5):
        half = 0.2 * k
        bag.transform(
            "/tf", k * SECOND // 2, "base_link", "laser", (0.1, 0.0, 0.0), (0.0, 0.0, math.sin(half), math.cos(half))
        )


def hinge_without_a_base(bag: Robots) -> None:
    fixed(bag, "odom", "trolley")
    for k in range(5):
        bag.transform("/tf", k * SECOND // 2, "trolley", "laser", (0.1, 0.0, 0.0), (0.0, 0.0, math.sin(k), math.cos(k)))


def one_value(bag: Robots) -> None:
    bag.transform("/tf", SECOND, "odom", "base_link", (3.0, 0.0, 0.0))
    fixed(bag, "base_link", "laser")


def odometry_of_another(bag: Robots) -> None:
    fixed(bag, "base_link", "laser")
    for k in range(5):
        bag.says(k * SECOND // 2, 0.5 * k, "other/base_link")


@pytest.mark.parametrize(
    "frames",
    [
        no_odom,
        fixed_odom,
        repeated_odom,
        trembling_odom,
        fixed_odom_in_a_moving_map,
        turning_laser,
        hinge_without_a_base,
        one_value,
        odometry_of_another,
    ],
)
def test_what_does_not_move_is_no_odometry(tmp_path: Path, frames: Callable[[Robots], None]) -> None:
    bag = Robots("mcap", tmp_path)
    frames(bag)
    for k in range(4):
        bag.scan(k * SECOND // 2)
    scans, log = read(bag)
    assert [scan.pose for scan in scans] == [None] * 4
    (note,) = (note for note in log.report.assumed if note.code == "no_odometry")
    assert note.message.startswith("no odometry was found: ")


def test_transforms_without_a_stamp_are_named(tmp_path: Path) -> None:
    bag = Robots("mcap", tmp_path)
    for k in range(4):
        bag.transform("/tf", 0, "odom", "base_link", (0.5 * k, 0.0, 0.0))
    fixed(bag, "base_link", "laser")
    bag.scan(SECOND)
    _, log = read(bag)
    (note,) = (note for note in log.report.assumed if note.code == "no_odometry")
    assert "base_link in odom have the stamp 0" in note.message


@pytest.mark.parametrize("chain", [("base_link",), ("base_footprint", "base_link"), ("base_footprint",), ("robot",)])
def test_a_frame_that_moves_is(tmp_path: Path, chain: tuple[str, ...]) -> None:
    bag = Robots("mcap", tmp_path)
    bag.drive("/tf", "odom", chain[0])
    fixed(bag, *chain, "laser")
    bag.scan(SECOND)
    (scan,), log = read(bag)
    assert near(scan.pose, 1.0 + 0.2 * len(chain), 0.0, 0.0)
    assert "no_odometry" not in codes(log)


def test_a_robot_that_only_turns_moves(tmp_path: Path) -> None:
    bag = Robots("mcap", tmp_path)
    for k in range(5):
        bag.transform("/tf", k * SECOND // 2, "odom", "base_link", turn=(0.0, 0.0, math.sin(k / 9), math.cos(k / 9)))
    fixed(bag, "base_link", "laser")
    bag.scan(SECOND)
    (scan,), _ = read(bag)
    assert scan.pose is not None
    assert scan.pose.theta == pytest.approx(4 / 9)


@pytest.mark.parametrize("speed", [1.0, 0.0])
@pytest.mark.parametrize("child", ["base_link", "base_footprint", ""])
def test_odometry_messages_are_odometry_though_frames_beside_them_stand(
    tmp_path: Path, child: str, speed: float
) -> None:
    bag = Robots("mcap", tmp_path)
    bag.drive("/tf", "odom", "base_footprint", speed=0.0)
    bag.transform("/tf_static", 0, "base_footprint", "base_link")
    fixed(bag, "base_link", "laser")
    for k in range(5):
        bag.says(k * SECOND // 2, 0.5 * speed * k, child)
    bag.scan(SECOND)
    (scan,), log = read(bag)
    assert near(scan.pose, speed + 0.2, 0.0, 0.0)
    assert scan.pose_frame == "odom"
    assert ("odometry_stands" in codes(log)) is (speed == 0.0)


def test_a_frame_may_have_several_parents(tmp_path: Path) -> None:
    bag = Robots("mcap", tmp_path)
    for k in range(5):
        for parent, offset in (("odom", 0.0), ("map", 40.0)):
            bag.transform("/tf", k * SECOND // 2, parent, "base_link", (0.5 * k + offset, 0.0, 0.0))
    bag.transform("/tf", SECOND, "camera", "base_link", (9.0, 9.0, 0.0))
    fixed(bag, "base_link", "laser")
    fixed(bag, "shelf", "laser")
    bag.scan(SECOND)
    path = bag.done()
    log = read_log(path)
    (scan,) = log
    assert near(scan.pose, 1.2, 0.0, 0.0)
    assert near(scan.mount, 0.2, 0.0, 0.0)
    assert "several_parents" in codes(log)
    assert near(next(iter(read_log(path, LogOptions(odometry="map")))).pose, 41.2, 0.0, 0.0)


def circle(bag: Robots) -> None:
    bag.transform("/tf", 0, "a", "b")
    bag.transform("/tf", 0, "b", "a")
    bag.transform("/tf_static", 0, "laser", "base_link")


BROKEN: dict[str, Callable[[Robots], None]] = {
    "nan": lambda bag: bag.transform("/tf", 0, "odom", "camera", (math.nan, 0.0, 0.0)),
    "infinite": lambda bag: bag.transform("/tf", 0, "odom", "base_link", (math.inf, 0.0, 0.0)),
    "huge": lambda bag: bag.transform("/tf", SECOND, "odom", "base_link", (1e308, 0.0, 0.0)),
    "nan quaternion": lambda bag: bag.transform("/tf", SECOND, "odom", "base_link", turn=(math.nan, 0.0, 0.0, 1.0)),
    "zero quaternion": lambda bag: bag.transform("/tf_static", 0, "base_link", "laser", turn=(0.0, 0.0, 0.0, 0.0)),
    "angle for a quaternion": lambda bag: bag.transform("/tf", SECOND, "odom", "base_link", turn=(0, 0, 1.7, 0)),
    "huge quaternion": lambda bag: bag.transform("/tf", SECOND, "odom", "base_link", turn=(0, 0, 1e200, 1e200)),
    "own parent": lambda bag: bag.transform("/tf", 0, "base_link", "/base_link"),
    "no child": lambda bag: bag.transform("/tf", 0, "base_link", ""),
    "no parent": lambda bag: bag.transform("/tf_static", 0, "/", "laser"),
    "odometry": lambda bag: bag.says(0, 0.0, turn=(0.0, 0.0, 0.0, 0.0)),
    "odometry of nan": lambda bag: bag.says(0, math.nan),
    "circle": circle,
}


@pytest.mark.parametrize("name", BROKEN)
def test_one_broken_transform_costs_nothing_else(tmp_path: Path, name: str) -> None:
    bag = Robots("mcap", tmp_path)
    BROKEN[name](bag)
    bag.drive("/tf", "odom", "base_link")
    fixed(bag, "base_link", "laser")
    BROKEN[name](bag)
    for k in range(4):
        bag.scan(k * SECOND // 2)
    scans, log = read(bag)
    for k, scan in enumerate(scans):
        assert near(scan.pose, 0.5 * k + 0.2, 0.0, 0.0)
        assert near(scan.mount, 0.2, 0.0, 0.0)
    if name != "circle":
        dropped = codes(log)
        assert dropped.get("broken_transform", 0) + dropped.get("broken_frame", 0) == 2


def test_a_quaternion_of_few_decimals_is_normalised(tmp_path: Path) -> None:
    bag = Robots("mcap", tmp_path)
    bag.transform("/tf_static", 0, "base_link", "laser", (0.1, 0.0, 0.0), (0.0, 0.0, 0.7, 0.7))
    bag.scan(SECOND)
    (scan,), log = read(bag)
    assert near(scan.mount, 0.1, 0.0, math.pi / 2)
    assert not log.report.dropped


def two_robots(bag: Robots, *, scans: tuple[str, ...] = ("/robot1/scan", "/robot2/scan")) -> None:
    for k, robot in enumerate(("/robot1", "/robot2"), start=1):
        bag.transform(f"{robot}/tf_static", 0, "base_link", "laser", (0.1 * k, 0.0, 0.0))
        bag.drive(f"{robot}/tf", "odom", "base_link", speed=float(k))
        bag.says(SECOND, 100.0 * k, topic=f"{robot}/odom")
    for topic in scans:
        bag.scan(SECOND, topic)


@pytest.mark.parametrize("robot", [1, 2])
@pytest.mark.parametrize("kind", ["bag", "sqlite3"])
def test_the_namespace_of_the_scans_chooses_their_transforms(tmp_path: Path, kind: str, robot: int) -> None:
    bag = Robots(kind, tmp_path)
    two_robots(bag)
    # Transforms without a namespace, of whichever robot.
    bag.transform("/tf_static", 0, "base_link", "laser", (7.0, 0.0, 0.0))
    (scan,), _ = read(bag, LogOptions(topic=f"/robot{robot}/scan"))
    assert near(scan.mount, 0.1 * robot, 0.0, 0.0)
    assert near(scan.pose, robot * 1.1, 0.0, 0.0)


def test_odometry_messages_have_namespaces_too(tmp_path: Path) -> None:
    bag = Robots("mcap", tmp_path)
    for k, robot in enumerate(("/robot1", "/robot2"), start=1):
        bag.transform(f"{robot}/tf_static", 0, "base_link", "laser", (0.1, 0.0, 0.0))
        for at in range(4 - k):
            bag.says(at * SECOND, float(k * at), topic=f"{robot}/wheels/odom")
        bag.scan(SECOND, f"{robot}/front/scan")
    (scan,), _ = read(bag, LogOptions(topic="/robot2/front/scan"))
    assert near(scan.pose, 2.1, 0.0, 0.0)


@pytest.mark.parametrize("global_topic", ["/tf", "/tf_static"])
def test_transforms_without_a_namespace_complete_those_of_the_only_robot(tmp_path: Path, global_topic: str) -> None:
    bag = Robots("mcap", tmp_path)
    fixed(bag, "base_link", "laser", topic="/tf_static" if global_topic == "/tf_static" else "/robot1/tf_static")
    bag.drive("/tf" if global_topic == "/tf" else "/robot1/tf", "odom", "base_link")
    bag.scan(SECOND, "/robot1/scan")
    (scan,), _ = read(bag)
    assert near(scan.pose, 1.2, 0.0, 0.0)


def test_prefixed_frames_share_a_topic(tmp_path: Path) -> None:
    bag = Robots("mcap", tmp_path)
    for k, robot in enumerate(("robot1", "robot2"), start=1):
        bag.transform("/tf_static", 0, f"{robot}/base_link", f"{robot}/laser", (0.1 * k, 0.0, 0.0))
        bag.drive("/tf", f"{robot}/odom", f"{robot}/base_link", speed=float(k))
        bag.scan(SECOND, f"/{robot}/scan", frame=f"{robot}/laser")
    (scan,), _ = read(bag, LogOptions(topic="/robot2/scan"))
    assert near(scan.pose, 2.2, 0.0, 0.0)
    assert near(scan.mount, 0.2, 0.0, 0.0)
    assert (scan.base_frame, scan.pose_frame) == ("robot2/base_link", "robot2/odom")


def test_where_it_is_not_clear_the_user_chooses(tmp_path: Path) -> None:
    bag = Robots("mcap", tmp_path)
    two_robots(bag, scans=("/scan",))
    path = bag.done()
    with pytest.raises(
        IncompleteFileError,
        match=r"/robot1, /robot2; choose one with the option "
        "tf_namespace",
    ) as caught:
        list(read_log(path))
    assert "/scan" in str(caught.value)
    for wanted in ("/robot2", "robot2/", "/robot2/tf"):
        (scan,) = read_log(path, LogOptions(tf_namespace=wanted))
        assert near(scan.pose, 2.2, 0.0, 0.0)
    with pytest.raises(IncompleteFileError, match="no transforms in /robot3, only in /robot1, /robot2"):
        list(read_log(path, LogOptions(tf_namespace="/robot3")))


def test_another_robots_transforms_are_never_taken(tmp_path: Path) -> None:
    bag = Robots("mcap", tmp_path)
    fixed(bag, "base_link", "laser", topic="/robot2/tf_static")
    bag.drive("/robot2/tf", "odom", "base_link")
    bag.scan(SECOND, "/robot1/scan")
    bag.scan(SECOND, "/robot2/scan")
    with pytest.raises(IncompleteFileError, match="the namespace of the transforms is ambiguous"):
        read(bag, LogOptions(topic="/robot1/scan"))


def test_the_only_robots_transforms_hold_for_scans_without_a_namespace(tmp_path: Path) -> None:
    bag = Robots("mcap", tmp_path)
    fixed(bag, "base_link", "laser", topic="/robot1/tf_static")
    bag.drive("/robot1/tf", "odom", "base_link")
    bag.scan(SECOND)
    (scan,), log = read(bag)
    assert near(scan.pose, 1.2, 0.0, 0.0)
    assert "tf_namespace" in codes(log)


OPTICAL: Quaternion = (-0.5, 0.5, -0.5, 0.5)


@pytest.mark.parametrize("turn", [OPTICAL, pitched(90.0), pitched(-25.0), pitched(155.0)])
@pytest.mark.parametrize("base", ["base_link", "trolley"])
def test_scans_in_an_upright_frame_are_refused(tmp_path: Path, base: str, turn: Quaternion) -> None:
    bag = Robots("mcap", tmp_path)
    bag.transform("/tf_static", 0, base, "camera_optical", (0.2, 0.0, 0.3), turn)
    bag.drive("/tf", "odom", base)
    bag.scan(SECOND, frame="camera_optical")
    path = bag.done()
    with pytest.raises(FormatError, match=r"camera_optical: the scan plane is .* degrees from horizontal in"):
        list(read_log(path))
    (scan,) = read_log(path, LogOptions(mount=RigidTransform(0.2, 0.0, 0.5)))
    assert near(scan.mount, 0.2, 0.0, 0.5)
    assert not scan.flipped
    if base == "base_link":
        assert near(scan.pose, 1.2, 0.0, 0.5)


def test_upright_scans_among_others_are_left_out(tmp_path: Path) -> None:
    bag = Robots("mcap", tmp_path)
    fixed(bag, "base_link", "laser")
    bag.transform("/tf_static", 0, "base_link", "camera_optical", turn=OPTICAL)
    for frame in ("laser", "camera_optical", "laser"):
        bag.scan(SECOND, frame=frame)
    scans, log = read(bag)
    assert [scan.frame_id for scan in scans] == ["laser", "laser"]
    assert codes(log)["upright_frame"] == 1


@pytest.mark.parametrize(("degrees", "flipped"), [(0.0, False), (12.0, False), (172.0, True), (180.0, True)])
def test_a_tilt_is_said_and_upside_down_is_none(tmp_path: Path, degrees: float, flipped: bool) -> None:
    bag = Robots("mcap", tmp_path)
    half = math.radians(degrees) / 2
    bag.transform("/tf_static", 0, "base_link", "laser", turn=(math.sin(half), 0.0, 0.0, math.cos(half)))
    bag.scan(SECOND)
    (scan,), log = read(bag)
    assert scan.flipped is flipped
    assert ("tilted" in codes(log)) is (degrees in (12.0, 172.0))


def carmen(laser: str, robot: str, stamp: int) -> str:
    return f"FLASER 4 1.0 2.0 3.0 3.0 {laser} {robot} {stamp} host {stamp}\n"


@pytest.mark.parametrize(("robot", "known"), [("0 0 0", False), ("0 0 0.2", True), ("3 4 0", True)])
def test_a_carmen_log_whose_robot_is_never_anywhere_has_no_odometry(tmp_path: Path, robot: str, known: bool) -> None:
    path = tmp_path / "robot.log"
    path.write_text(carmen("0.1 0 0", "0 0 0", 1) + carmen("0.1 0 0", robot, 2) + carmen("0.1 0 0", "0 0 0", 3))
    log = read_log(path)
    assert [scan.pose is not None for scan in log] == [known] * 3
    assert ("no_odometry" in codes(log)) is not known
    assert near(next(iter(log)).mount, 0.1, 0.0, 0.0)


@pytest.mark.parametrize("base", ["chassis", "robot1/chassis"])
def test_a_base_of_another_name_is_chosen_by_an_option(tmp_path: Path, base: str) -> None:
    def recorded(name: str) -> Robots:
        (tmp_path / name).mkdir()
        bag = Robots("mcap", tmp_path / name)
        bag.drive("/tf", "robot1/odom", "robot1/chassis")
        bag.transform("/tf_static", 0, "robot1/chassis", "laser", (0.3, 0.0, 0.0))
        for k in range(4):
            bag.scan(k * SECOND)
        return bag

    without, _ = read(recorded("without"))
    assert without[0].mount is None
    scans, _ = read(recorded("with"), LogOptions(base=base))
    assert scans[0].mount is not None
    assert (scans[0].base_frame, scans[0].mount.x) == ("robot1/chassis", 0.3)
    with pytest.raises(IncompleteFileError, match="no transform from laser to the base frame body: expected one of"):
        read(recorded("wrong"), LogOptions(base="body"))
