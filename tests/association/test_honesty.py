"""No usable answer where a scan does not decide: corridors, few walls, other buildings, equal and symmetrical rooms."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest

from association import HardPrior, Scan, SoftPrior, Status, mirrored, scaled, turned_round
from registration import RigidTransform

from .scenes import (
    LOBBY,
    ROOM,
    SQUARE,
    Floats,
    answer_of,
    box,
    carried,
    cast,
    drawn_room,
    index_of,
    is_wrong,
    known,
    maze,
    pose,
    ranges,
    reason_codes,
    ring,
    same_pose,
    scan_of,
    seen,
    without_beams,
)

# --- Corridors --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("heading", np.linspace(-math.pi, math.pi, 7).tolist())
def test_a_long_corridor_is_degenerate_along_itself(heading: float) -> None:
    """Whatever its direction on the map: the ends are out of reach."""
    by = RigidTransform(100.0, -40.0, heading)
    walls = carried(ring([(0, 0), (60, 0), (60, 2.2), (0, 2.2)]), by)
    for k in range(3):
        at = by.compose(pose(27.0 + 2.0 * k, 0.9, 0.3 * k))
        for scan in (ranges(walls, at, k, reach=8.0), without_beams(ranges(walls, at, k, reach=8.0))):
            result = answer_of(index_of(walls), scan)
            assert (result.status, result.usable) == (Status.DEGENERATE, False)
            assert (result.covariance, result.probability) == (None, None)
            along = np.array([math.cos(heading), math.sin(heading)])
            assert abs(along @ known(result.unobservable)) == pytest.approx(1.0, abs=1e-3)
            assert reason_codes(result)[0] == "unobservable_direction"
            assert result.message.startswith("The position along the direction")
            across = by.inverse().compose(known(result.pose)).y
            assert min(abs(across - 0.9), abs(across - 1.3)) < 0.03


def test_parallel_walls_at_distances_of_their_own() -> None:
    """The gaps decide which of five parallel walls are seen; the position along them is unobservable."""
    heights = [0.0, 2.0, 5.0, 9.0, 14.0]
    walls = np.array([[0.0, y, 30.0, y] if k % 2 == 0 else [30.0, y, 0.0, y] for k, y in enumerate(heights)])
    result = answer_of(index_of(walls), scan_of(seen(walls[1:4], pose(15.0, 7.0, 0.2), cut=0.3, seed=4)[0]))
    assert result.status is Status.DEGENERATE
    assert np.abs(known(result.unobservable)) == pytest.approx([1.0, 0.0], abs=1e-3)
    assert (known(result.pose).y, known(result.pose).theta) == pytest.approx((7.0, 0.2), abs=0.01)
    assert {c.map for c in result.correspondences} == {1, 2, 3}


def test_a_single_segment_is_degenerate() -> None:
    result = answer_of(index_of(ROOM), scan_of(seen(ROOM[:1], pose(3.0, 2.0, 0.2))[0]))
    assert (result.status, result.usable, result.probability) == (Status.DEGENERATE, False, None)


@pytest.mark.parametrize("sigma", [0.0, 0.03, None])
@pytest.mark.parametrize("degrees", [0.5, 1.0, 2.0])
def test_two_walls_that_are_nearly_parallel_fix_nothing_along_them(degrees: float, sigma: float | None) -> None:
    """Centimetres stated along them would be metres."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    walls = np.array([[0.0, 0.0, 30.0, 0.0], [20.0, 4.0, 20.0 - 15.0 * c, 4.0 - 15.0 * s]])
    scan = scan_of([[-6.0, -2.0, 6.0, -2.0], [6.0, 2.0, 6.0 - 12.0 * c, 2.0 - 12.0 * s]], 0.01)
    result = answer_of(index_of(walls, sigma), scan)
    assert (result.usable, result.covariance) == (False, None)
    assert result.status in (Status.DEGENERATE, Status.NO_MATCH)


@pytest.mark.parametrize("seed", range(20))
def test_no_usable_answer_states_a_deviation_beyond_half_a_metre(seed: int) -> None:
    """Of long walls that are nearly parallel, a short one across, far off or near, and a map of any quality."""
    rng = np.random.default_rng(seed)
    turn, across = rng.uniform(0.0, 0.15), rng.uniform(0.1, 1.0)
    far = [28.0, 4.0, 28.0 - 26.0 * math.cos(turn), 4.0 - 26.0 * math.sin(turn)]
    walls = np.array([[0.0, 0.0, 30.0, 0.0], far, [20.0, 1.0, 20.0, 1.0 + across], [8.0, 2.0 + across, 8.0, 2.0]])
    at = pose(rng.uniform(6.0, 18.0), 1.5, rng.uniform(-3.0, 3.0))
    ends = seen(walls, at, noise=0.01, seed=seed)[0][: int(rng.integers(2, 5))]
    result = answer_of(index_of(walls, (None, 0.0, 0.1, 0.3)[int(rng.integers(4))]), scan_of(ends))
    if result.usable:
        assert math.sqrt(np.linalg.eigvalsh(known(result.covariance)[:2, :2]).max()) <= 0.5


@pytest.mark.parametrize("sigma", [0.0, 0.05, 0.2])
def test_a_map_that_is_far_off_is_not_degenerate_where_the_pose_is_fixed(sigma: float) -> None:
    """Twelve walls hold it however far each is off; what the walls show of their angles is as good as before."""
    at = pose(15.0, 14.0, 0.5)
    result = answer_of(index_of(maze(1), sigma), scan_of(seen(maze(1), at, noise=0.02, cut=0.3, seed=1, radius=9.0)[0]))
    assert len(result.correspondences) >= 12
    assert result.status is not Status.DEGENERATE
    assert same_pose(result.pose, at)


