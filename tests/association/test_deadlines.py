"""Deadlines and cancellation: the best so far, never claimed to be complete. By looks, and not by elapsed time."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
import pytest

from association import (
    AssociationOptions,
    AssociationResult,
    CancelledError,
    Deadline,
    IndexingEndedError,
    MapIndex,
    MapPart,
    MapSet,
    Scan,
    View,
    assemble,
    associate,
    associate_on_maps,
)
from registration import Segments

from .scenes import (
    INSIDE,
    ROOM,
    Floats,
    allocates_less_than,
    answer_of,
    as_json,
    equal_rooms,
    index_of,
    maze,
    pose,
    ranges,
    reason_codes,
    scan_of,
    seen,
    warning_codes,
)

BUILDING = index_of(equal_rooms(6))
MANY = 10**9
PASSED = 0.0  # of `time.monotonic`
SEGMENTS = scan_of(seen(equal_rooms(6), INSIDE, noise=0.01, cut=0.4, clutter=3)[0])


class Looks(Deadline):
    """A deadline that passes at a look, whatever the time; it counts the looks after that."""

    def __init__(self, left: int) -> None:
        super().__init__()
        self.left = left

    @property
    def passed(self) -> bool:
        self.left -= 1
        return self.left < 0


class CancelledAtALook(Looks):
    """A deadline that is cancelled at a look."""

    @property
    def passed(self) -> bool:
        self.left -= 1
        if self.left == -1:
            self.cancel()
        return self.left < 0


def answered(scan: Scan, deadline: Deadline, *, exhaustive: bool = False) -> AssociationResult:
    return associate(BUILDING, scan, None, AssociationOptions(max_alternatives=20, exhaustive=exhaustive), deadline)


def assert_incomplete(result: AssociationResult) -> None:
    assert (result.usable, result.search.complete, result.search.exhaustive) == (False, False, False)
    assert result.search.complete_above == 1.0
    assert reason_codes(result)[0] == "search_incomplete" or reason_codes(result)[:2][-1] == "search_incomplete"
    assert "search_incomplete" in warning_codes(result)


def test_a_deadline_that_is_far_off_changes_nothing() -> None:
    late = answer_of(BUILDING, SEGMENTS, deadline=Deadline(time.monotonic() + 1e6))
    assert as_json(late) == as_json(answer_of(BUILDING, SEGMENTS))


@pytest.mark.parametrize("kind", ["segments", "lines of sight", "ranges", "exhaustive"])
def test_whenever_the_deadline_passes_a_complete_answer_is_that_without_one(kind: str) -> None:
    """While poses are searched, while they are compared, and after that."""
    scan = SEGMENTS
    if kind == "lines of sight":
        scan = Scan(SEGMENTS.measured, (0.0, 0.0))
    if kind == "ranges":
        scan = ranges(equal_rooms(6), INSIDE, 1)
    exhaustive = kind == "exhaustive"
    counted = Looks(MANY)
    whole = answered(scan, counted, exhaustive=exhaustive)
    looks = MANY - counted.left
    assert whole.search.complete
    assert looks > 3
    kinds = set()
    for left in sorted({*range(4), *np.linspace(0, looks + 1, 24).astype(int).tolist()}):
        deadline = Looks(left)
        one = answered(scan, deadline, exhaustive=exhaustive)
        kinds.add(one.search.complete)
        if one.search.complete:
            assert as_json(one) == as_json(whole)
        else:
            assert_incomplete(one)
            assert one.search.bases <= whole.search.bases
            assert deadline.left > -60, "soon after it has passed there is nothing more to do"
    assert kinds == {True, False}


def test_a_cancelled_search_raises() -> None:
    """Before it starts, and soon after that."""
    for left in (0, 1):
        with pytest.raises(CancelledError):
            answered(SEGMENTS, CancelledAtALook(left))
    deadline = Deadline()
    deadline.cancel()
    assert deadline.passed
    with pytest.raises(CancelledError):
        answered(SEGMENTS, deadline)


def long_search() -> tuple[MapIndex, Scan]:
    """Return a map and a scan whose exhaustive search takes minutes: crossing walls of kilometres, and 400 bases."""
    along, far, none = np.linspace(0.0, 9000.0, 300), np.full(300, 9999.0), np.zeros(300)
    index = index_of(np.vstack([np.stack([none, along, far, along], 1), np.stack([along, none, along, far], 1)]))
    at, length, begin = 1.3 * np.arange(20), 3.0 + 0.1 * np.arange(20), np.zeros(20)
    return index, scan_of(np.vstack([np.stack([begin, at, length, at], 1), np.stack([at, begin, at, length], 1)]))


def test_a_long_search_ends_soon_after_it_is_cancelled() -> None:
    index, scan = long_search()
    deadline = CancelledAtALook(20)
    with pytest.raises(CancelledError):
        associate(index, scan, None, AssociationOptions(exhaustive=True), deadline)
    assert deadline.left > -60


def test_several_maps_have_one_deadline() -> None:
    maps = MapSet({"a": MapPart(Segments.from_array(ROOM)), "b": MapPart(Segments.from_array(maze(1)))})
    found = associate_on_maps(maps, scan_of(seen(ROOM, INSIDE)[0]), deadline=Deadline(PASSED))
    assert_incomplete(found)
    assert {one.map_id for one in found.maps} == {"a", "b"}


def test_indexing_ends_at_its_deadline() -> None:
    walls = Segments.from_array(maze(2, 3000, 300.0))
    with pytest.raises(IndexingEndedError):
        MapIndex.build(walls, deadline=Deadline(PASSED))
    with pytest.raises(IndexingEndedError):
        MapSet({"a": MapPart(walls)}, Deadline(PASSED))


# --- Work that does not grow with what is sent again ------------------------------------------------------------------

PIECES, SEEN, HEAPED = 10_000, 600, 400
HALL = np.array([[0.0, 0.0, 8.0, 0.0], [8.0, 0.0, 8.0, 6.0], [8.0, 6.0, 0.0, 6.0], [0.0, 6.0, 0.0, 0.0]])


def repeated(rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Return one wall again and again, and a scan that is nothing else."""
    wall = np.array([[10.0, 20.0, 14.0, 23.0]])
    return np.tile(wall, (PIECES, 1)) + rng.normal(0.0, 1e-9, (PIECES, 4)), np.tile([[0.0, 0.0, 5.0, 0.0]], (SEEN, 1))


