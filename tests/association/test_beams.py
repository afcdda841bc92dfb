"""Evidence of beams: walls and free space that no segment shows, and points of a map as legs of tables."""

from __future__ import annotations

import numpy as np
import pytest

from association import (
    NO_POINTS,
    AssociationResult,
    MapIndex,
    MapPart,
    MapPoints,
    MapSet,
    Scan,
    Status,
    associate,
    associate_on_maps,
)
from registration import RigidTransform, Segments

from .scenes import (
    CORRIDOR,
    INSIDE,
    ROOM,
    Floats,
    answer_of,
    box,
    equal_rooms,
    index_of,
    known,
    pose,
    ranges,
    same_pose,
    scan_of,
    seen,
    without_beams,
)

# --- What is seen through, and what is not there ----------------------------------------------------------------------


def best_of_two_rooms(walls: Floats, scan: Scan, at: RigidTransform) -> AssociationResult:
    result = answer_of(index_of(walls), scan)
    assert same_pose(result.pose, at)
    assert (known(result.diagnostics).margin or 0.0) > 0.5
    return result


def test_a_wall_that_should_hide_another_counts_against_a_pose() -> None:
    """Two equal rooms, one with a screen across that the scan sees through: it is the other one."""
    rooms = np.vstack([equal_rooms(2), [[16.5, 0.5, 16.5, 3.5]]])
    at = pose(3.0, 2.0, 0.3)
    ends = seen(ROOM, at, noise=0.005, seed=3)[0]
    assert answer_of(index_of(rooms), scan_of(ends)).status is Status.AMBIGUOUS
    best_of_two_rooms(rooms, scan_of(ends, viewpoint=(0.0, 0.0)), at)
    other = answer_of(index_of(rooms[len(ROOM) :]), scan_of(ends, viewpoint=(0.0, 0.0)))
    assert other.missing_map == (len(ROOM),)


def test_beams_show_what_no_segment_does() -> None:
    """One of two equal rooms has an annex."""
    niche = [[0, 0, 9, 0], [9, 0, 9, 1.5], [9, 1.5, 10.5, 1.5], [10.5, 1.5, 10.5, 2.5], [10.5, 2.5, 9, 2.5],
             [9, 2.5, 9, 4]]  # fmt: skip
    walls = np.vstack([ROOM, np.array([*niche, *ROOM[2:]]) + np.tile([20.0, 0.0], 2)])
    at = pose(3.0, 2.0, 0.3)
    ends = seen(ROOM[2:], at)[0]
    assert answer_of(index_of(walls), scan_of(ends, viewpoint=(0.0, 0.0))).status is Status.AMBIGUOUS
    best_of_two_rooms(walls, scan_of(ends, viewpoint=(0.0, 0.0), beams=ranges(ROOM, at, sigma=1e-4).beams), at)


def test_beams_show_where_along_a_corridor() -> None:
    """The segments are those of the two long walls; single beams meet the one end that is closed."""
    walls, at = np.vstack([CORRIDOR, [[0.0, 2.0, 0.0, 0.0]]]), pose(7.0, 0.8, 0.1)
    index, ends = index_of(walls), seen(CORRIDOR, at, cut=0.5, seed=2)[0]
    blind = answer_of(index, scan_of(ends, viewpoint=(0.0, 0.0)))
    beams = ranges(walls, at, sigma=1e-4).beams
    with_beams = answer_of(index, scan_of(ends, viewpoint=(0.0, 0.0), beams=beams))
    assert blind.status is Status.DEGENERATE
    assert not with_beams.usable or same_pose(with_beams.pose, at)
    assert abs(known(blind.pose).x - at.x) > 0.5
    assert same_pose(with_beams.pose, at, 0.1, 0.1)


# --- Points of a map --------------------------------------------------------------------------------------------------

WALLS = Segments.from_array(ROOM)
POST = (2.0, 2.5)
# Legs in the second of two equal rooms, 4 cm thick.
LEGS = np.array([[14.2, 2.0], [14.2, 3.4], [16.5, 1.2], [17.4, 2.9], [13.4, 1.4], [16.0, 5.2]])
SHIFT = np.array([12.0, 0.0])


def furnished(walls: Floats, legs: Floats) -> Floats:
    """Return walls and things of 4 cm."""
    return np.vstack([walls, *(box(x - 0.02, y - 0.02, 0.04, 0.04) for x, y in legs.tolist())])


def with_points(walls: Floats, points: Floats, sigma: float | None = None) -> MapIndex:
    return MapIndex.build(Segments.from_array(walls), points=MapPoints.of(points, sigma))


