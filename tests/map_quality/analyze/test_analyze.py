"""Drawn maps whose places are known to be told apart, or not, at once or after a drive; connected places."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from association import CancelledError, Deadline, MapIndex, MapPoints, Status
from map_quality import Analysis, AnalysisError, PlaceVerdict, Robot, finished
from map_quality.analyze import standing
from map_quality.analyze.drive import CLEARANCE, STEP, ways_from
from map_quality.analyze.standing import standing_places
from map_quality.views import LEAST_SIGMA, MOST_BEAMS, MOST_SIGMA
from registration import RigidTransform, Segments
from registration.layout import Floats
from simulation import corridor, l_room, outline, rectangle_room

ROBOT = Robot()
L = [(0.0, 0.0), (8.0, 0.0), (8.0, 3.0), (5.0, 3.0), (5.0, 6.0), (0.0, 6.0)]


def two_rooms(apart: float = 20.0) -> Segments:
    room = Segments.from_array(outline(L))
    return Segments.from_array(np.vstack([room.endpoints, room.shifted(np.array([apart, 0.0])).endpoints]))


def analyzed(
    segments: Segments, spacing: float = 1.0, robot: Robot = ROBOT, *, oriented: bool = True, drive: float = 0.0
) -> Analysis:
    index = MapIndex.build(segments, 0.0, oriented=oriented)
    return Analysis(index, segments, robot, standing_places(segments, robot, spacing), drive=drive)


def look(analysis: Analysis, number: int, deadline: Deadline | None = None) -> PlaceVerdict | None:
    return finished(analysis.looking(number, deadline))


def looks(analysis: Analysis) -> list[PlaceVerdict]:
    found = (look(analysis, k) for k in range(len(analysis.standing.poses)))
    return [one for one in found if one is not None]


def test_a_room_like_no_other_is_told_everywhere() -> None:
    found = looks(analyzed(l_room().segments))
    assert len(found) > 20
    far_from_walls = [one for one in found if 1.0 < one.pose.x < 4.5 and 1.0 < one.pose.y < 5.0]
    assert len(far_from_walls) > 8
    for one in far_from_walls:
        assert (one.status, one.usable, one.similar_pose, one.reasons) == (Status.OK, True, None, ())
        assert one.probability is not None
        assert one.probability > 0.99
    assert sum(one.usable for one in found) > 0.8 * len(found)


def test_two_equal_rooms_look_alike() -> None:
    found = looks(analyzed(two_rooms()))
    assert len(found) > 40
    for one in found:
        assert (one.status, one.usable, one.reasons[0]) == (Status.AMBIGUOUS, False, "similar_place")
        assert one.similar_pose is not None
        there = one.pose.x + (20.0 if one.pose.x < 10.0 else -20.0)
        assert one.similar_pose.x == pytest.approx(there, abs=0.1)
        assert (one.similar_pose.y, one.similar_pose.theta) == pytest.approx((one.pose.y, one.pose.theta), abs=0.1)


def test_points_separate_equal_rooms_and_stand_in_the_way() -> None:
    """The posts of the left room: none of its places is within 0.2 m of one, and most are usable."""
    segments, turn = two_rooms(), np.arange(24) * math.tau / 24
    ring = 0.3 * np.column_stack([np.cos(turn), np.sin(turn)])
    posts = np.concatenate([ring + at for at in ((2.0, 4.0), (6.2, 1.3), (3.5, 2.0), (1.2, 1.4), (4.0, 4.7))])
    robot = Robot(sigma=0.01)
    index = MapIndex.build(segments, 0.0, points=MapPoints.of(posts, 0.03))
    found = looks(Analysis(index, segments, robot, standing_places(segments, robot, 1.0)))
    here = np.array([[one.pose.x, one.pose.y] for one in found])
    assert np.hypot(*(here[:, None] - posts).T).min() >= 0.2
    left = [one for one in found if one.pose.x < 10.0]
    assert sum(one.usable for one in left) > 0.5 * len(left)
    assert not any(one.usable for one in found if one.pose.x > 10.0)


def test_a_corridor_leaves_one_direction_free() -> None:
    found = looks(analyzed(corridor().segments, 1.3, Robot(range_max=8.0)))
    inside = [one for one in found if abs(one.pose.x) < 20.0]
    assert len(inside) > 10
    for one in inside:
        assert (one.status, one.usable, one.reasons) == (Status.DEGENERATE, False, ("unobservable_direction",))
        assert one.probability is None
        assert one.unobservable is not None
        assert abs(one.unobservable[0]) == pytest.approx(1.0, abs=1e-3)


def test_places_outside_and_near_walls_are_not_looked_from() -> None:
    analysis = analyzed(Segments.from_array(outline(L)), 0.3)
    standing = analysis.standing
    assert standing.poses[:, 1].min() == pytest.approx(0.15)
    for k in range(len(standing.poses)):
        pose = standing.pose(k)
        inside = 0.2 < pose.x < 7.8 and 0.2 < pose.y < (2.8 if pose.x > 4.8 else 5.8)
        assert (look(analysis, k) is not None) == inside, pose


def test_a_sure_answer_that_is_another_place_is_a_look_alike() -> None:
    """As in a building of which another part was mapped."""
    room = l_room().segments
    seen = analyzed(room)
    elsewhere = MapIndex.build(room.shifted(np.array([3.0, 0.0])), 0.0)
    mistaken = Analysis(elsewhere, room, seen.robot, seen.standing)
    sure = [one.number for one in looks(seen) if one.usable]
    for number in sure[::6]:
        one = look(mistaken, number)
        assert one is not None
        assert one.probability is not None
        assert one.probability > 0.9
        assert (one.status, one.usable, one.reasons) == (Status.AMBIGUOUS, False, ("similar_place",))
        assert one.similar_pose is not None
        assert one.similar_pose.x == pytest.approx(one.pose.x + 3.0, abs=0.1)


def test_without_directions_a_place_is_free_by_what_is_seen_alone() -> None:
    flipped = outline(L)[:, [2, 3, 0, 1]]
    directed = looks(analyzed(Segments.from_array(flipped)))
    assert all(one.pose.x > 5.0 and one.pose.y > 3.0 for one in directed)  # outside, in the corner
    found = looks(analyzed(Segments.from_array(flipped), oriented=False))
    assert any(one.usable for one in found)


def test_a_scanner_that_looks_ahead_looks_four_ways() -> None:
    robot = Robot(fov=math.pi)
    places = standing_places(two_rooms(), robot, 2.0)
    assert sorted(set(places.poses[:, 2].tolist())) == pytest.approx([-math.pi / 2, 0.0, math.pi / 2, math.pi])
    assert len(places.poses) == 4 * len(standing_places(two_rooms(), Robot(), 2.0).poses)


def test_only_what_can_be_reached_from_a_point() -> None:
    both = standing_places(two_rooms(), Robot(), 1.0).poses
    one = standing_places(two_rooms(), Robot(), 1.0, (1.0, 1.0)).poses
    assert both[:, 0].max() > 20.0
    assert one[:, 0].max() < 8.0
    assert len(one) < 0.4 * len(both)


def test_far_from_the_origin() -> None:
    segments = Segments.from_array(outline(L)).shifted(np.array([1e6, 2e6]))
    found = looks(analyzed(segments))
    assert sum(one.usable for one in found) > 0.8 * len(found)
    assert all(one.pose.x > 1e6 for one in found)


def test_what_is_cancelled_gives_up() -> None:
    analysis, deadline = analyzed(l_room().segments), Deadline()
    deadline.cancel()
    free = next(k for k in range(len(analysis.standing.poses)) if look(analysis, k) is not None)
    with pytest.raises(CancelledError):
        look(analysis, free, deadline)


@pytest.mark.parametrize(
    ("argument", "limits", "beyond"),
    [
        ("fov", (1e-3, math.tau), (0.0, 7.0)),
        ("beams", (8, MOST_BEAMS), (7, MOST_BEAMS + 1)),
        ("range_max", (0.5, 1000.0), (0.49, 1001.0)),
        ("sigma", (LEAST_SIGMA, MOST_SIGMA), (0.9 * LEAST_SIGMA, 1.1 * MOST_SIGMA, math.nan)),
    ],
)
def test_a_robot_may_be_at_the_limits(argument: str, limits: tuple[float, ...], beyond: tuple[float, ...]) -> None:
    for value in limits:
        assert getattr(Robot(**{argument: value}), argument) == value  # type: ignore[arg-type]
    for value in beyond:
        with pytest.raises(AnalysisError) as caught:
            Robot(**{argument: value})  # type: ignore[arg-type]
        assert caught.value.argument == f"laser.{argument}"


@pytest.mark.parametrize(
    ("side", "spacing"), [(15.0, 0.8), (14.9, 0.7), (16.2, 0.8), (4.0, 0.3), (3000.0, 100.0), (1999.0, 100.0)]
)
def test_where_nothing_else_is_asked_for_there_are_some_400_places(side: float, spacing: float) -> None:
    """To a tenth of a metre, within the limits."""
    room = Segments.from_array(outline([(0.0, 0.0), (side, 0.0), (side, side), (0.0, side)]))
    places = standing_places(room, Robot(), None)
    assert places.spacing == pytest.approx(spacing)
    assert len(places.poses) == math.floor(side / spacing) ** 2


def test_places_that_cannot_be_are_refused_with_a_spacing_that_will_do() -> None:
    for spacing in (0.29, 100.1):
        with pytest.raises(AnalysisError, match=r"0\.3 to 100 m") as caught:
            standing_places(two_rooms(), Robot(), spacing)
        assert caught.value.argument == "spacing"
    wide = Segments.from_array(np.vstack([two_rooms(500.0).endpoints, [[0.0, 400.0, 1.0, 400.0]]]))
    with pytest.raises(AnalysisError, match=r"at least (\d+\.\d) m") as caught:
        standing_places(wide, Robot(), 0.5)
    assert caught.value.argument == "spacing"


# 40 m long and 2 m wide, with a niche near its right end.
NICHE = 32.0
HALL = [(0.0, 0.0), (40.0, 0.0), (40.0, 2.0), (34.0, 2.0), (34.0, 4.0), (NICHE, 4.0), (NICHE, 2.0), (0.0, 2.0)]
REACH = 6.0
BOX = np.array([[-2.5, -1.5, -2.5, 0.0], [-2.5, 0.0, -1.0, 0.0], [-1.0, 0.0, -1.0, -1.5], [-1.0, -1.5, -2.5, -1.5]])


def hall(drive: float) -> Analysis:
    return analyzed(Segments.from_array(outline(HALL)), 2.0, Robot(range_max=REACH, beams=360), drive=drive)


def test_a_robot_that_drives_to_what_is_like_no_other_place_is_localized_then() -> None:
    """At once where it sees the niche, after a drive to where it does, and not where that is too far away."""
    analysis = hall(10.0)
    xs, ys, _ = analysis.standing.poses.T
    numbers = [int(np.argmin(np.hypot(xs - x, ys - 1.0))) for x in (33.0, 25.0, 11.0)]
    near, far, too_far = (look(analysis, number) for number in numbers)
    assert near is not None
    assert far is not None
    assert too_far is not None
    assert (near.usable, near.resolved_after) == (True, 0.0)
    assert (far.usable, too_far.usable, too_far.resolved_after) == (False, False, None)
    assert far.resolved_after is not None
    assert far.resolved_after % STEP == 0.0
    assert NICHE + 1.0 - far.pose.x - REACH < far.resolved_after <= 10.0


def test_a_corridor_is_driven_along_in_vain() -> None:
    analysis = analyzed(corridor().segments, 4.0, Robot(range_max=8.0), drive=3.0)
    inside = [one for one in looks(analysis) if abs(one.pose.x) < 15.0]
    assert inside
    assert all(one.resolved_after is None for one in inside)


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


def test_a_place_and_a_drive_are_the_same_whenever_they_are_tried() -> None:
    first, second = hall(4.0), hall(4.0)
    numbers = first.standing.order.tolist()[:10]
    assert [look(first, k) for k in numbers] == [look(second, k) for k in reversed(numbers)][::-1]
    assert [look(first, k) for k in numbers] != [look(replace(first, seed=1), k) for k in numbers]


def test_a_deadline_ends_a_drive() -> None:
    analysis = hall(30.0)
    number = next(one.number for one in looks(hall(0.0)) if not one.usable)
    found = look(analysis, number, Deadline(0.0))
    assert found is not None
    assert found.resolved_after is None


def test_a_box_in_a_corner_tells_the_halves_of_a_room_apart() -> None:
    room = rectangle_room().segments
    plain = analyzed(room, 0.7)
    found = looks(plain.with_segments(Segments.from_array(BOX)))
    assert [replace(one, with_landmark=None) for one in found] == looks(plain)
    assert {(one.with_landmark, one.resolved_after) for one in looks(plain)} == {(None, None)}
    seen = [one for one in found if one.with_landmark is not None]
    assert len(seen) > 20
    assert not any(one.usable for one in seen)
    assert sum(one.with_landmark.usable for one in seen if one.with_landmark) > 0.8 * len(seen)
    for one in found:
        inside = -2.5 < one.pose.x < -1.0 and -1.5 < one.pose.y < 0.0
        assert not (inside and one.with_landmark), "a robot does not stand in the box"


AT = np.array([41.7, -1203.2])  # where the map lies


def lines(*ends: tuple[float, float, float, float]) -> Floats:
    moved: Floats = np.array(ends) + np.tile(AT, 2)
    return moved


def rooms_with_a_door(door: float) -> Floats:
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


PIECES = [(5.0 + 0.1 * a, a, 5.0 + 0.1 * b, b) for a, b in pairwise(np.linspace(0.0, 4.0, 131).tolist())]
# As large as a town, 900 m: cells of 45 cm.
TOWN = lines((900.0, 900.0, 900.0, 899.0), (0.0, 60.0, 60.0, 60.0), (60.0, 60.0, 60.0, 0.0), (60.0, 0.0, 0.0, 0.0))


@pytest.mark.parametrize(
    ("ends", "point", "place", "expected"),
    [
        (rooms_with_a_door(0.9), (1.0, 1.0), (9.7, 0.3), True),
        (rooms_with_a_door(0.3), (1.0, 1.0), (9.7, 3.7), True),
        (rooms_with_a_door(0.0), (1.0, 1.0), (6.0, 0.3), False),
        (rooms_with_a_door(0.0), (7.0, 2.0), (9.7, 3.7), True),
        (np.vstack([rooms_with_a_door(0.0)[:4], lines(*PIECES)]), (1.0, 1.0), (7.0, 2.0), False),
        (np.vstack([TOWN, lines((0.0, 0.0, 0.0, 20.0), (0.0, 22.0, 0.0, 60.0))]), (30.0, 30.0), (300.0, 700.0), True),
        (np.vstack([TOWN, lines((0.0, 0.0, 0.0, 60.0))]), (30.0, 30.0), (300.0, 700.0), False),
    ],
)
def test_a_door_lets_through_and_a_wall_does_not(
    ends: Floats, point: tuple[float, float], place: tuple[float, float], expected: bool
) -> None:
    assert reached(ends, np.array([point, place]), point) == [True, expected]


def test_a_map_with_too_much_wall_is_refused() -> None:
    y = np.linspace(0.0, 1.0, 101)
    ends = np.stack([np.zeros(101), y, np.full(101, 9.95e3), y], axis=1)
    with pytest.raises(AnalysisError, match="a smaller map"):
        standing.reached(Segments.from_array(np.vstack([ends, ends])), (5.0, 0.505), np.zeros((0, 2)))


def test_a_point_has_to_be_on_the_map_and_on_no_wall() -> None:
    for point, what in (((-1.0, 1.0), "on the map"), ((1.0, 5.0), "on the map"), ((10.0, 2.0), "on a wall")):
        with pytest.raises(AnalysisError, match=what) as caught:
            reached(rooms_with_a_door(0.0), np.zeros((0, 2)), point)
        assert caught.value.argument == "point"
    places = np.stack(np.meshgrid(np.arange(0.05, 10.0, 0.1), np.arange(0.05, 4.0, 0.1)), axis=-1).reshape(-1, 2)
    assert math.isclose(sum(reached(rooms_with_a_door(0.0), places)) * 0.01, 4.8 * 4.0, rel_tol=0.06)
