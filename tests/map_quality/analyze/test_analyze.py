"""Drawn maps whose places are known to be told apart, or not."""

from __future__ import annotations

import math

import numpy as np
import pytest

from association import CancelledError, Deadline, MapIndex, MapPoints, Status
from map_quality import Analysis, AnalysisError, PlaceVerdict, Robot, standing_places
from map_quality.views import LEAST_SIGMA, MOST_BEAMS, MOST_SIGMA
from registration import Segments
from simulation import corridor, l_room, outline

L = [(0.0, 0.0), (8.0, 0.0), (8.0, 3.0), (5.0, 3.0), (5.0, 6.0), (0.0, 6.0)]


def two_rooms(apart: float = 20.0) -> Segments:
    room = Segments.from_array(outline(L))
    return Segments.from_array(np.vstack([room.endpoints, room.shifted(np.array([apart, 0.0])).endpoints]))


def analyzed(
    segments: Segments, spacing: float = 1.0, robot: Robot | None = None, *, oriented: bool = True
) -> Analysis:
    robot = robot or Robot()
    index = MapIndex.build(segments, 0.0, oriented=oriented)
    return Analysis(index, segments, robot, standing_places(segments, robot, spacing), oriented)


def looks(analysis: Analysis) -> list[PlaceVerdict]:
    found = (analysis.look(k) for k in range(len(analysis.standing.poses)))
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
        assert (analysis.look(k) is not None) == inside, pose


def test_a_sure_answer_that_is_another_place_is_a_look_alike() -> None:
    """As in a building of which another part was mapped."""
    room = l_room().segments
    seen = analyzed(room)
    elsewhere = MapIndex.build(room.shifted(np.array([3.0, 0.0])), 0.0)
    mistaken = Analysis(elsewhere, room, seen.robot, seen.standing)
    sure = [one.number for one in looks(seen) if one.usable]
    for number in sure[::6]:
        one = mistaken.look(number)
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


def test_a_place_is_the_same_whenever_it_is_tried() -> None:
    first, second = analyzed(l_room().segments), analyzed(l_room().segments)
    numbers = first.standing.order.tolist()[:12]
    assert [first.look(k) for k in numbers] == [second.look(k) for k in reversed(numbers)][::-1]
    other = Analysis(first.index, first.segments, first.robot, first.standing, seed=1)
    assert [first.look(k) for k in numbers] != [other.look(k) for k in numbers]


def test_far_from_the_origin() -> None:
    segments = Segments.from_array(outline(L)).shifted(np.array([1e6, 2e6]))
    found = looks(analyzed(segments))
    assert sum(one.usable for one in found) > 0.8 * len(found)
    assert all(one.pose.x > 1e6 for one in found)


def test_what_is_cancelled_gives_up() -> None:
    analysis, deadline = analyzed(l_room().segments), Deadline()
    deadline.cancel()
    free = next(k for k in range(len(analysis.standing.poses)) if analysis.look(k) is not None)
    with pytest.raises(CancelledError):
        analysis.look(free, deadline)


@pytest.mark.parametrize(
    ("robot", "argument"),
    [
        ({"fov": 0.0}, "laser.fov"),
        ({"fov": 7.0}, "laser.fov"),
        ({"sigma": math.nan}, "laser.sigma"),
    ],
)
def test_a_robot_that_cannot_be(robot: dict[str, float], argument: str) -> None:
    with pytest.raises(AnalysisError) as caught:
        Robot(**robot)  # type: ignore[arg-type]
    assert caught.value.argument == argument


@pytest.mark.parametrize(
    ("argument", "least", "greatest"),
    [("beams", 8, MOST_BEAMS), ("range_max", 0.5, 1000.0), ("sigma", LEAST_SIGMA, MOST_SIGMA)],
)
def test_a_robot_may_be_at_the_limits(argument: str, least: float, greatest: float) -> None:
    for limit, beyond in ((least, 0.99 * least), (greatest, 1.01 * greatest)):
        assert getattr(Robot(**{argument: limit}), argument) == limit  # type: ignore[arg-type]
        with pytest.raises(AnalysisError) as caught:
            Robot(**{argument: beyond})  # type: ignore[arg-type]
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


@pytest.mark.parametrize(
    ("spacing", "point", "argument"),
    [(0.29, None, "spacing"), (100.1, None, "spacing"), (1.0, (50.0, 0.0), "point"), (1.0, (0.0, 3.0), "point")],
)
def test_places_that_cannot_be(spacing: float, point: tuple[float, float] | None, argument: str) -> None:
    with pytest.raises(AnalysisError) as caught:
        standing_places(two_rooms(), Robot(), spacing, point)
    assert caught.value.argument == argument


def test_too_many_places_are_refused_with_a_spacing_that_will_do() -> None:
    wide = two_rooms(500.0)
    with pytest.raises(AnalysisError, match=r"at least (\d+\.\d) m") as caught:
        standing_places(Segments.from_array(np.vstack([wide.endpoints, [[0.0, 400.0, 1.0, 400.0]]])), Robot(), 0.5)
    assert caught.value.argument == "spacing"
