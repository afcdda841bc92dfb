"""Odometry of a log is used where it is known, and gives the motion during a scan.

It is not known in gaps, across clocks that were set back, or where it jumps.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import pytest

from formats import IncompleteFileError, LoggedScan, LogOptions, Note, read_log
from registration import RigidTransform

from .bags import FOUR_BEAMS, SECOND, UP, Robots, read, yawed
from .reading import counts, notes

TENTH = SECOND // 10
BEGUN = 100 * SECOND
Value = tuple[int, int, float]  # received, stamp, x


def drive(first: int, last: int, *, back: int = 0, speed: float = 1.0, since: int = 0) -> list[Value]:
    """Return values of tenths of a second; `back` is by how much the clock was set back."""
    return [(BEGUN + k * TENTH, BEGUN + k * TENTH - back, speed * 0.1 * (k - since)) for k in range(first, last)]


class Recorded(Robots):
    """A bag whose messages are received at a time that is set."""

    now = 0

    def write(self, topic: str, kind: str, ns: int, data: bytes) -> Robots:
        return super().write(topic, kind, self.now, data)


def recorded(
    folder: Path, values: Sequence[Value], scans: Sequence[tuple[int, int]], *, messages: bool
) -> tuple[list[LoggedScan], dict[str, Note]]:
    """Write values of odometry, as transforms or as messages, and scans; return what is read, and its notes."""
    bag = Recorded("mcap", folder)
    bag.fixed("base_link", "laser")
    for bag.now, stamp, x in sorted([*values, *((*one, math.nan) for one in scans)], key=lambda one: one[0]):
        if math.isnan(x):
            bag.scan(stamp)
        elif messages:
            bag.says(stamp, x)
        else:
            bag.transform("/tf", stamp, "odom", "base_link", (x, 0.0, 0.0))
    found, log = read(bag)
    return found, notes(log)


def at(*tenths: float, back: int = 0, late: int = 0) -> list[tuple[int, int]]:
    return [(BEGUN + round(k * TENTH) + late, BEGUN + round(k * TENTH) - back) for k in tenths]


def xs(found: Sequence[LoggedScan]) -> list[float | None]:
    return [None if one.pose is None else round(one.pose.x - 0.2, 3) for one in found]  # of the base


@pytest.mark.parametrize("messages", [False, True])
@pytest.mark.parametrize(("seconds", "known"), [(0.2, True), (0.4, False), (1.0, False), (8.0, False)])
def test_odometry_is_unknown_in_a_gap(tmp_path: Path, messages: bool, seconds: float, known: bool) -> None:
    lost = round(10 * seconds)
    values = [*drive(0, 21), *drive(20 + lost, 40 + lost)]
    found, noted = recorded(tmp_path, values, at(5.5, 20.5, 30.5 + lost), messages=messages)
    assert xs(found) == pytest.approx([0.55, 2.05 if known else None, 3.05 + seconds])
    assert [one.part for one in found] == [0, 0, 0]
    assert found[2].unknown_s == pytest.approx(0.0 if known else seconds)
    assert ("odometry_gap" in noted, "no_pose" in noted) == (not known, not known)
    assert known or f"missing for up to {seconds:.1f} s" in noted["odometry_gap"].message
    (tmp_path / "outside").mkdir()
    _, noted = recorded(tmp_path / "outside", values, at(5.5, 30.5 + lost), messages=messages)
    assert "odometry_gap" not in noted  # no scan is in it


@pytest.mark.parametrize("messages", [False, True])
def test_odometry_is_unknown_before_its_first_and_after_its_last_value(tmp_path: Path, messages: bool) -> None:
    found, *_ = recorded(tmp_path, drive(10, 21), at(9.5, 10.5, 20.0, 20.5), messages=messages)
    assert xs(found) == [None, 1.05, 2.0, None]


@pytest.mark.parametrize("messages", [False, True])
@pytest.mark.parametrize("seconds", [0.5, 1.5, 3.0, 100.0])
def test_a_clock_that_is_set_back_begins_a_part_of_the_log(tmp_path: Path, messages: bool, seconds: float) -> None:
    back = round(seconds * SECOND)
    values = [*drive(0, 41), *drive(41, 80, back=back, speed=-0.5)]
    scans = [*at(10.5, 30.5), *at(50.5, 70.5, back=back)]
    found, noted = recorded(tmp_path, values, scans, messages=messages)
    assert xs(found) == pytest.approx([1.05, 3.05, -2.525, -3.525])
    assert [one.part for one in found] == [0, 0, 1, 1]
    assert noted["odometry_parts"].count == 0
    assert "each of 2 parts" in noted["odometry_parts"].message


@pytest.mark.parametrize("messages", [False, True])
def test_two_publishers_that_contradict_each_other_are_named(tmp_path: Path, messages: bool) -> None:
    other = [(received + TENTH // 5, stamp + TENTH // 5, x - 1.0) for received, stamp, x in drive(20, 60)]
    found, noted = recorded(tmp_path, [*drive(0, 60), *other], at(5, 30, 30.1, 30.5, 50), messages=messages)
    assert xs(found) == [0.5, None, None, None, None]
    assert noted["odometry_jumps"].count > 70
    told = noted["odometry_jumps"].message
    assert f"on {'/odom' if messages else '/tf'}, the first 1.0" in told
    assert "0.020 s at stamp 102.0" in told


def test_odometry_that_is_reset_begins_a_part(tmp_path: Path) -> None:
    values = [*drive(0, 41), *drive(41, 80, since=41)]
    found, *_ = recorded(tmp_path, values, at(30, 40.5, 60), messages=True)
    assert xs(found) == [3.0, None, 1.9]
    assert found[0].part != found[2].part


@pytest.mark.parametrize("seconds", [0.8, 99.0, -0.8])
def test_a_laser_with_another_clock_is_named(tmp_path: Path, seconds: float) -> None:
    scans = at(20, 30, back=round(seconds * SECOND))
    found, noted = recorded(tmp_path, drive(0, 60), scans, messages=False)
    assert xs(found) == [None, None]
    assert noted["clocks"].count == 2
    assert (
        f"{abs(seconds):.1f} s {'behind' if seconds > 0 else 'ahead of'} those of odometry" in noted["clocks"].message
    )


def test_a_carmen_log_has_parts_as_well(tmp_path: Path) -> None:
    path = tmp_path / "robot.log"
    rows = [(1.0, 100.0), (1.5, 100.5), (9.5, 100.9), (9.7, 101.4), (9.8, 51.4), (9.9, 51.9)]
    path.write_text("".join(f"FLASER 2 1.0 2.0 {x} 0 0 {x} 0 0 {t} host {t}\n" for x, t in rows))
    assert [one.part for one in read_log(path)] == [0, 0, 1, 1, 2, 2]


def turning(bag: Robots, *, rate: float, flip: bool = False) -> None:
    """A robot that turns and drives, at 0.5 rad/s and 0.4 m/s along its own x axis; a transform 1 / rate seconds."""
    for k in range(-10, 11):
        t = k / rate
        x, y = 0.8 * math.sin(0.5 * t), 0.8 * (1.0 - math.cos(0.5 * t))
        bag.transform("/tf", BEGUN + round(t * SECOND), "odom", "base_link", (x, y, 0.0), yawed(0.5 * t))
    bag.transform("/tf_static", 0, "base_link", "laser", (0.2, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0) if flip else UP)


@pytest.mark.parametrize(
    ("flip", "mount", "expected"),
    [
        (False, None, (0.4, 0.1, 0.5)),  # the sensor is 0.2 m ahead of the axis that the robot turns about
        (True, None, (0.4, -0.1, -0.5)),
        (False, RigidTransform(0.0, 0.3, math.pi / 2), (0.0, -0.25, 0.5)),
    ],
)
def test_a_scan_that_takes_time_has_the_motion_of_its_sensor(
    bag: Robots, flip: bool, mount: RigidTransform | None, expected: tuple[float, float, float]
) -> None:
    turning(bag, rate=20.0, flip=flip)
    bag.scan(BEGUN)
    (scan,), log = read(bag, LogOptions(mount=mount))
    motion = scan.laser.motion
    assert motion is not None
    assert motion.time_increment == pytest.approx(0.001)
    assert (motion.vx, motion.vy, motion.omega) == pytest.approx(expected, abs=6e-3)
    assert "motion" not in notes(log)


@pytest.mark.parametrize("rate", [0.5, 0.0])
def test_a_motion_that_odometry_does_not_say_is_not_known(bag: Robots, rate: float) -> None:
    if rate:
        turning(bag, rate=rate)
    bag.scan(BEGUN)
    (scan,), log = read(bag)
    assert scan.laser.motion is None
    assert scan.time_increment == pytest.approx(0.001)
    assert counts(log)["motion"] == 1


@pytest.mark.parametrize(("scan_time", "expected"), [(0.1, 0.025), (0.0, 0.05), (math.nan, 0.05), (30.0, 0.05)])
def test_a_time_increment_in_another_unit_is_replaced(bag: Robots, scan_time: float, expected: float) -> None:
    bag.scan(1, laser=FOUR_BEAMS.but(ranges=(1.0,) * 4, time_increment=100.0, scan_time=scan_time))
    (scan,), log = read(bag)
    assert scan.time_increment == pytest.approx(expected)
    assert counts(log)["time_increment"] == 1


@pytest.mark.parametrize("by_tf", [False, True])
@pytest.mark.parametrize(("scale", "shift", "known"), [(1.0, 0.0, True), (0.5, 0.0, False), (1.0, 1.0, False)])
def test_sources_that_contradict_are_named(bag: Robots, by_tf: bool, scale: float, shift: float, known: bool) -> None:
    """The second source has another speed, or is moved by a metre in between."""
    bag.fixed("base_link", "laser")
    for k in range(100):
        ns, x = BEGUN + k * TENTH, 0.1 * k
        if by_tf:
            bag.transform("/tf", ns, "odom", "base_link", (x, 0.0, 0.0))
        else:
            bag.says(ns, x)
        bag.says(ns, scale * x + shift * min(1.0, max(0.0, 0.2 * (k - 40))), topic="/wheels")
    bag.scan(BEGUN + 45 * TENTH)
    bag.scan(BEGUN + 90 * TENTH)
    found, log = read(bag)
    assert (found[0].pose is not None) == known
    assert (found[1].pose is not None) == (scale == 1.0)
    assert ("odometry_contradicts" in notes(log)) is not known
    told = "" if known else notes(log)["odometry_contradicts"].message
    assert known or all(one in told for one in ("tf" if by_tf else "/odom", "/wheels", "within 2.0 s", "stamp 10"))
    for source, factor in (("odom" if by_tf else "/odom", 1.0), ("/wheels", scale)):
        assert known or f"--odom {source}" in told
        chosen = read_log(bag.path, LogOptions(odometry=source))
        first = 4.5 * factor + 0.2 + shift * (source == "/wheels")  # the laser is 0.2 m ahead
        assert [scan.pose and scan.pose.x for scan in chosen] == pytest.approx([first, first + 4.5 * factor])
        assert "odometry_contradicts" not in notes(chosen)
    with pytest.raises(IncompleteFileError, match=r"no odometry from /rtk: expected a topic .*, found .*/wheels"):
        list(read_log(bag.path, LogOptions(odometry="/rtk")))