def test_points_tell_equal_rooms_apart() -> None:
    """Beams read them; without beams the rooms are equal."""
    bare, pointed = index_of(equal_rooms(2)), with_points(equal_rooms(2), LEGS)
    at = pose(INSIDE.x + SHIFT[0], INSIDE.y, INSIDE.theta)
    truth = furnished(equal_rooms(2), LEGS)
    scan = ranges(truth, at, 1, beams=1440)
    assert not answer_of(bare, scan).usable
    found = answer_of(pointed, scan)
    assert same_pose(found.pose, at)
    other = next(one for one in found.alternatives if same_pose(one.pose, INSIDE))
    assert known(found.probability) > 2.0 * (other.probability or 0.0)
    blind = answer_of(pointed, without_beams(scan))
    assert known(blind.diagnostics).margin == pytest.approx(0.0, abs=1e-6)


def test_a_beam_that_passes_a_point_is_no_evidence() -> None:
    """The legs of the map are gone: some centimetres would suffice to miss them."""
    at = pose(INSIDE.x + SHIFT[0], INSIDE.y, INSIDE.theta)
    scan = ranges(equal_rooms(2), at, 1)
    bare, pointed = (answer_of(one, scan) for one in (index_of(equal_rooms(2)), with_points(equal_rooms(2), LEGS)))
    assert (pointed.status, pointed.usable) == (bare.status, bare.usable)
    assert known(pointed.diagnostics).margin == pytest.approx(known(bare.diagnostics).margin, abs=1.0)


def test_points_are_never_a_base_or_a_pair() -> None:
    """A scan of nothing but legs has no pose; correspondences name segments of the map."""
    pointed = with_points(ROOM, LEGS - SHIFT)
    scan = ranges(furnished(ROOM, LEGS - SHIFT), INSIDE, 2, beams=1440)
    result = answer_of(pointed, scan)
    assert result.usable
    assert all(pair.map < len(ROOM) for pair in result.correspondences)
    assert answer_of(pointed, scan_of(np.zeros((0, 4)))).pose is None


def test_without_beams_points_change_nothing() -> None:
    for seed in range(3):
        scan = scan_of(seen(ROOM, INSIDE, noise=0.02, cut=0.4, clutter=2, seed=seed)[0], viewpoint=(0.0, 0.0))
        bare, pointed = (answer_of(index, scan) for index in (index_of(ROOM), with_points(ROOM, LEGS - SHIFT)))
        assert (pointed.status, pointed.usable, pointed.pose) == (bare.status, bare.usable, bare.pose)
        assert pointed.probability == pytest.approx(bare.probability, abs=1e-9)


def test_points_move_with_the_map() -> None:
    """A point stops beams over a width that is not the same in all directions of the map, hence the tolerance."""
    by = RigidTransform(4e4, -2e4, 1.1)
    at = pose(INSIDE.x + SHIFT[0], INSIDE.y, INSIDE.theta)
    scan = ranges(furnished(equal_rooms(2), LEGS), at, 1, beams=1440)
    moved = by.apply(equal_rooms(2).reshape(-1, 2)).reshape(-1, 4)
    one, other = answer_of(with_points(equal_rooms(2), LEGS), scan), answer_of(with_points(moved, by.apply(LEGS)), scan)
    assert (one.status, one.usable) == (other.status, other.usable)
    assert same_pose(by.compose(known(one.pose)), other.pose, 1e-6, 1e-6)
    assert one.probability == pytest.approx(other.probability, abs=0.005)


def test_a_map_without_directions_has_its_points() -> None:
    at = pose(INSIDE.x + SHIFT[0], INSIDE.y, INSIDE.theta)
    scan = ranges(furnished(equal_rooms(2), LEGS), at, 1, beams=1440)
    found = answer_of(with_points(equal_rooms(2), LEGS), scan, oriented=False)
    assert same_pose(found.pose, at)


def test_points_of_several_maps_lie_on_their_own() -> None:
    """Two equal rooms as two maps, and the legs are in the second."""
    legs = LEGS - SHIFT
    maps = MapSet({"bare": MapPart(WALLS, points=NO_POINTS), "legs": MapPart(WALLS, points=MapPoints.of(legs))})
    scan = ranges(furnished(ROOM, legs), INSIDE, 1, beams=1440)
    found = associate_on_maps(maps, scan)
    assert found.map_id == "legs"
    assert same_pose(found.pose, INSIDE)
    alone = associate(with_points(ROOM, legs), scan)
    assert same_pose(found.pose, alone.pose, 1e-6, 1e-6)


def test_points_are_counted_and_those_far_outside_are_left_out() -> None:
    far = MapPoints.of([POST, [90.0, 0.0], [2e5, 0.0], [0.0, -90.0]])
    assert len(far) == 4
    index = MapIndex.build(WALLS, points=far)
    np.testing.assert_array_equal(index.points.positions, [POST])
    assert len(MapIndex.build(WALLS).points) == len(NO_POINTS) == 0
