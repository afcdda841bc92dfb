"""Scans that do not belong to a map, or that prove nothing, change nothing."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from association import CancelledError, Deadline, MapIndex, mirrored
from benchmarks.worlds.map_errors import walls_off
from linefix import LaserScan, scan_of
from map_quality import UpdateError, VisitScan
from map_quality.scale import Matched, errors_of
from map_quality.update.beams import on_critical_wall
from map_quality.update.scans import Localized, held_back, search
from registration import InputError, RigidTransform, Segments
from simulation import Scanner, scan

from .hall import PILLAR, RACK, SCANNER, box, segments, update, visit

HALL = segments(RACK, PILLAR)
TODAY = segments(PILLAR)
OTHER = [[0.0, 0, 15, 0], [15, 0, 15, 4], [15, 4, 11, 10], [11, 10, 0, 10], [0, 10, 0, 0]]  # another building


def days(
    walls: Segments, *, scanner: Scanner = SCANNER, change: Callable[[np.ndarray], np.ndarray] = lambda r: r
) -> list[VisitScan]:
    return [one for k in range(3) for one in visit(walls, f"day {k}", k, scanner, change)]


def index() -> MapIndex:
    return MapIndex.build(HALL, 0.005)


@pytest.mark.parametrize("factor", [0.98, 1.02])
def test_scans_off_scale_change_nothing(factor: float) -> None:
    found = update(index(), days(TODAY, change=lambda ranges: ranges * factor))
    assert found.changes == ()


@pytest.mark.parametrize(("factor", "refused"), [(1.0, 0), (1.02, 2)])
def test_honest_visits_to_a_blurred_map_count(factor: float, refused: int) -> None:
    """Its walls make lengths differ by 0.9 %, in all scans alike."""
    blurred = MapIndex.build(walls_off(HALL, np.random.default_rng(2), 0.05).segments, 0.05)
    scans = [visit(HALL, f"day {k // 2}", k, change=lambda ranges: ranges * factor) for k in range(4)]
    assert len(update(blurred, [one for some in scans for one in some]).refused_visits) == refused


def test_scans_of_a_mirrored_laser_change_nothing() -> None:
    backward = replace(SCANNER, angle_min=-SCANNER.angle_min, angle_increment=-SCANNER.angle_increment)
    scans = [replace(one, scan=mirrored(one.scan)) for one in days(TODAY, scanner=backward)]
    found = update(index(), scans)
    assert found.changes == ()
    assert found.refused_visits


def test_scans_of_another_building_change_nothing_and_the_visits_are_named() -> None:
    found = update(index(), days(Segments.from_array(np.array([*box(1, 1, 4, 3), *OTHER]))))
    assert found.changes == ()
    assert [one.visit for one in found.refused_visits] == ["day 0", "day 1", "day 2"]
    assert "usable" in found.refused_visits[0].message


def test_a_visit_counts_though_most_of_its_scans_are_off_the_map() -> None:
    """As where the map shows a part of the building."""
    other = Segments.from_array(np.array(OTHER))
    with_a_cart = MapIndex.build(segments(RACK, PILLAR, box(6.0, 5.0, 7.2, 5.8)), 0.005)
    found = update(with_a_cart, [*days(HALL), *days(other) * 2])
    assert found.refused_visits == ()
    assert [one.code for one in found.changes] == ["removed"]
    (refused, *_) = update(with_a_cart, [*days(HALL), *days(other) * 6]).refused_visits
    assert "that the map shows the places" in refused.message


def test_visits_along_one_route_hold_other_places_back() -> None:
    held = np.array(held_back([k // 60 for k in range(300)])).reshape(5, 60)
    assert held.sum(axis=1).tolist() == [6] * 5
    assert held.sum(axis=0).max() == 1


def test_a_proposal_that_there_is_no_time_to_verify_is_none() -> None:
    found = update(index(), days(TODAY), Deadline(time.monotonic()))
    assert (found.changes, found.complete) == ((), False)
    deadline = Deadline()
    deadline.cancel()
    with pytest.raises(CancelledError):
        update(index(), days(TODAY), deadline)


def test_single_changes_are_refused_and_unsure_ones_not_accepted() -> None:
    scans = days(TODAY)
    refused = update(index(), scans, refuse=[0])
    assert (len(refused.changes), refused.accepted) == (1, (False,))
    assert refused.segments.endpoints.tolist() == HALL.endpoints.tolist()
    assert update(index(), scans, accept=1.0).accepted == (False,)
    assert update(index(), scans, accept=0.9).accepted == (True,)
    with pytest.raises(InputError, match="refuse: found 1, expected an index of the 1 proposed"):
        update(index(), scans, refuse=[1])
    with pytest.raises(InputError, match=r"accept: found 2.0, expected a confidence from 0 to 1"):
        update(index(), scans, accept=2.0)


def test_a_pose_of_the_senders_needs_its_covariance_and_does_not_replace_the_search() -> None:
    one = days(TODAY)[0]
    with pytest.raises(UpdateError, match="covariance: found none"):
        replace(one, pose=RigidTransform(1.0, 1.0, 0.0))
    wrong = [replace(each, pose=RigidTransform(3.0, 3.0, 0.0), covariance=1e-4 * np.eye(3)) for each in days(TODAY)]
    assert update(index(), wrong).changes == ()


def test_scans_are_needed_and_with_ranges() -> None:
    with pytest.raises(UpdateError, match="scans: found no scans"):
        update(index(), [])
    bare = replace(days(TODAY)[0].scan, beams=None)
    with pytest.raises(UpdateError, match="without ranges"):
        VisitScan(bare, "day 0")


def test_a_wall_that_alone_fixes_a_pose_is_no_evidence_for_itself() -> None:
    """Without its end wall a corridor leaves the position along it free."""
    corridor = Segments.from_array(np.array([[0, 0, 30, 0], [30, 0, 30, 2], [30, 2, 0, 2]], dtype=float))
    known = MapIndex.build(corridor, 0.01)
    at = RigidTransform(24.0, 1.0, 0.0)
    ranges = scan(corridor, at, SCANNER, np.random.default_rng(1)).ranges
    seen = scan_of(LaserScan(SCANNER.angle_min, SCANNER.angle_increment, ranges, 0.0, 20.0))
    one = VisitScan(seen, "day 0", at, np.diag([0.01, 0.01, 0.01]))
    result = search(known, one, Deadline())
    assert result.pose is not None
    assert math.hypot(result.pose.x - at.x, result.pose.y - at.y) < 0.1
    localized = Localized(0, one, result, False)
    assert on_critical_wall(localized, corridor).tolist() == [False, True, False]


FEW_USABLE = pytest.mark.xfail(strict=True, reason="1 to 3 scans are usable, not 4")


@pytest.mark.parametrize("factor", [1.0, pytest.param(1.015, marks=FEW_USABLE)])
def test_the_scale_of_scans_is_estimated_with_their_poses_and_an_error_of_all_ranges(factor: float) -> None:
    known, found = index(), []
    for one in days(HALL, change=lambda ranges: ranges * factor + 0.01):
        result = search(known, one, Deadline())
        # Most scans that are off scale are not usable, because they fit the map too badly; their poses are right.
        is_placed = {reason.code for reason in result.reasons} <= {"map_mismatch", "insufficient_evidence"}
        matched = Matched.of(HALL, one.scan, result)
        if is_placed and matched and not any(warning.code == "map_scale" for warning in result.warnings):
            found.append(matched)
    assert len(found) > 3
    errors = errors_of(found, 0.005)
    assert errors.scale_deviation < 0.003
    assert errors.scale == pytest.approx(factor - 1.0, abs=3.0 * errors.scale_deviation + 5e-4)
