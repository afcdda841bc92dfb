"""Evidence next to segments: free space and walls that beams show, points of a map, and priors."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from association import (
    NO_POINTS,
    AssociationResult,
    HardPrior,
    MapIndex,
    MapPart,
    MapPoints,
    MapSet,
    Scan,
    SoftPrior,
    Status,
    associate,
    associate_on_maps,
)
from registration import RigidTransform, Segments

from .scenes import (
    CORRIDOR,
    INSIDE,
    LOBBY,
    ROOM,
    SQUARE,
    Floats,
    answer_of,
    box,
    equal_rooms,
    index_of,
    known,
    maze,
    pose,
    ranges,
    reason_codes,
    same_pose,
    scan_of,
    seen,
    warning_codes,
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
    undirected = answer_of(pointed, scan, oriented=False)
    assert same_pose(undirected.pose, at)
    assert known(undirected.diagnostics).margin != pytest.approx(0.0, abs=1.0)
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


ROOM_INDEX = index_of(ROOM)
MAZE_INDEX = index_of(maze(1))


def test_a_covariance_may_have_unlike_deviations() -> None:
    scale = np.array([1e-5, 1e5, 1e-2])
    correlated = np.array([[1.0, 0.9, 0.0], [0.9, 1.0, 0.0], [0.0, 0.0, 1.0]])
    assert SoftPrior(pose(), correlated * np.outer(scale, scale)).covariance[0, 0] == pytest.approx(1e-10)


@pytest.mark.parametrize(
    ("at", "inside"),
    [
        (pose(1.0, 2.0, 3.1), True),
        (pose(1.29, 2.39, 3.1), True),
        (pose(1.31, 2.41, 3.1), False),
        (pose(1.0, 2.0, -3.1), True),
        (pose(1.0, 2.0, -2.9), False),
        (pose(1.0, 2.0, 2.9), True),
        (pose(1.0, 2.0, 2.8), False),
    ],
)
def test_a_window_contains_what_is_near_in_place_and_angle(at: Any, inside: bool) -> None:
    assert HardPrior(pose(1.0, 2.0, 3.1), 0.5, 0.25).contains(at) is inside


@pytest.mark.parametrize(
    "prior", [SoftPrior(pose(2.2, 2.0, 0.0), np.diag([0.25, 0.25, 0.05])), HardPrior(pose(2.2, 2.0, 0.0), 0.5, 0.3)]
)
def test_a_prior_decides_between_the_four_ways_round_of_a_square(prior: SoftPrior | HardPrior) -> None:
    index, at = index_of(SQUARE), pose(2.0, 2.2, 0.1)
    scan = scan_of(seen(SQUARE, at)[0])
    assert answer_of(index, scan).status is Status.AMBIGUOUS
    result = answer_of(index, scan, prior)
    assert (result.status, result.usable) == (Status.OK, True)
    assert same_pose(result.pose, at, 1e-9, 1e-9), "a prior is never fused into the pose"


def test_a_prior_changes_neither_pose_nor_covariance() -> None:
    scan = ranges(ROOM, INSIDE, 1)
    plain = answer_of(ROOM_INDEX, scan)
    sharp = SoftPrior(pose(INSIDE.x + 0.02, INSIDE.y, INSIDE.theta), np.diag([1e-4, 1e-4, 1e-5]))
    for prior in (sharp, HardPrior(pose(2.7, 2.7, 0.6), 1.0, 0.4)):
        result = answer_of(ROOM_INDEX, scan, prior)
        assert same_pose(result.pose, plain.pose, 1e-9, 1e-9)
        np.testing.assert_allclose(known(result.covariance), known(plain.covariance), rtol=1e-6)


def test_a_prior_is_weighed_against_the_scan() -> None:
    """Of two rooms one lacks a wall; a prior that is sharp enough makes the answer the other."""
    index = index_of(equal_rooms(2)[:-1])
    scan = scan_of(seen(ROOM, INSIDE, noise=0.02, seed=1)[0])
    there = pose(INSIDE.x + 12.0, INSIDE.y, INSIDE.theta)
    wide, sharp = (SoftPrior(there, np.diag([s**2, s**2, 1.0])) for s in (8.0, 1.0))
    assert same_pose(answer_of(index, scan, wide).pose, INSIDE)
    assert same_pose(answer_of(index, scan, sharp).pose, there)


@pytest.mark.parametrize("hard", [True, False])
@pytest.mark.parametrize("wrong", [pose(7.0, 1.0, -2.0), pose(5.0, 2.5, 0.7)])
def test_a_contradicted_prior_has_a_warning_and_is_never_usable(hard: bool, wrong: RigidTransform) -> None:
    """A soft one does not make the place ambiguous."""
    prior = HardPrior(wrong, 0.5, 0.5) if hard else SoftPrior(wrong, np.diag([0.01, 0.01, 0.01]))
    for on_map in (0.9, 1.0):
        result = answer_of(ROOM_INDEX, scan_of(seen(ROOM, INSIDE)[0]), prior, on_map=on_map, usable_from=0.5)
        assert not result.usable
        assert known(result.probability) <= 0.5
        assert warning_codes(result) == ["prior_contradicted"]
        assert reason_codes(result)[0] == "prior_contradicted"
        assert hard or same_pose(result.pose, INSIDE, 1e-9, 1e-9)


def test_a_window_that_does_not_hold_the_truth_is_contradicted() -> None:
    """A pose that slides along a corridor inside of the window does not stand for the better one 8 m away."""
    walls = np.array([[0, 0, 30, 0], [30, 0, 30, 2], [30, 2, 14, 2], [14, 2, 14, 5], [12, 5, 12, 2], [12, 2, 0, 2]])
    at = pose(13.0, 1.0, 0.1)
    scan = scan_of(seen(walls, at, noise=0.01, radius=9.0, seed=1)[0])
    assert same_pose(answer_of(index_of(walls), scan).pose, at)
    result = answer_of(index_of(walls), scan, HardPrior(pose(21.0, 1.0, 0.1), 2.0, 0.3))
    assert not result.usable
    assert "prior_contradicted" in reason_codes(result)


def test_nothing_within_a_window_is_no_match() -> None:
    """The poses outside of it are alternatives."""
    result = answer_of(ROOM_INDEX, scan_of(seen(ROOM, INSIDE)[0]), HardPrior(pose(-30.0, 0.0), 0.5, 0.3))
    assert (result.status, result.pose, result.usable) == (Status.NO_MATCH, None, False)
    assert any(same_pose(one.pose, INSIDE) for one in result.alternatives)
    assert result.unmatched_scan == tuple(range(8))


def test_a_usable_answer_lies_within_its_window() -> None:
    """A pose may leave a window that is narrower than the noise: it is returned, and not usable."""
    usable = outside = 0
    for seed in range(40):
        prior = HardPrior(pose(3.01, 2.49, 0.7), 0.02, 0.004)
        result = answer_of(ROOM_INDEX, scan_of(seen(ROOM, INSIDE, noise=0.03, seed=seed)[0]), prior)
        if result.pose is not None and not prior.contains(result.pose):
            assert not result.usable
            assert "prior_contradicted" in warning_codes(result)
            outside += 1
        usable += result.usable
    assert usable > 0
    assert outside > 0


def test_of_a_family_of_poses_the_one_nearest_the_prior_is_returned() -> None:
    """Without a prior it is the one that centres what is seen on the map."""
    scan = scan_of(seen(CORRIDOR, pose(15.0, 0.8, 0.0))[0])
    result = answer_of(index_of(CORRIDOR), scan, SoftPrior(pose(11.0, 1.0, 0.0), np.eye(3)))
    assert result.status is Status.DEGENERATE
    assert (known(result.pose).x, known(result.pose).y) == pytest.approx((11.0, 0.8), abs=1e-6)
    assert result.message.startswith("The position along the direction")
    assert known(answer_of(index_of(CORRIDOR), scan).pose).x == pytest.approx(15.0, abs=1e-6)


def test_a_small_window_makes_the_search_short() -> None:
    """Walls are tried at places within it, not all along at steps of its size."""
    at = pose(16.4, 12.7, -2.9)
    ends = seen(maze(1), at, noise=0.01, cut=0.2, seed=0, radius=8.0)[0]
    for radius in (1.0, 1e-4):
        result = answer_of(MAZE_INDEX, scan_of(ends), HardPrior(at, radius, 0.1))
        assert result.search.hypotheses < 1000


def test_a_prior_does_not_make_too_few_walls_usable() -> None:
    """Two walls at right angles, with a prior that holds all of the map."""
    index = index_of(LOBBY)
    corner = scan_of([[-3.0, -1.0, 4.5, -1.0], [4.5, -1.0, 4.5, 1.5]], viewpoint=(0.0, 0.0))
    found = answer_of(index, corner, HardPrior(pose(3.5, 1.0), 20.0, 3.2))
    assert not found.usable
