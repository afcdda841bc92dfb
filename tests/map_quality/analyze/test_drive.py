"""Distance until a pose is usable, the effect of a landmark, and connected places, in drawn worlds."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from association import Deadline, MapIndex, Status
from map_quality import Analysis, AnalysisError, PlaceVerdict, Robot, standing_places
from map_quality.analyze import standing
from map_quality.analyze.drive import CLEARANCE, STEP, ways_from
from registration import RigidTransform, Segments
from registration.layout import Floats
from simulation import corridor, outline, rectangle_room

# 40 m long and 2 m wide, with a niche near its right end.
NICHE = 32.0
HALL = [(0.0, 0.0), (40.0, 0.0), (40.0, 2.0), (34.0, 2.0), (34.0, 4.0), (NICHE, 4.0), (NICHE, 2.0), (0.0, 2.0)]
REACH = 6.0
BOX = np.array([[-2.5, -1.5, -2.5, 0.0], [-2.5, 0.0, -1.0, 0.0], [-1.0, 0.0, -1.0, -1.5], [-1.0, -1.5, -2.5, -1.5]])


def analyzed(segments: Segments, spacing: float, drive: float = 0.0, robot: Robot | None = None) -> Analysis:
    robot = robot or Robot()
    standing = standing_places(segments, robot, spacing)
    return Analysis(MapIndex.build(segments, 0.0), segments, robot, standing, drive=drive)


def looks(analysis: Analysis) -> list[PlaceVerdict]:
    found = (analysis.look(k) for k in range(len(analysis.standing.poses)))
    return [one for one in found if one is not None]


def hall(drive: float) -> Analysis:
    return analyzed(Segments.from_array(outline(HALL)), 2.0, drive, Robot(range_max=REACH, beams=360))


@pytest.mark.long
def test_who_drives_to_what_is_like_no_other_place_knows_then() -> None:
    found = {one.pose.x: one for one in looks(hall(10.0)) if one.pose.y < 2.0}
    at_once = [x for x, one in found.items() if one.usable]
    assert at_once
    assert all(found[x].resolved_after == 0.0 for x in at_once)
    assert min(at_once) > NICHE - REACH
    driven = {x: one.resolved_after for x, one in found.items() if one.resolved_after}
    nearer = [driven[x] for x in sorted(driven) if x < NICHE]
    assert len(nearer) > 2
    assert all(after <= before + STEP for before, after in pairwise(nearer))  # each drive sees with noise of its own
    for x, metres in driven.items():
        assert not found[x].usable
        assert metres % STEP == 0.0
        assert metres <= 10.0
        assert abs(NICHE + 1.0 - x) - metres < REACH  # it has come to see the niche
    far = [x for x in found if x < NICHE - REACH - 10.0]
    assert len(far) > 5
    assert all(found[x].resolved_after is None for x in far)


def test_a_corridor_is_driven_along_in_vain() -> None:
    analysis = analyzed(corridor().segments, 4.0, 3.0, Robot(range_max=8.0))
    inside = [one for one in looks(analysis) if abs(one.pose.x) < 15.0]
    assert inside
    assert all(one.resolved_after is None for one in inside)


def test_nothing_is_said_of_drives_that_nobody_asked_for() -> None:
    assert {one.resolved_after for one in looks(hall(0.0))} == {None}


def test_a_drive_keeps_from_walls_and_ends_where_there_is_no_room() -> None:
    segments = Segments.from_array(outline(HALL))
    ways = [list(way) for way in ways_from(segments, RigidTransform(20.0, 1.0, 0.0), 30.0, REACH)]
    assert sorted(way[0].x for way in ways) == pytest.approx([19.0, 21.0], abs=0.01)
    for way in ways:
        assert len(way) == 30
        for before, after in pairwise([RigidTransform(20.0, 1.0, 0.0), *way]):
            moved = (after.x - before.x, after.y - before.y)
            assert moved == pytest.approx((STEP * math.cos(after.theta), STEP * math.sin(after.theta)))
            assert CLEARANCE * 0.9 < after.y < (4.0 if NICHE < after.x < 34.0 else 2.0) - CLEARANCE * 0.9
            assert CLEARANCE * 0.9 < after.x < 40.0 - CLEARANCE * 0.9
    closet = Segments.from_array(outline([(0.0, 0.0), (1.2, 0.0), (1.2, 1.2), (0.0, 1.2)]))
    assert [list(way) for way in ways_from(closet, RigidTransform(0.6, 0.6, 0.0), 30.0, REACH)] == [[], []]


def test_a_drive_is_the_same_whenever_it_is_tried() -> None:
    first, second = hall(4.0), hall(4.0)
    numbers = first.standing.order.tolist()[:10]
    assert [first.look(k) for k in numbers] == [second.look(k) for k in reversed(numbers)][::-1]


def test_a_deadline_ends_a_drive() -> None:
    analysis = hall(30.0)
    number = next(one.number for one in looks(hall(0.0)) if not one.usable)
    found = analysis.look(number, Deadline(0.0))
    assert found is not None
    assert found.resolved_after is None


def test_a_box_in_a_corner_tells_the_halves_of_a_room_apart() -> None:
    room = rectangle_room().segments
    plain = analyzed(room, 0.7)
    found = looks(plain.with_segments(Segments.from_array(BOX)))
    assert [replace(one, with_landmark=None) for one in found] == looks(plain)
    assert {one.with_landmark for one in looks(plain)} == {None}
    seen = [one for one in found if one.with_landmark is not None]
    assert len(seen) > 20
    assert not any(one.usable for one in seen)
    assert sum(one.with_landmark.usable for one in seen if one.with_landmark) > 0.8 * len(seen)
    for one in found:
        inside = -2.5 < one.pose.x < -1.0 and -1.5 < one.pose.y < 0.0
        assert not (inside and one.with_landmark), "a robot does not stand in the box"


def test_what_is_added_far_away_changes_nothing() -> None:
    far: Floats = BOX + 500.0
    for one in looks(analyzed(rectangle_room().segments, 2.0).with_segments(Segments.from_array(far)))[:5]:
        assert one.with_landmark is not None
        assert (one.with_landmark.status, one.with_landmark.usable) == (Status.AMBIGUOUS, False)


AT = np.array([41.7, -1203.2])  # where the map lies


def lines(*ends: tuple[float, float, float, float]) -> Floats:
    moved: Floats = np.array(ends) + np.tile(AT, 2)
    return moved


def two_rooms(door: float) -> Floats:
    """Return rooms of 5 by 4 m with a wall between them that has a door in it, and which leans."""
    middle = 2.0 + 0.5 * door
    return lines(
        (0.0, 0.0, 10.0, 0.0), (10.0, 0.0, 10.0, 4.0), (10.0, 4.0, 0.0, 4.0), (0.0, 4.0, 0.0, 0.0),
        (4.6, 0.0, 5.0, 2.0 - 0.5 * door), (5.0, middle, 5.4, 4.0),
    )  # fmt: skip


def reached(ends: Floats, places: Floats, point: tuple[float, float] = (1.0, 1.0)) -> list[bool]:
    start = (AT + np.array(point)).tolist()
    found: list[bool] = standing.reached(Segments.from_array(ends), start, places + AT).tolist()
    return found


@pytest.mark.parametrize(("door", "beyond"), [(0.9, True), (0.3, True), (0.0, False)])
def test_a_door_lets_through_and_a_wall_does_not(door: float, beyond: bool) -> None:
    places = np.array([[0.3, 0.3], [3.9, 3.7], [6.0, 0.3], [9.7, 3.7], [9.7, 0.3]])
    assert reached(two_rooms(door), places) == [True, True, beyond, beyond, beyond]
    assert reached(two_rooms(door), places, (7.0, 2.0)) == [beyond, beyond, True, True, True]


def test_a_wall_in_many_pieces_is_a_wall() -> None:
    cuts = np.linspace(0.0, 4.0, 131)
    pieces = [(5.0 + 0.1 * a, a, 5.0 + 0.1 * b, b) for a, b in pairwise(cuts.tolist())]
    ends = np.vstack([two_rooms(0.0)[:4], lines(*pieces)])
    assert reached(ends, np.array([[4.0, 2.0], [7.0, 2.0]])) == [True, False]


def test_of_a_map_as_large_as_a_town_doors_are_seen_by_wider_cells() -> None:
    """900 m across: cells of 45 cm."""
    far = lines((900.0, 900.0, 900.0, 899.0), (0.0, 60.0, 60.0, 60.0), (60.0, 60.0, 60.0, 0.0), (60.0, 0.0, 0.0, 0.0))
    ends = np.vstack([far, lines((0.0, 0.0, 0.0, 20.0), (0.0, 22.0, 0.0, 60.0))])
    assert reached(ends, np.array([[30.0, 30.0], [300.0, 700.0]]), (30.0, 30.0)) == [True, True]
    closed = np.vstack([far, lines((0.0, 0.0, 0.0, 60.0))])
    assert reached(closed, np.array([[59.0, 59.0], [300.0, 700.0]]), (30.0, 30.0)) == [True, False]


def test_a_map_with_too_much_wall_is_refused() -> None:
    y = np.linspace(0.0, 1.0, 101)
    ends = np.stack([np.zeros(101), y, np.full(101, 9.95e3), y], axis=1)
    with pytest.raises(AnalysisError, match="a smaller map"):
        standing.reached(Segments.from_array(np.vstack([ends, ends])), (5.0, 0.505), np.zeros((0, 2)))


def test_a_point_has_to_be_on_the_map_and_on_no_wall() -> None:
    for point, what in (((-1.0, 1.0), "on the map"), ((1.0, 5.0), "on the map"), ((10.0, 2.0), "on a wall")):
        with pytest.raises(AnalysisError, match=what) as caught:
            reached(two_rooms(0.0), np.zeros((0, 2)), point)
        assert caught.value.argument == "point"
    places = np.stack(np.meshgrid(np.arange(0.05, 10.0, 0.1), np.arange(0.05, 4.0, 0.1)), axis=-1).reshape(-1, 2)
    assert math.isclose(sum(reached(two_rooms(0.0), places)) * 0.01, 4.8 * 4.0, rel_tol=0.06)
