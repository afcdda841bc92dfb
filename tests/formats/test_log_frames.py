"""Frames of bags: what is odometry, whose transforms hold, what is left out."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import pytest

from formats import FormatError, IncompleteFileError, LogOptions, read_log
from registration import RigidTransform

from .bags import SECOND, Quaternion, Robots, near, pitched, read
from .reading import counts, notes


def trembling(bag: Robots) -> None:
    for k in range(20):
        bag.transform("/tf", k * SECOND // 10, "odom", "base_link", (0.01 * (k % 2), 0.0, 0.0), pitched(2.0 * (k % 2)))
    bag.fixed("base_link", "laser")


def of_another(bag: Robots) -> None:
    bag.fixed("base_link", "laser")
    for k in range(5):
        bag.says(k * SECOND // 2, 0.5 * k, "other/base_link")


def without_stamps(bag: Robots) -> None:
    for k in range(4):
        bag.transform("/tf", 0, "odom", "base_link", (0.5 * k, 0.0, 0.0))
    bag.fixed("base_link", "laser")


NO_ODOMETRY: dict[str, Callable[[Robots], object]] = {
    "none": lambda bag: bag.fixed("base_link", "laser"),
    "fixed": lambda bag: bag.fixed("map", "odom", "base_footprint", "base_link", "laser"),
    "repeated": lambda bag: bag.drive("/tf", "odom", "base_link", speed=0.0).fixed("base_link", "laser"),
    "trembling": trembling,
    "fixed in a moving map": lambda bag: bag.drive("/tf", "map", "odom").fixed("odom", "base_link", "laser"),
    "turning laser": lambda bag: bag.fixed("odom", "base_link").rotate("base_link", "laser", 0.4),
    "hinge without a base": lambda bag: bag.fixed("odom", "trolley").rotate("trolley", "laser", 2.0),
    "one value": lambda bag: bag.fixed("base_link", "laser").transform("/tf", SECOND, "odom", "base_link", (3, 0, 0)),
    "of another": of_another,
    "without stamps": without_stamps,
}


@pytest.mark.parametrize("frames", NO_ODOMETRY)
def test_what_does_not_move_is_no_odometry(bag: Robots, frames: str) -> None:
    NO_ODOMETRY[frames](bag)
    for k in range(4):
        bag.scan(k * SECOND // 2)
    scans, log = read(bag)
    assert [scan.pose for scan in scans] == [None] * 4
    assert notes(log)["no_odometry"].message.startswith("no odometry was found: ")


@pytest.mark.parametrize("chain", [("base_link",), ("base_footprint", "base_link"), ("base_footprint",), ("robot",)])
def test_a_frame_that_moves_is(bag: Robots, chain: tuple[str, ...]) -> None:
    bag.drive("/tf", "odom", chain[0])
    bag.fixed(*chain, "laser")
    bag.scan(SECOND)
    (scan,), log = read(bag)
    assert near(scan.pose, 1.0 + 0.2 * len(chain), 0.0, 0.0)
    assert "no_odometry" not in notes(log)


def test_a_robot_that_only_turns_moves(bag: Robots) -> None:
    bag.rotate("odom", "base_link", 2.0 / 9.0)
    bag.fixed("base_link", "laser")
    bag.scan(SECOND)
    (scan,), _ = read(bag)
    assert scan.pose is not None
    assert scan.pose.theta == pytest.approx(4 / 9)


@pytest.mark.parametrize("speed", [1.0, 0.0])
@pytest.mark.parametrize("child", ["base_link", "base_footprint", ""])
def test_odometry_messages_are_odometry_though_frames_beside_them_stand(bag: Robots, child: str, speed: float) -> None:
    bag.drive("/tf", "odom", "base_footprint", speed=0.0)
    bag.transform("/tf_static", 0, "base_footprint", "base_link")
    bag.fixed("base_link", "laser")
    for k in range(5):
        bag.says(k * SECOND // 2, 0.5 * speed * k, child)
    bag.scan(SECOND)
    (scan,), log = read(bag)
    assert near(scan.pose, speed + 0.2, 0.0, 0.0)
    assert scan.pose_frame == "odom"
    assert ("odometry_stands" in notes(log)) is (speed == 0.0)
    assert scan.laser.motion is not None
    assert (scan.laser.motion.vx, scan.laser.motion.vy, scan.laser.motion.omega) == pytest.approx((speed, 0.0, 0.0))


def test_a_frame_may_have_several_parents(bag: Robots) -> None:
    for k in range(5):
        for parent, offset in (("odom", 0.0), ("map", 40.0)):
            bag.transform("/tf", k * SECOND // 2, parent, "base_link", (0.5 * k + offset, 0.0, 0.0))
    bag.transform("/tf", SECOND, "camera", "base_link", (9.0, 9.0, 0.0))
    bag.fixed("base_link", "laser")
    bag.fixed("shelf", "laser")
    bag.scan(SECOND)
    (scan,), log = read(bag)
    assert near(scan.pose, 1.2, 0.0, 0.0)
    assert near(scan.mount, 0.2, 0.0, 0.0)
    assert "several_parents" in notes(log)
    assert near(next(iter(read_log(bag.path, LogOptions(odometry="map")))).pose, 41.2, 0.0, 0.0)


BROKEN: dict[str, Callable[[Robots], Robots]] = {
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
    "circle": lambda bag: bag.fixed("a", "b", "a", topic="/tf").fixed("laser", "base_link"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_one_broken_transform_costs_nothing_else(bag: Robots, name: str) -> None:
    BROKEN[name](bag)
    bag.drive("/tf", "odom", "base_link")
    bag.fixed("base_link", "laser")
    BROKEN[name](bag)
    for k in range(4):
        bag.scan(k * SECOND // 2)
    scans, log = read(bag)
    for k, scan in enumerate(scans):
        assert near(scan.pose, 0.5 * k + 0.2, 0.0, 0.0)
        assert near(scan.mount, 0.2, 0.0, 0.0)
    dropped = counts(log)
    assert name == "circle" or dropped.get("broken_transform", 0) + dropped.get("broken_frame", 0) == 2


def test_a_quaternion_of_few_decimals_is_normalised(bag: Robots) -> None:
    bag.transform("/tf_static", 0, "base_link", "laser", (0.1, 0.0, 0.0), (0.0, 0.0, 0.7, 0.7))
    bag.scan(SECOND)
    (scan,), log = read(bag)
    assert near(scan.mount, 0.1, 0.0, math.pi / 2)
    assert not log.report.dropped


def two_robots(bag: Robots, *scans: str) -> None:
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
    two_robots(bag, "/robot1/scan", "/robot2/scan")
    # Transforms without a namespace, of whichever robot.
    bag.transform("/tf_static", 0, "base_link", "laser", (7.0, 0.0, 0.0))
    (scan,), _ = read(bag, LogOptions(topic=f"/robot{robot}/scan"))
    assert near(scan.mount, 0.1 * robot, 0.0, 0.0)
    assert near(scan.pose, robot * 1.1, 0.0, 0.0)


def test_odometry_messages_have_namespaces_too(bag: Robots) -> None:
    for k, robot in enumerate(("/robot1", "/robot2"), start=1):
        bag.transform(f"{robot}/tf_static", 0, "base_link", "laser", (0.1, 0.0, 0.0))
        for at in range(4 - k):
            bag.says(at * SECOND, float(k * at), topic=f"{robot}/wheels/odom")
        bag.scan(SECOND, f"{robot}/front/scan")
    (scan,), _ = read(bag, LogOptions(topic="/robot2/front/scan"))
    assert near(scan.pose, 2.1, 0.0, 0.0)


@pytest.mark.parametrize(
    ("static", "moving", "topic", "noted"),
    [
        ("/tf_static", "/robot1/tf", "/robot1/scan", False),
        ("/robot1/tf_static", "/tf", "/robot1/scan", False),
        ("/robot1/tf_static", "/robot1/tf", "/scan", True),
    ],
)
def test_transforms_and_scans_without_a_namespace_are_of_the_only_robot(
    bag: Robots, static: str, moving: str, topic: str, noted: bool
) -> None:
    bag.fixed("base_link", "laser", topic=static)
    bag.drive(moving, "odom", "base_link")
    bag.scan(SECOND, topic)
    (scan,), log = read(bag)
    assert near(scan.pose, 1.2, 0.0, 0.0)
    assert ("tf_namespace" in notes(log)) is noted


def test_prefixed_frames_share_a_topic(bag: Robots) -> None:
    for k, robot in enumerate(("robot1", "robot2"), start=1):
        bag.transform("/tf_static", 0, f"{robot}/base_link", f"{robot}/laser", (0.1 * k, 0.0, 0.0))
        bag.drive("/tf", f"{robot}/odom", f"{robot}/base_link", speed=float(k))
        bag.scan(SECOND, f"/{robot}/scan", frame=f"{robot}/laser")
    (scan,), _ = read(bag, LogOptions(topic="/robot2/scan"))
    assert near(scan.pose, 2.2, 0.0, 0.0)
    assert near(scan.mount, 0.2, 0.0, 0.0)
    assert (scan.base_frame, scan.pose_frame) == ("robot2/base_link", "robot2/odom")


def test_where_it_is_not_clear_the_user_chooses(bag: Robots) -> None:
    two_robots(bag, "/scan")
    message = "/robot1, /robot2; choose one with the option tf_namespace"
    with pytest.raises(IncompleteFileError, match=message) as caught:
        read(bag)
    assert "/scan" in str(caught.value)
    for wanted in ("/robot2", "robot2/", "/robot2/tf"):
        (scan,) = read_log(bag.path, LogOptions(tf_namespace=wanted))
        assert near(scan.pose, 2.2, 0.0, 0.0)
    with pytest.raises(IncompleteFileError, match="no transforms in /robot3, only in /robot1, /robot2"):
        list(read_log(bag.path, LogOptions(tf_namespace="/robot3")))


def test_another_robots_transforms_are_never_taken(bag: Robots) -> None:
    bag.fixed("base_link", "laser", topic="/robot2/tf_static")
    bag.drive("/robot2/tf", "odom", "base_link")
    for topic in ("/robot1/scan", "/robot2/scan"):
        bag.scan(SECOND, topic)
    with pytest.raises(IncompleteFileError, match="the namespace of the transforms is ambiguous"):
        read(bag, LogOptions(topic="/robot1/scan"))


OPTICAL: Quaternion = (-0.5, 0.5, -0.5, 0.5)


@pytest.mark.parametrize("turn", [OPTICAL, pitched(90.0), pitched(-25.0), pitched(155.0)])
@pytest.mark.parametrize("base", ["base_link", "trolley"])
def test_scans_in_an_upright_frame_are_refused(bag: Robots, base: str, turn: Quaternion) -> None:
    bag.transform("/tf_static", 0, base, "camera_optical", (0.2, 0.0, 0.3), turn)
    bag.drive("/tf", "odom", base)
    bag.scan(SECOND, frame="camera_optical")
    with pytest.raises(FormatError, match=r"camera_optical: the scan plane is .* degrees .*at most 20.*the mount"):
        read(bag)
    (scan,) = read_log(bag.path, LogOptions(mount=RigidTransform(0.2, 0.0, 0.5)))
    assert near(scan.mount, 0.2, 0.0, 0.5)
    assert not scan.flipped
    assert base != "base_link" or near(scan.pose, 1.2, 0.0, 0.5)


def test_upright_scans_among_others_are_left_out(bag: Robots) -> None:
    bag.fixed("base_link", "laser")
    bag.transform("/tf_static", 0, "base_link", "camera_optical", turn=OPTICAL)
    for frame in ("laser", "camera_optical", "laser"):
        bag.scan(SECOND, frame=frame)
    scans, log = read(bag)
    assert [scan.frame_id for scan in scans] == ["laser", "laser"]
    assert counts(log)["upright_frame"] == 1


@pytest.mark.parametrize(("degrees", "flipped"), [(0.0, False), (12.0, False), (172.0, True), (180.0, True)])
def test_a_tilt_is_said_and_upside_down_is_none(bag: Robots, degrees: float, flipped: bool) -> None:
    half = math.radians(degrees) / 2
    bag.transform("/tf_static", 0, "base_link", "laser", turn=(math.sin(half), 0.0, 0.0, math.cos(half)))
    bag.scan(SECOND)
    (scan,), log = read(bag)
    assert scan.flipped is flipped
    assert ("tilted" in notes(log)) is (degrees in (12.0, 172.0))


def test_a_fixed_transform_that_changes_holds_from_when_it_was_received(bag: Robots) -> None:
    for second, x in enumerate((0.2, 0.2, 0.5), start=1):
        bag.transform("/tf_static", second * SECOND, "base_link", "laser", (x, 0.0, 0.0)).scan(second * SECOND + 1)
    scans, log = read(bag)
    assert [scan.mount.x for scan in scans if scan.mount] == [0.2, 0.2, 0.5]
    assert "at different places" in notes(log)["fixed_again"].message


@pytest.mark.parametrize(("robot", "known"), [("0 0 0", False), ("0 0 0.2", True), ("3 4 0", True)])
def test_a_carmen_log_whose_robot_is_never_anywhere_has_no_odometry(tmp_path: Path, robot: str, known: bool) -> None:
    places = enumerate(("0 0 0", robot, "0 0 0"), start=1)
    lines = [f"FLASER 4 1.0 2.0 3.0 3.0 0.1 0 0 {place} {stamp} host {stamp}\n" for stamp, place in places]
    (tmp_path / "robot.log").write_text("".join(lines))
    log = read_log(tmp_path / "robot.log")
    assert [scan.pose is not None for scan in log] == [known] * 3
    assert ("no_odometry" in notes(log)) is not known
    assert near(next(iter(log)).mount, 0.1, 0.0, 0.0)


@pytest.mark.parametrize("base", ["chassis", "robot1/chassis"])
def test_a_base_of_another_name_is_chosen_by_an_option(bag: Robots, base: str) -> None:
    bag.drive("/tf", "robot1/odom", "robot1/chassis")
    bag.transform("/tf_static", 0, "robot1/chassis", "laser", (0.3, 0.0, 0.0))
    for k in range(4):
        bag.scan(k * SECOND)
    without, _ = read(bag)
    assert without[0].mount is None
    scan = next(iter(read_log(bag.path, LogOptions(base=base))))
    assert near(scan.mount, 0.3, 0.0, 0.0)
    assert scan.base_frame == "robot1/chassis"
    with pytest.raises(IncompleteFileError, match="no transform from laser to the base frame body: expected one of"):
        list(read_log(bag.path, LogOptions(base="body")))