@pytest.mark.parametrize("theta", np.linspace(-math.pi, math.pi, 5).tolist())
def test_two_perpendicular_walls_fix_the_pose_but_not_which_corner(theta: float) -> None:
    at = pose(6.0, 2.0, theta)
    result = answer_of(index_of(ROOM), scan_of(seen(ROOM[:2], at)[0]))
    poses = [known(result.pose), *(a.pose for a in result.alternatives)]
    assert any(same_pose(p, at) for p in poses)
    assert not is_wrong(result, at)


# --- Places that are not on the map -----------------------------------------------------------------------------------


def out_of_map(k: int) -> tuple[Floats, Scan]:
    """Return the map of one drawn room, and the scan of another."""
    room, _ = drawn_room(np.random.default_rng([1, k]))
    other, at = drawn_room(np.random.default_rng([2, k]))
    return room, ranges(other, at, k)


def test_another_building_is_not_usable() -> None:
    """Of 80 scans, each with its reason. A fleet that cannot leave excludes them; walls that do not fit still count."""
    usable = for_a_fleet = 0
    for walls, scan in map(out_of_map, range(40)):
        index = index_of(walls)
        for sent in (scan, without_beams(scan)):
            result = answer_of(index, sent)
            usable += result.usable
            assert result.usable or result.reasons
        for_a_fleet += answer_of(index, scan, on_map=1.0).usable
    assert usable == 0
    assert for_a_fleet <= 2


@pytest.mark.parametrize("seed", range(6))
def test_the_scan_of_another_maze_is_not_usable(seed: int) -> None:
    ends = seen(maze(seed + 20), pose(15.0, 15.0, 0.3), noise=0.02, cut=0.4, seed=seed, radius=10.0)[0]
    result = answer_of(index_of(maze(1)), scan_of(ends))
    assert not result.usable
    assert result.reasons


def test_a_mirrored_scan_is_not_usable() -> None:
    """In its own map."""
    usable = 0
    for k in range(30):
        room, at = drawn_room(np.random.default_rng([6, k]))
        scan = ranges(room, at, k)
        for sent in (mirrored(scan), mirrored(without_beams(scan))):
            result = answer_of(index_of(room), sent)
            assert not is_wrong(result, at)
            usable += result.usable
    assert usable == 0


def test_a_room_that_is_its_own_mirror_image_may_be_usable_with_a_mirrored_scan() -> None:
    """It is the scan of the mirrored place: what the verdict has to allow for."""
    room = ring([(0, 0), (8, 0), (8, 5), (5, 5), (5, 6), (3, 6), (3, 5), (0, 5)])
    at, image = pose(2.5, 2.0, 0.4), pose(5.5, 2.0, math.pi - 0.4)
    result = answer_of(index_of(room), mirrored(ranges(room, at, 1)))
    assert same_pose(result.pose, image, 0.05, 0.01)


@pytest.mark.parametrize("sigma", [0.0, 0.03, None])
def test_corners_of_other_buildings_are_not_usable(sigma: float | None) -> None:
    """Two walls at right angles, however long: every building has such a corner."""
    index, rng = index_of(LOBBY, sigma), np.random.default_rng(0)
    for left, right, down, up in rng.uniform(1.0, 4.5, (30, 4)):
        ends = [[-left, -down, right, -down], [right, -down, right, up]]
        result = answer_of(index, scan_of(ends, viewpoint=(0.0, 0.0)))
        assert result.status is not Status.OK


@pytest.mark.parametrize("with_beams", [False, True])
@pytest.mark.parametrize("sigma", [0.0, 0.03, None])
def test_three_sides_of_rooms_of_other_buildings_are_not_usable(sigma: float | None, with_beams: bool) -> None:
    """The third side may lie anywhere along; those of the width of a room of the map are few."""
    index, rng = index_of(LOBBY, sigma), np.random.default_rng(0)
    angles = np.linspace(-math.pi, math.pi, 240, endpoint=False)
    usable = 0
    for left, right, down, up in rng.uniform(1.0, 4.0, (30, 4)):
        ends = np.array([[-left, up, -left, -down], [-left, -down, right, -down], [right, -down, right, up]])
        beams = None
        if with_beams:
            found = ranges(ends, pose()).beams
            beams = type(known(found))(angles, cast(ends, np.zeros(2), angles), 20.0)
        usable += answer_of(index, scan_of(ends, viewpoint=(0.0, 0.0), beams=beams)).usable
    assert usable == 0


def test_a_scan_in_another_unit_is_not_usable() -> None:
    """Feet, and centimetres."""
    for factor in (0.3048, 3.281, 100.0, 0.01):
        for k in range(6):
            room, at = drawn_room(np.random.default_rng([15, k]))
            assert not answer_of(index_of(room), scaled(ranges(room, at, k), factor)).usable


def test_a_scan_whose_segments_are_reversed_is_not_usable() -> None:
    for k in range(10):
        room, at = drawn_room(np.random.default_rng([16, k]))
        assert not answer_of(index_of(room), turned_round(ranges(room, at, k))).usable


def test_an_empty_scan_matches_nothing() -> None:
    result = answer_of(index_of(ROOM), scan_of(np.zeros((0, 4))))
    assert (result.status, result.pose, result.diagnostics) == (Status.NO_MATCH, None, None)
    assert (result.usable, result.probability) == (False, 0.0)
    assert result.search.complete


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


@pytest.mark.xfail(strict=True, reason="all are wrong: the true room scores too little to be an alternative")
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
        assert result.message.startswith("1 other pose fits the scan about as well. The scan alone does not decide")
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
