"""When scans agree, by drives that are drawn with their truth."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from registration import RigidTransform
from ros2.agreement import Agreement, Event, Observation
from tests.association.scenes import known

COVARIANCE = np.diag([0.005**2, 0.005**2, 0.002**2])
SECOND = 1_000_000_000
MAP_FROM_ODOM = RigidTransform(3.0, -2.0, 0.7)
WRONG = RigidTransform(-4.0, 1.0, 2.6)  # moves a pose to a place that looks alike
FAR = Observation(0, RigidTransform(9.0, 9.0, 0.0))


def straight(count: int, step: float = 0.2) -> list[RigidTransform]:
    return [RigidTransform(step * k, 0.0, 0.0) for k in range(count)]


STRAIGHT, LONG, SLOW = straight(12), straight(40), straight(100, 0.05)
STILL = [RigidTransform(1.0, 1.0, 0.5)] * 40


def drive(way: Sequence[RigidTransform], *, odometry: bool = True, seed: int = 1) -> list[Observation]:
    """Return usable scans along a way in the odometry frame, one each 0.4 s."""
    rng = np.random.default_rng(seed)
    scans = []
    for k, place in enumerate(way):
        truth = MAP_FROM_ODOM.compose(place)
        noise = rng.multivariate_normal(np.zeros(3), COVARIANCE)
        pose = RigidTransform(truth.x + noise[0], truth.y + noise[1], truth.theta + noise[2])
        scans.append(Observation(k * SECOND * 2 // 5, pose, COVARIANCE, True, place if odometry else None))
    return scans


def first_agreed(scans: Sequence[Observation], needed: int = 3) -> int | None:
    found = events(scans, needed)
    return found.index(Event.AGREED) if Event.AGREED in found else None


def wrong(scan: Observation) -> Observation:
    return replace(scan, pose=WRONG.compose(known(scan.pose)))


def events(scans: Sequence[Observation], needed: int = 3) -> list[Event]:
    agreement = Agreement(needed)
    return [agreement.take(scan) for scan in scans]


def at_times(scans: Sequence[Observation], seconds: float) -> list[Observation]:
    """Return scans one each so many seconds."""
    return [replace(scan, stamp=round(k * seconds * SECOND)) for k, scan in enumerate(scans)]


def frozen(scans: Sequence[Observation], since: int = 0) -> list[Observation]:
    """Return scans whose odometry stands still from one of them on."""
    return [replace(one, odometry=scans[min(k, since)].odometry) for k, one in enumerate(scans)]


def turned(scans: Sequence[Observation]) -> list[Observation]:
    """Return scans of a laser whose mount is wrong by 180 degrees."""
    about = RigidTransform(0.0, 0.0, math.pi)
    return [replace(one, pose=one.pose.compose(about)) for one in scans if one.pose is not None]


def anywhere() -> list[Observation]:
    """Return scans of a robot that is found in another place of the same corridor each time."""
    drawn = np.random.default_rng(5).uniform(-1.0, 1.0, (300, 3)) * [20.0, 20.0, 3.0]
    scans = drive(straight(300))
    return [replace(scan, pose=RigidTransform(*place)) for scan, place in zip(scans, drawn.tolist(), strict=True)]


def with_one_wrong(scans: list[Observation], number: int) -> list[Observation]:
    return [*scans[:number], wrong(scans[number]), *scans[number + 1 :]]


def on_map(scan: Observation, map_id: str) -> Observation:
    return replace(scan, map_id=map_id)


TURNING = [RigidTransform(1.0, 1.0, math.radians(12.0 * k)) for k in range(12)]
TURNS_AT_THE_END = [*LONG, *(RigidTransform(LONG[-1].x, 0.0, 0.2 * k) for k in range(20))]
DOORWAY = [replace(scan, usable=False, conclusive=True, others=(FAR,)) for scan in drive(STRAIGHT)]
# Scans, and the number of the first that is agreed.
FIRST: dict[str, tuple[list[Observation], int | None]] = {
    "moves by 0.6 m": (drive(STRAIGHT), 3),
    "turns by 36 degrees": (drive(TURNING), 3),
    "moves, without odometry": (drive(STRAIGHT, odometry=False), None),
    "is slow, without odometry": (drive(straight(99, 0.02), odometry=False), None),
    "rests for 5 s": (drive(STILL), 13),
    "rests for 5 s, without odometry": (drive(STILL, odometry=False), 13),
    "many scans of one moment": (at_times(drive([*STILL] * 5), 0.025), None),
    "each scan in another part of odometry": ([replace(one, part=(k,)) for k, one in enumerate(drive(STRAIGHT))], None),
    "one wrong scan among right ones": (with_one_wrong(drive(STRAIGHT), 0), 4),
    "one wrong scan at rest": (with_one_wrong(drive(STILL[:20]), 2), None),
    # The doorway of a round room: one scan is usable and wrong, the others are ambiguous and list other poses.
    "a wrong scan and ambiguous ones": ([wrong(drive(STRAIGHT)[0]), *DOORWAY[1:]], None),
    "another place each time": (anywhere(), None),
    # Two floors that are equal around the robot.
    "on one map": ([on_map(scan, "hq-1") for scan in drive(LONG)], 3),
    "on another map each time": ([on_map(scan, f"hq-{k % 2}") for k, scan in enumerate(drive(LONG))], None),
    "frozen odometry": (frozen(at_times(drive(SLOW), 0.1)), None),
    "a mount that is turned": (turned(drive(LONG)), None),
    "a mount that is turned, and the robot then turns": (turned(drive(TURNS_AT_THE_END)), None),
    # Twice the way is needed: 1 m, and six scans.
    "another pose is likely": ([replace(one, rival=k == 1) for k, one in enumerate(drive(LONG))], 5),
    "another pose is likely, at rest": ([replace(one, rival=True) for one in drive(STILL)], None),
}  # fmt: skip


@pytest.mark.parametrize("kind", FIRST)
def test_which_scan_is_the_first_that_is_agreed(kind: str) -> None:
    scans, first = FIRST[kind]
    assert first_agreed(scans) == first


def test_as_many_scans_are_needed_as_the_option_says() -> None:
    assert [first_agreed(drive(STRAIGHT), needed) for needed in (1, 6)] == [0, 5]


def test_what_is_agreed_and_then_contradicted_is_reported_at_once_and_corrected() -> None:
    scans = drive(straight(20))
    carried = [*scans[:8], *(wrong(scan) for scan in scans[8:])]
    agreement, found = Agreement(), []
    for k, scan in enumerate(carried):
        found.append(agreement.take(scan))
        assert agreement.contradicted == (8 <= k < 11)
    assert found[8:12] == [Event.CONTRADICTED, Event.CONTRADICTED, Event.CONTRADICTED, Event.AGREED]
    assert agreement.latest is carried[-1]


def test_scans_that_are_not_usable_contradict_only_where_they_list_all_poses() -> None:
    scans = drive(STRAIGHT)
    agreement = Agreement()
    for scan in scans[:6]:
        agreement.take(scan)
    elsewhere = replace(wrong(scans[6]), usable=False)
    assert agreement.take(elsewhere) is Event.NOTHING
    assert agreement.take(replace(elsewhere, conclusive=True)) is Event.CONTRADICTED
    listed = replace(elsewhere, conclusive=True, others=(scans[6],))
    assert agreement.take(listed) is Event.NOTHING
    assert agreement.take(Observation(scans[6].stamp)) is Event.NOTHING
    assert agreement.take(scans[7]) is Event.CONFIRMED
    assert not agreement.contradicted


def test_another_map_has_to_be_agreed_as_the_first_one() -> None:
    """The robot leaves a lift at the same coordinates of another floor."""
    scans = drive(straight(20))
    agreement = Agreement()
    ride = [on_map(scan, "hq-1" if k < 8 else "hq-2") for k, scan in enumerate(scans)]
    assert [agreement.take(scan) for scan in ride][7:12] == [
        Event.CONFIRMED, Event.CONTRADICTED, Event.CONTRADICTED, Event.CONTRADICTED, Event.AGREED,
    ]  # fmt: skip
    assert agreement.latest is ride[-1]


def test_an_alternative_on_another_map_is_another_place() -> None:
    scans = [on_map(scan, "hq-1") for scan in drive(STRAIGHT)]
    agreement = Agreement()
    for scan in scans[:6]:
        agreement.take(scan)
    elsewhere = replace(wrong(scans[6]), usable=False, conclusive=True)
    for map_id, event in (("hq-2", Event.CONTRADICTED), ("hq-1", Event.NOTHING)):
        assert agreement.take(replace(elsewhere, others=(on_map(scans[6], map_id),))) is event
    assert agreement.take(replace(scans[6], map_id="hq-2", usable=False, conclusive=True)) is Event.CONTRADICTED


def test_old_scans_are_left_out_and_a_clock_that_is_set_back_begins_again() -> None:
    scans = drive(STRAIGHT)
    agreement = Agreement()
    for scan in scans:
        agreement.take(scan)
    assert agreement.take(replace(wrong(scans[-1]), stamp=scans[-1].stamp - SECOND // 10)) is Event.NOTHING
    assert not agreement.contradicted
    again = [replace(scan, stamp=scan.stamp - 100 * SECOND) for scan in scans]
    assert [agreement.take(scan) for scan in again].index(Event.AGREED) == 3


def test_slow_drift_of_odometry_does_not_contradict() -> None:
    scans = drive(straight(100))
    drifting = [replace(scan, odometry=RigidTransform(0.195 * k, 0.0, 0.001 * k)) for k, scan in enumerate(scans)]
    found = events(drifting)
    assert Event.CONTRADICTED not in found
    assert found.count(Event.AGREED) == 1
