"""No usable answer where several places of the map fit: equal rooms, one thing that was moved, symmetrical rooms."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest

from association import HardPrior, Scan, SoftPrior, Status
from registration import RigidTransform

from .scenes import (
    ROOM,
    SQUARE,
    Floats,
    answer_of,
    box,
    drawn_room,
    equal_rooms,
    index_of,
    is_wrong,
    known,
    pose,
    ranges,
    reason_codes,
    ring,
    same_pose,
    scan_of,
    seen,
    without_beams,
)

PITCH = 7.0  # m, from room to room of a hotel
SHORT = 6.0  # m; a laser does not see from one end of the corridor to the other


def hotel(rooms: int, *niches: int, wide: float = 0.8, deep: float = 0.1) -> Floats:
    """Return rooms of 5 x 4 m below a corridor; those of `niches` have a niche in the left wall."""
    corners: list[tuple[float, float]] = [(-2.0, 8.0), (-2.0, 6.0)]
    for k in range(rooms):
        x, low, high = PITCH * k, 2.5 - 0.5 * wide, 2.5 + 0.5 * wide
        corners += [(x + 2.0, 6.0), (x + 2.0, 4.0), (x, 4.0)]
        if k in niches:
            corners += [(x, high), (x - deep, high), (x - deep, low), (x, low)]
        corners += [(x, 0.0), (x + 5.0, 0.0), (x + 5.0, 4.0), (x + 3.0, 4.0), (x + 3.0, 6.0)]
    end = rooms * PITCH - 1.0
    return ring([*corners, (end, 6.0), (end, 5.0), (end + 1.5, 5.0), (end + 1.5, 8.0)])


def in_room(room: int) -> Iterator[tuple[int, RigidTransform]]:
    """Yield places in a room of a hotel, from which the corridor is hardly seen."""
    for k in range(12):
        yield k, pose(PITCH * room + 1.5 + 0.15 * (k % 5), 1.0 + 0.5 * (k // 4), 0.7 * k)


def scans_in(walls: Floats, room: int) -> Iterator[tuple[Scan, RigidTransform]]:
    """Yield scans from places in a room of a hotel, as ranges and as segments, with their truths."""
    for k, at in in_room(room):
        scan = ranges(walls, at, k, reach=SHORT, sigma=0.008)
        yield scan, at
        yield without_beams(scan), at


# --- Equal rooms ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("rooms", [2, 5])
def test_equal_rooms_are_not_usable(rooms: int) -> None:
    walls = hotel(rooms)
    index = index_of(walls)
    for scan, _ in scans_in(walls, 1):
        result = answer_of(index, scan, max_alternatives=20)
        assert (result.status, result.usable) == (Status.AMBIGUOUS, False)
        assert "similar_place" in reason_codes(result)
        assert known(result.probability) <= 1.05 / min(rooms, 3)
        assert "about as well" in result.message
        assert not answer_of(index, scan, on_map=1.0).usable, "which does not decide between rooms of the map"


@pytest.mark.parametrize("hard", [True, False])
def test_equal_rooms_are_usable_with_a_prior(hard: bool) -> None:
    walls = hotel(3)
    index, usable = index_of(walls), 0
    for scan, at in scans_in(walls, 1):
        near = pose(at.x + 0.5, at.y - 0.3, at.theta + 0.1)
        prior = HardPrior(near, 1.5, 0.6) if hard else SoftPrior(near, np.diag([0.25, 0.25, 0.04]))
        result = answer_of(index, scan, prior)
        assert not is_wrong(result, at)
        usable += result.usable
    assert usable >= 20


@pytest.mark.parametrize("rooms", [5, 8])
def test_each_equal_room_is_listed(rooms: int) -> None:
    at = pose(3.0 + 12.0, 2.0, 0.3)
    ends = seen(equal_rooms(rooms)[len(ROOM) : 2 * len(ROOM)], at, noise=0.01, seed=1)[0]
    result = answer_of(index_of(equal_rooms(rooms)), scan_of(ends), max_alternatives=20)
    assert result.status is Status.AMBIGUOUS
    poses = [known(result.pose), *(a.pose for a in result.alternatives)]
    for k in range(rooms):
        assert any(same_pose(p, pose(3.0 + 12.0 * k, 2.0, 0.3)) for p in poses), f"room {k}"


def test_rooms_that_differ_in_many_things_are_told_apart() -> None:
    """Three boxes, and a niche, of the second room only."""
    walls, things = hotel(2, 1, wide=1.0, deep=0.5), [box(11.0, 0.4, 0.6, 0.5), box(7.3, 3.3, 0.5, 0.4)]
    walls = np.vstack([walls, *things, box(11.2, 3.2, 0.5, 0.5)])
    index, usable = index_of(walls), 0
    for scan, at in scans_in(walls, 1):
        result = answer_of(index, scan)
        assert not is_wrong(result, at)
        usable += result.usable
    assert usable >= 20


@pytest.mark.xfail(strict=True, reason="12 of 24 are wrong: the true room scores too little to be an alternative")
def test_two_of_many_new_things_do_not_make_another_room_usable() -> None:
    """Six boxes are new in the second room; two of them stand where the map has boxes in the first."""
    like = [box(11.0 - PITCH, 0.4, 0.6, 0.5), box(7.3 - PITCH, 3.3, 0.5, 0.4)]
    new = [box(11.0, 0.4, 0.6, 0.5), box(7.3, 3.3, 0.5, 0.4)]
    new += [box(10.8, 3.2, 0.5, 0.5), box(9.3, 0.3, 0.5, 0.5), box(7.2, 0.4, 0.4, 0.6), box(9.2, 3.4, 0.6, 0.4)]
    index, today = index_of(np.vstack([hotel(2), *like])), np.vstack([hotel(2), *new])
    for scan, at in scans_in(today, 1):
        assert not is_wrong(answer_of(index, scan), at)


# --- One thing that was moved -----------------------------------------------------------------------------------------

CUPBOARDS = box(3.6, 1.8, 1.2, 0.6), box(PITCH + 3.6, 1.8, 1.2, 0.6)  # in the first room, and in that of the robot
WIDE = {"wide": 1.0, "deep": 0.5}


@pytest.mark.parametrize(
    ("on_map", "truth"),
    [
        pytest.param(hotel(2, 1), hotel(2), id="niche closed, which the other room never had"),
        pytest.param(hotel(2, 1, **WIDE), hotel(2), id="deep niche closed"),
        pytest.param(hotel(2, 0), hotel(2, 0, 1), id="niche opened, as the map has it in the other room"),
        pytest.param(hotel(2, 0, **WIDE), hotel(2, 0, 1, **WIDE), id="deep niche opened"),
        pytest.param(np.vstack([hotel(2), CUPBOARDS[1]]), hotel(2), id="cupboard taken away"),
        pytest.param(
            np.vstack([hotel(2), CUPBOARDS[0]]), np.vstack([hotel(2), *CUPBOARDS]), id="new, and the other room has one"
        ),
    ],
)
def test_one_thing_that_changed_does_not_make_the_equal_room_usable(on_map: Floats, truth: Floats) -> None:
    index = index_of(on_map)
    for scan, at in scans_in(truth, 1):
        assert not is_wrong(answer_of(index, scan), at)


def test_one_thing_more_or_less_leaves_other_rooms_usable() -> None:
    """If no other place is similar: a box that the map lacks, and one that is gone."""
    usable = 0
    for k in range(20):
        room, at = drawn_room(np.random.default_rng([4, k]))
        thing = box(at.x + 1.2, at.y + 0.8, 0.4, 0.4)
        walls, truth = (room, np.vstack([room, thing])) if k % 2 else (np.vstack([room, thing]), room)
        result = answer_of(index_of(walls), ranges(truth, at, k))
        assert not is_wrong(result, at)
        usable += result.usable
    assert usable >= 17


# --- Rooms that look like themselves ----------------------------------------------------------------------------------


def test_a_square_room_has_four_answers() -> None:
    result = answer_of(index_of(SQUARE), scan_of(seen(SQUARE, pose(2.0, 1.5, 0.4))[0]))
    assert (result.status, result.usable, len(result.alternatives)) == (Status.AMBIGUOUS, False, 3)
    assert known(result.probability) == pytest.approx(0.25, abs=0.05)
    assert known(result.diagnostics).margin == pytest.approx(0.0, abs=1e-6)
    assert known(result.diagnostics).runner_up == pytest.approx(1.0)
    assert result.message.startswith("3 other poses fit the scan about as well.")


@pytest.mark.parametrize("sent", ["ranges", "segments"])
def test_a_rectangular_room_may_be_turned_by_half(sent: str) -> None:
    """Without a prior it is never usable, and lists the other way round; a prior of the heading decides."""
    room = ring([(0, 0), (8, 0), (8, 5), (0, 5)])
    index, turn = index_of(room), pose(8.0, 5.0, math.pi)
    for k in range(10):
        at = pose(1.5 + 0.3 * k, 1.2 + 0.2 * k, 0.6 * k)
        scan = ranges(room, at, k)
        scan = scan if sent == "ranges" else without_beams(scan)
        result = answer_of(index, scan)
        assert (result.status, result.usable) == (Status.AMBIGUOUS, False)
        found = [known(result.pose), *(other.pose for other in result.alternatives)]
        assert any(same_pose(one, at) for one in found)
        assert any(same_pose(one, turn.compose(at)) for one in found)
        with_prior = answer_of(index, scan, HardPrior(at, 1.0, 0.8))
        assert with_prior.usable
        assert same_pose(with_prior.pose, at)


def test_a_niche_that_was_closed_does_not_turn_a_rectangular_room_round() -> None:
    """The map has a niche in two opposite walls, and in truth one of them is closed: each way round lacks one."""
    lower = [(0, 0), (2, 0), (2, -0.1), (2.8, -0.1), (2.8, 0), (8, 0), (8, 5)]
    upper = [(6, 5), (6, 5.1), (5.2, 5.1), (5.2, 5)]
    index, truth = index_of(ring([*lower, *upper, (0, 5)])), ring([*lower, (0, 5)])
    for k in range(12):
        at = pose(2.0 + 0.3 * k, 1.5 + 0.15 * k, 0.6 * k)
        assert not answer_of(index, ranges(truth, at, k)).usable
