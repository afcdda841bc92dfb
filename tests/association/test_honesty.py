"""No usable answer where a scan does not decide: corridors, few walls, other buildings, mirrored scans."""

from __future__ import annotations

import math

import numpy as np
import pytest

from association import Scan, Status, mirrored, scaled, turned_round
from registration import RigidTransform

from .scenes import (
    LOBBY,
    ROOM,
    Floats,
    answer_of,
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
