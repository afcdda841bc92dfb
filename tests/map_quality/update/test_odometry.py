"""Odometry carries poses to scans that are not usable alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from association import Deadline, MapIndex
from map_quality import MapUpdate, VisitScan
from map_quality.update.odometry import Carrying
from map_quality.update.scans import Localized, search
from registration import RigidTransform, Segments
from tests.association.scenes import known

from .hall import told, update
from .rooms import FIRST, IN_HALL, SECOND, drive, places_in, rooms, with_odometry

OLD, TODAY = rooms(), rooms(cupboards=[FIRST])
GONE = [("removed", (32, 33, 34, 35))]  # the cupboard of the second room
IN_AND_OUT = [*IN_HALL, *places_in(SECOND), *IN_HALL[::-1]]
APART = (FIRST[0] - SECOND[0], FIRST[1] - SECOND[1])


def updated(scans: list[VisitScan]) -> MapUpdate:
    return update(MapIndex.build(OLD, 0.005), scans)


def days(
    places: list[tuple[float, float]], walls: Segments = TODAY, jumps: dict[int, tuple[float, float]] | None = None
) -> list[VisitScan]:
    return [one for k in range(3) for one in with_odometry(drive(walls, places, k), f"day {k}", jumps)]


def carried(scans: list[VisitScan]) -> list[Localized]:
    """Return the scans of one visit after odometry has carried poses."""
    index = MapIndex.build(OLD, 0.005)
    found = [Localized(0, one, search(index, one, Deadline()), False) for one in scans]
    for _ in Carrying(index, found, Deadline()).carry():
        pass
    return found


@pytest.mark.parametrize(
    "places",
    [IN_AND_OUT, [*IN_HALL, *places_in(SECOND)], [*places_in(SECOND), *IN_HALL[::-1]]],
    ids=["between", "after", "before"],
)
def test_a_change_in_a_room_like_another_is_found_by_odometry(places: list[tuple[float, float]]) -> None:
    scans = days(places)
    assert told(updated([replace(one, odometry=None) for one in scans])) == []
    assert told(updated(scans)) == GONE


def test_odometry_that_jumps_into_the_other_room_is_contradicted_by_the_next_scan_in_the_hall() -> None:
    """Which of the scans between come after the jump is not known."""
    assert told(updated(days(IN_AND_OUT, jumps={len(IN_HALL): APART}))) == []


@pytest.mark.parametrize("factor", [0.3, 3.3])
def test_with_odometry_in_another_unit_scans_alone_are_evidence(factor: float) -> None:
    """A pillar in the hall is gone, too."""
    scans = []
    for one in days(IN_AND_OUT, rooms(cupboards=[FIRST], pillar=False)):
        there = known(one.odometry)
        scans.append(replace(one, odometry=RigidTransform(factor * there.x, factor * there.y, there.theta)))
    assert told(updated(scans)) == [("removed", (12, 13, 14, 15))]


def test_odometry_that_mostly_contradicts_the_scans_shows_nothing() -> None:
    scans = days([*IN_HALL, *places_in(SECOND)], jumps={2: (9.0, 0.0), 3: (-20.0, 0.0), 4: (30.0, 0.0)})[:10]
    assert [one.precise for one in carried(scans)] == [True] * 5 + [False] * 5


@pytest.mark.parametrize(
    ("jump", "agrees"),
    [((0.2, 0.2, 0.1), True), ((2.4, 0.0, 0.0), False), ((0.0, 2.4, 0.0), False), ((0.0, 0.0, 1.6), False)],
)
def test_a_usable_scan_that_two_others_contradict_is_no_evidence(jump: tuple[float, ...], agrees: bool) -> None:
    """By more than three standard deviations of odometry, 0.1 m and 0.1 m for each metre, 0.05 rad and more."""
    scans = days(IN_HALL)[:5]
    there = known(scans[2].odometry)
    scans[2] = replace(scans[2], odometry=RigidTransform(there.x + jump[0], there.y + jump[1], there.theta + jump[2]))
    found = carried(scans)
    assert [one.usable for one in found] == [True] * 5
    assert [one.precise for one in found] == [True, True, agrees, True, True]


def test_a_lone_usable_scan_carries_no_pose() -> None:
    scans = days([IN_HALL[-1], *places_in(SECOND)])[:6]
    assert [one.located for one in carried(scans)] == [True] + [False] * 5


def test_a_pose_is_carried_from_scan_to_scan_so_that_odometry_may_drift() -> None:
    drifting = dict.fromkeys(range(len(IN_HALL), len(IN_AND_OUT)), (0.6, 0.0))
    found = carried(days(IN_AND_OUT, jumps=drifting)[:10])
    assert [one.located for one in found] == [True] * 10


def test_scans_that_are_held_back_are_searched_alone() -> None:
    scans = days(IN_AND_OUT, OLD)
    alone, both = (updated(some) for some in ([replace(one, odometry=None) for one in scans], scans))
    assert both.held_back.before == alone.held_back.before
    assert both.usable.before > alone.usable.before


def test_a_pose_of_the_senders_counts_before_odometry() -> None:
    scans = days([*IN_HALL, *places_in(SECOND)])[:10]
    far = np.diag([0.01, 0.01, 0.01])
    scans[7] = replace(scans[7], pose=RigidTransform(1.0, 1.0, 0.0), covariance=far)
    found = carried(scans)
    assert scans[7].pose == RigidTransform(1.0, 1.0, 0.0)
    assert [one.located for one in found[5:]] == [True, True, False, True, True]
