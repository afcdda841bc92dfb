"""Changes of a hall that scans of several visits show."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from association import MapIndex
from benchmarks.worlds.map_errors import walls_off
from map_quality import Change, Evidence, MapUpdate, VisitScan, apply_changes
from map_quality.update.evidence import are_enough
from registration import Segments

from .hall import OUTLINE, PILLAR, RACK, SCANNER, box, segments, told, update, visit

CART, HIDDEN = box(6.0, 5.0, 7.2, 5.8), box(20.0, 0.0, 24.0, 3.0)
HALL = segments(RACK, PILLAR)


def updated(old: Segments, *visits: list[VisitScan], sigma: float = 0.005, oriented: bool = True) -> MapUpdate:
    return update(MapIndex.build(old, sigma, oriented=oriented), [one for some in visits for one in some])


def visits(*today: Segments) -> list[list[VisitScan]]:
    """One visit to each state of the hall."""
    return [visit(walls, f"day {k}", k) for k, walls in enumerate(today)]


def partition(x: float, width: float = 0.15, end: float = 3.0) -> list[list[float]]:
    """Return a wall that stands out from the outline."""
    return [[x, 0.0, x, end], [x, end, x + width, end], [x + width, end, x + width, 0.0]]


def off_walls(new: np.ndarray, truth: Segments) -> np.ndarray:
    """Return how far the ends of each segment are from the nearest wall of the truth that faces the same way, m."""
    found = Segments.from_array(new)
    far = []
    for ends, direction in zip(found.endpoints, found.directions, strict=True):
        off = []
        for point in (ends[:2], ends[2:]):
            along = np.einsum("ij,ij->i", point - truth.endpoints[:, :2], truth.directions)
            near = truth.endpoints[:, :2] + np.clip(along, 0.0, truth.lengths)[:, None] * truth.directions
            gaps = np.linalg.norm(near - point, axis=1)
            off.append(np.where(truth.directions @ direction > 0.99, gaps, np.inf).min())
        far.append(max(off))
    return np.array(far)


def test_an_unchanged_hall_stays_as_it_is() -> None:
    found = updated(HALL, *visits(HALL, HALL, HALL))
    assert (found.changes, found.kept) == ((), ())
    assert found.segments.endpoints.tolist() == HALL.endpoints.tolist()
    assert (found.usable.scans, found.held_back.scans) == (22, 2)
    assert found.usable.before == found.usable.after > 18


def test_a_wall_with_a_small_gap_stays_and_the_reason_is_given() -> None:
    hall, today = (segments(RACK, [[x, 5.5, y, 5.5] for x, y in gap]) for gap in ([(8, 6)], [(8, 7.25), (6.8, 6)]))
    found = updated(hall, *visits(today, today, today))
    assert found.changes == ()
    assert [(one.code, one.segments) for one in found.kept] == [("still_seen", (16,))]


@pytest.mark.parametrize(("count", "oriented"), [(2, True), (3, False)])
def test_a_thing_that_is_gone_is_removed_whole_and_walls_that_are_not_seen_stay(count: int, oriented: bool) -> None:
    hall, today = segments(RACK, PILLAR, HIDDEN), segments(PILLAR, HIDDEN)
    found = updated(hall, *visits(*[today] * count), oriented=oriented)
    assert told(found) == [("removed", (12, 13, 14, 15))]
    assert found.segments.endpoints.tolist() == today.endpoints.tolist()
    shown = found.changes[0].evidence
    assert shown.beams_through > 100
    assert (shown.visits, shown.first, shown.last) == (count, "day 0", f"day {count - 1}")
    assert found.changes[0].confidence > 0.99


def test_a_new_thing_is_added_where_it_stands_with_its_free_side_outside() -> None:
    today = segments(RACK, PILLAR, CART)
    found = updated(HALL, *visits(today, today))
    assert [one.code for one in found.changes] == ["added"]
    new = found.changes[0].new
    assert len(new) == 4
    assert off_walls(new, Segments.from_array(np.array(CART))).max() < 0.05
    assert (found.changes[0].sigma < 0.02).all()
    assert found.segments.endpoints[: len(HALL)].tolist() == HALL.endpoints.tolist()


@pytest.mark.parametrize(
    ("before", "after", "count", "expected"),
    [
        ([RACK, PILLAR], [RACK, box(9.1, 4.4, 9.7, 5.0)], 2, ("moved", (16, 17, 18, 19))),
        *(([RACK, PILLAR, partition(5.7)], [RACK, PILLAR, partition(6.4)], k, ("moved", (20, 21, 22))) for k in (3, 5)),
        # The rack, or the pillar, hides a part of one of its faces where it stands now.
        *(
            ([RACK, PILLAR, partition(x)], [RACK, PILLAR, partition(x + 0.7)], 4, ("moved", (20, 21, 22)))
            for x in (3.9, 9.3)
        ),
        # No beam crosses its end, which is as short as a stub, and stood between two faces that are gone.
        ([RACK, PILLAR, partition(4.7, 0.1, 2.5)], [RACK, PILLAR], 3, ("removed", (20, 21, 22))),
    ],
)
def test_a_thing_or_wall_that_moved_or_is_gone_is_one_change_without_a_stub(
    before: list[list[list[float]]], after: list[list[list[float]]], count: int, expected: tuple[str, tuple[int, ...]]
) -> None:
    found = updated(segments(*before), *visits(*[segments(*after)] * count))
    assert told(found) == [expected]
    assert off_walls(found.changes[0].new, segments(*after)).max(initial=0.0) < 0.05


def test_a_wall_across_the_old_one_is_another_one() -> None:
    today = segments(RACK, PILLAR, box(4.3, 1.6, 7.3, 1.75))
    found = updated(segments(RACK, PILLAR, partition(5.7)), *visits(*[today] * 3))
    assert sorted(one.code for one in found.changes) == ["added", "removed"]


def test_a_wall_that_moved_on_a_map_whose_walls_are_off_is_one_change() -> None:
    """Its faces and its end do not meet on such a map."""
    old = walls_off(segments(RACK, PILLAR, partition(5.7)), np.random.default_rng(5), 0.04).segments
    today = segments(RACK, PILLAR, partition(6.4))
    days = [[one for route in range(4) for one in visit(today, f"day {k}", 10 * k + route)] for k in range(2)]
    assert told(updated(old, *days, sigma=0.04)) == [("moved", (20, 21, 22))]


@pytest.mark.parametrize("beams", [360, 720])
def test_a_wall_that_is_removed_leaves_no_stub_at_the_wall_that_it_stood_against(beams: int) -> None:
    """Flat beams that end on the outer wall, up to 0.4 m from the corner, also end near where the wall stood."""
    scanner = replace(SCANNER, beams=beams, angle_increment=math.tau / beams)
    days = [visit(HALL, f"day {k}", k, scanner) for k in range(4)]
    found = updated(segments(RACK, PILLAR, partition(5.7)), *days, sigma=0.02)
    assert told(found) == [("removed", (20, 21, 22))]


@pytest.mark.xfail(strict=True, reason="too few scans that see where it was are usable: it is found as added")
def test_both_faces_of_a_wall_without_ends_move_together() -> None:
    old, new = ([[4, y, 10, y], [10, y + 0.15, 4, y + 0.15]] for y in (5.0, 5.7))
    hall, today = segments(RACK, PILLAR, old), segments(RACK, PILLAR, new)
    assert told(updated(hall, *visits(*[today] * 5))) == [("moved", (20, 21))]


def test_an_outer_wall_that_moved_is_one_change() -> None:
    walls = [[-0.7, 0, 12, 0], *OUTLINE[1:10], [5.5, 8, -0.7, 8], [-0.7, 8, -0.7, 0], *RACK, *PILLAR]
    today = Segments.from_array(np.array(walls, dtype=float))
    found = {one.segments: one.code for one in updated(HALL, *visits(*[today] * 5)).changes}
    assert found[(11,)] == "moved"
    assert set(found.values()) <= {"moved", "extended"}


def test_a_new_opening_shortens_its_wall_on_both_sides() -> None:
    recess = [[0, 0, 5, 0], [5, 0, 5, -2], [5, -2, 6.5, -2], [6.5, -2, 6.5, 0], [6.5, 0, 12, 0]]
    today = Segments.from_array(np.array([*recess, *OUTLINE[1:], *RACK, *PILLAR], dtype=float))
    found = updated(HALL, *visits(*[today] * 6))
    short = [one for one in found.changes if one.code == "shortened"]
    assert [one.segments for one in short] == [(0,)]
    assert np.abs(short[0].new - [[0, 0, 5, 0], [6.5, 0, 12, 0]]).max() < 0.35
    assert {one.code for one in found.changes} <= {"shortened", "added"}
    assert all(off_walls(one.new, today).max() < 0.25 for one in found.changes)


def test_a_wall_that_has_grown_is_extended() -> None:
    hall, today = (segments(box(3.0, 4.0, x, 4.2), PILLAR) for x in (5.0, 6.5))
    found = updated(hall, *visits(*[today] * 4))
    assert updated(hall, *visits(today, today)).changes == ()  # it may be a door
    longer = {one.segments[0]: one.new[0] for one in found.changes if one.code == "extended"}
    assert set(longer) == {13, 15}
    assert longer[13] == pytest.approx([3.0, 4.2, 6.5, 4.2], abs=0.1)


SHUT, TIP = (segments(RACK, PILLAR, box(*leaf)) for leaf in ((5.5, 7.98, 7.0, 8.02), (6.98, 6.7, 7.02, 7.2)))


@pytest.mark.parametrize(
    ("old", "today", "codes"),
    [
        (HALL, [segments(PILLAR)], set()),
        (HALL, [segments(RACK, PILLAR, CART), HALL, HALL], set()),
        # A door that is open on one visit and shut on another; one that stays shut.
        (HALL, [SHUT, HALL, SHUT, HALL], set()),
        (SHUT, [SHUT, HALL, HALL, SHUT], set()),
        (HALL, [SHUT, SHUT], set()),
        (HALL, [segments(RACK, PILLAR, box(5.6, 7.98, 6.9, 8.02))] * 5, {"extended"}),
        # The tip of an open leaf, which is hinged at (7, 8).
        (HALL, [TIP] * 3, set()),
        (HALL, [TIP] * 5, {"added"}),
    ],
)
def test_what_may_be_a_door_or_is_seen_on_one_visit_is_no_change(
    old: Segments, today: list[Segments], codes: set[str]
) -> None:
    assert {one.code for one in updated(old, *visits(*today)).changes} == codes


def test_a_leaf_off_the_line_of_its_wall_stands_where_it_was_seen() -> None:
    """It is no extension of the wall, whose line the scans then would contradict."""
    shut = segments(RACK, PILLAR, box(5.6, 7.93, 6.9, 7.97))
    (one,) = updated(HALL, *visits(*[shut] * 5)).changes
    assert one.code == "added"
    assert one.new[0] == pytest.approx([6.9, 7.93, 5.6, 7.93], abs=0.1)
    assert np.abs(one.new[0, [1, 3]] - 7.93).max() < 0.01


@pytest.mark.parametrize(
    ("visits", "poses", "enough"), [(1, 9, False), (2, 2, False), (2, 3, True), (3, 1, True), (4, 2, True)]
)
def test_three_visits_are_enough_from_one_place(visits: int, poses: int, enough: bool) -> None:
    assert bool(are_enough(visits, poses)) is enough


def test_people_do_not_become_walls() -> None:
    rng = np.random.default_rng(3)

    def crowded(_number: int) -> Segments:
        people = [box(x, y, x + 0.4, y + 0.4) for x, y in rng.uniform([1, 1], [11, 7], (4, 2))]
        return segments(RACK, PILLAR, *people)

    assert updated(HALL, *(visit(crowded, f"day {k}", k) for k in range(4))).changes == ()


def test_changes_are_applied_in_the_order_of_the_segments() -> None:
    """The first piece of a shortened wall stands where the wall stood; what is new comes last."""
    old = Segments.from_array(np.array([[k, 0.0, k + 1.0, 0.0] for k in range(5)]))
    shorter, new = np.array([[1.0, 0.0, 1.3, 0.0], [1.6, 0.0, 2.0, 0.0]]), np.array([[0.0, 5.0, 1.0, 5.0]])
    shown = Evidence(1, 0, 3, 2, "day 0", "day 1")
    changes = [
        Change("shortened", (1,), shorter, np.full(2, 0.01), shown, 0.99),
        Change("moved", (3,), new, np.full(1, 0.01), shown, 0.99),
    ]
    expected = [old.endpoints[0], shorter[0], old.endpoints[2], old.endpoints[4], shorter[1], new[0]]
    applied, sigma = apply_changes(old, 0.02, changes)
    assert applied.endpoints.tolist() == np.array(expected).tolist()
    assert sigma == 0.02


def test_the_order_of_the_visits_does_not_matter() -> None:
    """Neither to the changes, nor to the scans that are held back; the first visit is named as it was sent."""
    today = segments(RACK, box(9.1, 4.4, 9.7, 5.0), CART)
    days = visits(*[today] * 5)
    found = [updated(HALL, *some) for some in (days, days[::-1], days[2:] + days[:2])]
    assert len(found[0].changes) == 2
    for one in found[1:]:
        assert (one.held_back, one.usable) == (found[0].held_back, found[0].usable)
        for change, same in zip(one.changes, found[0].changes, strict=True):
            assert (change.code, change.segments, change.confidence) == (same.code, same.segments, same.confidence)
            assert change.new.tolist() == same.new.tolist()
    assert [one.changes[0].evidence.first for one in found] == ["day 0", "day 4", "day 2"]
