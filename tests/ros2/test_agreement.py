"""When scans agree, by drives that are drawn with their truth."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from registration import RigidTransform
from ros2.agreement import Agreement, Event, Observation, Place

COVARIANCE = np.diag([0.005**2, 0.005**2, 0.002**2])
SECOND = 1_000_000_000
MAP_FROM_ODOM = RigidTransform(3.0, -2.0, 0.7)
WRONG = RigidTransform(-4.0, 1.0, 2.6)  # moves a pose to a place that looks alike
FAR = Place(RigidTransform(9.0, 9.0, 0.0))
STILL = [RigidTransform(1.0, 1.0, 0.5)] * 12
STRAIGHT = [RigidTransform(0.2 * k, 0.0, 0.0) for k in range(12)]
TURNING = [RigidTransform(1.0, 1.0, math.radians(12.0 * k)) for k in range(12)]


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


def wrong(scan: Observation) -> Observation:
    assert scan.pose is not None
    return replace(scan, pose=WRONG.compose(scan.pose))


def events(scans: Sequence[Observation], needed: int = 3) -> list[Event]:
    agreement = Agreement(needed)
    return [agreement.take(scan) for scan in scans]


def first_agreed(scans: Sequence[Observation], needed: int = 3) -> int | None:
    found = events(scans, needed)
    return found.index(Event.AGREED) if Event.AGREED in found else None


def test_motion_brings_agreement() -> None:
    assert first_agreed(drive(STRAIGHT)) == 3  # 0.6 m
    assert first_agreed(drive(TURNING)) == 3  # 36 degrees
    assert first_agreed(drive(STRAIGHT), needed=6) == 5
    assert first_agreed(drive(STRAIGHT), needed=1) == 0


@pytest.mark.parametrize("odometry", [True, False])
def test_a_robot_at_rest_is_agreed_after_five_seconds(odometry: bool) -> None:
    scans = drive([STILL[0]] * 20, odometry=odometry)
    agreed = first_agreed(scans)
    assert agreed is not None
    assert scans[agreed].stamp == 26 * SECOND // 5  # the first scan after 5 s


def test_many_scans_of_one_moment_count_once() -> None:
    near = [replace(scan, stamp=k * SECOND // 40) for k, scan in enumerate(drive([STILL[0]] * 200))]
    assert first_agreed(near) is None


def test_a_moving_robot_without_odometry_is_not_agreed() -> None:
    assert first_agreed(drive(STRAIGHT, odometry=False)) is None


def test_one_wrong_scan_among_right_ones_is_outvoted() -> None:
    scans = drive(STRAIGHT)
    mixed = [wrong(scans[0]), *scans[1:]]
    agreement = Agreement()
    for scan in mixed:
        agreement.take(scan)
    assert agreement.latest is mixed[-1]
    assert first_agreed(mixed) == 4


def test_at_rest_nothing_may_contradict() -> None:
    scans = drive([STILL[0]] * 20)
    scans[2] = wrong(scans[2])
    assert first_agreed(scans) is None


def test_a_wrong_scan_and_ambiguous_ones_are_not_agreed() -> None:
    """The doorway of a round room: one scan is usable and wrong, the others are ambiguous and list other poses."""
    scans = drive(STRAIGHT)
    after = [replace(scan, usable=False, conclusive=True, others=(FAR,)) for scan in scans]
    assert first_agreed([wrong(scans[0]), *after[1:]]) is None


def test_what_is_agreed_and_then_contradicted_is_reported_at_once_and_corrected() -> None:
    scans = drive([RigidTransform(0.2 * k, 0.0, 0.0) for k in range(20)])
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
    listed = replace(elsewhere, conclusive=True, others=(Place(scans[6].pose),))
    assert agreement.take(listed) is Event.NOTHING
    assert agreement.take(Observation(scans[6].stamp)) is Event.NOTHING
    assert agreement.take(scans[7]) is Event.CONFIRMED
    assert not agreement.contradicted


def on_map(scan: Observation, map_id: str) -> Observation:
    return replace(scan, map_id=map_id)


def test_scans_agree_on_the_pose_and_on_the_map() -> None:
    """Two floors that are equal around the robot: the poses agree, the maps alternate."""
    scans = drive([RigidTransform(0.2 * k, 0.0, 0.0) for k in range(30)])
    assert first_agreed([on_map(scan, "hq-1") for scan in scans]) == 3
    assert first_agreed([on_map(scan, f"hq-{k % 2}") for k, scan in enumerate(scans)]) is None


def test_another_map_has_to_be_agreed_as_the_first_one() -> None:
    """The robot leaves a lift at the same coordinates of another floor."""
    scans = drive([RigidTransform(0.2 * k, 0.0, 0.0) for k in range(20)])
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
    assert scans[6].pose is not None
    for map_id, event in (("hq-2", Event.CONTRADICTED), ("hq-1", Event.NOTHING)):
        assert agreement.take(replace(elsewhere, others=(Place(scans[6].pose, map_id),))) is event
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


def test_poses_that_disagree_with_odometry_are_never_agreed() -> None:
    """A robot that is found in another place of the same corridor each time."""
    rng = np.random.default_rng(5)
    scans = [
        replace(scan, pose=RigidTransform(rng.uniform(-20.0, 20.0), rng.uniform(-20.0, 20.0), rng.uniform(-3.0, 3.0)))
        for scan in drive([RigidTransform(0.2 * k, 0.0, 0.0) for k in range(300)])
    ]
    assert first_agreed(scans) is None


def test_slow_drift_of_odometry_does_not_contradict() -> None:
    scans = drive([RigidTransform(0.2 * k, 0.0, 0.0) for k in range(100)])
    drifting = [replace(scan, odometry=RigidTransform(0.195 * k, 0.0, 0.001 * k)) for k, scan in enumerate(scans)]
    found = events(drifting)
    assert Event.CONTRADICTED not in found
    assert found.count(Event.AGREED) == 1