def cut_up(rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Return a room of which the walls are pieces that overlap one another, and a scan of its four walls."""
    walls, cuts = np.tile(HALL, (PIECES // 4, 1)), np.sort(rng.uniform(size=(PIECES, 2)), axis=1)
    along = walls[:, 2:] - walls[:, :2]
    return np.hstack([walls[:, :2] + cuts[:, :1] * along, walls[:, :2] + cuts[:, 1:] * along]), HALL - 2.0


def heap(rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Return walls of all directions in one place, and a scan of the like."""
    middles, angles = rng.uniform(0.0, 2.0, (HEAPED, 2)), rng.uniform(-np.pi, np.pi, HEAPED)
    half = 0.3 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    walls = np.hstack([middles - half, middles + half])
    return walls, walls[:40] - 1.0


@pytest.mark.parametrize("drawn", [repeated, cut_up])
def test_pieces_of_few_walls_take_few_hypotheses(drawn: Callable[[np.random.Generator], tuple[Floats, Floats]]) -> None:
    """However many they are."""
    walls, ends = drawn(np.random.default_rng(0))
    result = answer_of(index_of(walls), scan_of(ends, viewpoint=(1.0, 1.0)))
    assert result.search.complete
    assert result.search.hypotheses < 5000
    assert not result.usable


def test_a_heap_of_walls_ends_soon_after_its_deadline() -> None:
    """By looks: whatever stage it is in."""
    walls, ends = heap(np.random.default_rng(0))
    index = index_of(walls)
    for left in (0, 2, 10, 40):
        deadline = Looks(left)
        result = answer_of(index, scan_of(ends, viewpoint=(0.0, 0.0)), deadline=deadline)
        assert result.search.complete or deadline.left > -60
        if left == 0:
            assert_incomplete(result)


def test_uncertain_views_of_a_building_that_repeats_itself_end_soon_after_their_deadline() -> None:
    """The pose of each alternative is solved with those of all views."""
    index = index_of(equal_rooms(30))
    here = scan_of(seen(ROOM, INSIDE)[0], viewpoint=(0.0, 0.0))
    spread = 1e-4 * np.eye(3)
    scan = assemble([View(here, pose(), spread if k else None) for k in range(24)])
    for left in (1, 20, 60):
        deadline = Looks(left)
        result = answer_of(index, scan, deadline=deadline, max_alternatives=50)
        assert not result.usable
        assert result.search.complete or deadline.left > -80


def test_an_answer_takes_little_memory() -> None:
    """Of 3,000 walls and 200 segments of a scan, beyond the index: arrays of one answer, traced byte by byte."""
    walls = maze(2, 3000, 220.0)
    index = index_of(walls)
    ends = seen(walls, pose(110.0, 110.0, 0.3), noise=0.01, radius=35.0)[0]
    scan = scan_of(ends, viewpoint=(0.0, 0.0))
    first = answer_of(index, scan)
    assert len(ends) > 150
    with allocates_less_than(48e6):
        assert as_json(answer_of(index, scan)) == as_json(first)
