"""The verdict is honest: twins, slides, other buildings and nothing at all."""

import itertools
import math

import numpy as np
import pytest
from association.scan_rows import gates, scan_rows

from association import AssociationOptions, MapIndex, SoftPrior, Status, associate
from association.ranking import Ranked
from association.significance import significance
from association.verdict import Evidence, judge
from registration import MeasuredSegments, Segments, register

from .scenes import CORRIDOR, ROOM, SQUARE, maze, pose, same_pose, scan_of, seen


def index_of(endpoints):
    return MapIndex.build(Segments.from_array(endpoints))


def test_a_square_room_has_four_answers():
    result = associate(index_of(SQUARE), scan_of(seen(SQUARE, pose(2.0, 1.5, 0.4))[0]))
    assert result.status is Status.AMBIGUOUS
    assert not result.usable
    assert len(result.alternatives) == 3
    assert result.probability == pytest.approx(0.25, abs=0.05)
    assert result.diagnostics.margin == pytest.approx(0.0, abs=1e-6)
    assert result.diagnostics.runner_up == pytest.approx(1.0)


@pytest.mark.parametrize("rooms", [2, 5, 8])
def test_equal_rooms(rooms):
    walls = np.vstack([ROOM + np.tile([12.0 * k, 0.0], 2) for k in range(rooms)])
    at = pose(3.0 + 12.0, 2.0, 0.3)
    endpoints, _ = seen(walls[len(ROOM) : 2 * len(ROOM)], at, noise=0.01, seed=1)
    result = associate(index_of(walls), scan_of(endpoints), options=AssociationOptions(max_alternatives=20))
    assert result.status is Status.AMBIGUOUS
    poses = [result.pose, *(a.pose for a in result.alternatives)]
    for k in range(rooms):
        assert any(same_pose(p, pose(3.0 + 12.0 * k, 2.0, 0.3)) for p in poses), f"room {k}"


def test_a_corridor_is_fixed_across_and_free_along():
    endpoints, _ = seen(CORRIDOR, pose(4.0, 0.8, 0.05), cut=0.5, seed=2)
    result = associate(index_of(CORRIDOR), scan_of(endpoints))
    assert result.status is Status.DEGENERATE
    assert result.covariance is None
    assert np.abs(result.unobservable) == pytest.approx([1.0, 0.0], abs=1e-3)
    assert result.pose.y == pytest.approx(0.8, abs=0.01) or result.pose.y == pytest.approx(1.2, abs=0.01)


def test_of_a_family_of_poses_the_one_nearest_the_prior():
    endpoints, _ = seen(CORRIDOR, pose(15.0, 0.8, 0.0))
    near = SoftPrior(pose(11.0, 1.0, 0.0), np.eye(3))
    result = associate(index_of(CORRIDOR), scan_of(endpoints), near)
    assert result.status is Status.DEGENERATE
    assert (result.pose.x, result.pose.y) == pytest.approx((11.0, 0.8), abs=1e-6)
    centred = associate(index_of(CORRIDOR), scan_of(endpoints))
    assert centred.pose.x == pytest.approx(15.0, abs=1e-6)


def test_a_single_segment_is_degenerate():
    result = associate(index_of(ROOM), scan_of(seen(ROOM[:1], pose(3.0, 2.0, 0.2))[0]))
    assert result.status is Status.DEGENERATE
    assert not result.usable


def test_an_empty_scan_matches_nothing():
    result = associate(index_of(ROOM), scan_of(np.zeros((0, 4))))
    assert result.status is Status.NO_MATCH
    assert result.pose is None
    assert result.diagnostics is None
    assert result.search.complete


@pytest.mark.parametrize("seed", range(6))
def test_the_scan_of_another_building_is_never_usable(seed):
    endpoints, _ = seen(maze(seed + 20), pose(15.0, 15.0, 0.3), noise=0.02, cut=0.4, seed=seed, radius=10.0)
    result = associate(index_of(maze(1)), scan_of(endpoints))
    assert not result.usable
    assert result.probability < 0.5


def judged(*, matched=2, share=0.4, lead=60.0, chance=1e-6):
    """What a laser scan of 8 segments comes to of which some lie on the map."""
    matches = np.full((8, 5), -1.0)
    matches[:matched, 0] = range(matched)
    best = Ranked(pose(), np.eye(3) * 1e-4, lead, lead, True, share, 8.0 * share, 1.0, 1.0, matches)
    corner = Segments.from_array(ROOM[:2])
    registered = register(corner, MeasuredSegments.from_segments(corner), [[0, 0], [1, 1]])
    return judge([best], registered, Evidence(np.ones(8), 0.9, chance, with_beams=True))


def test_a_corner_is_not_enough_where_most_of_a_laser_scan_does_not_fit():
    assert judged(matched=3).status is Status.OK
    assert judged(share=0.75).status is Status.OK
    assert judged().status is Status.AMBIGUOUS


def test_where_chance_scores_as_high_a_laser_scan_must_be_surer():
    leads = np.linspace(0.0, 60.0, 200)
    for bar, chance in ((0.94, 0.2), (0.98, 0.4)):
        found = [judged(matched=4, lead=lead, chance=chance) for lead in leads]
        sure = [v.probability for v in found if v.status is Status.OK]
        unsure = [v.probability for v in found if v.status is Status.AMBIGUOUS]
        assert max(unsure) < bar <= min(sure)
        assert min(sure) - max(unsure) < 0.02


def test_a_wall_that_should_hide_another_speaks_against_a_pose():
    """Two equal rooms, one with a screen across that the scan sees through: the other one it is."""
    rooms = np.vstack([ROOM, ROOM + np.tile([12.0, 0.0], 2), [[16.5, 0.5, 16.5, 3.5]]])
    at = pose(3.0, 2.0, 0.3)
    endpoints, _ = seen(ROOM, at, noise=0.005, seed=3)
    blind = associate(index_of(rooms), scan_of(endpoints))
    assert blind.status is Status.AMBIGUOUS
    sighted = associate(index_of(rooms), scan_of(endpoints, viewpoint=(0.0, 0.0)))
    assert same_pose(sighted.pose, at)
    assert sighted.diagnostics.margin > 1.0
    other = associate(index_of(rooms[len(ROOM) :]), scan_of(endpoints, viewpoint=(0.0, 0.0)))
    assert other.missing_map == (len(ROOM),)


def test_a_wall_that_was_seen_is_not_missing():
    """Rays to the wall that is met edge-on graze the end of its neighbour."""
    walls = [[0, 0, 6, 0], [6, 0, 6, 2], [6, 2, 4, 2], [4, 2, 4, 5], [4, 5, 0, 5], [0, 5, 0, 0]]
    scan = [[-2, 1, -2, -5], [-2, -5, 0, -5], [0, -5, 0, -3], [0, -3, 3, -3], [3, -3, 3, 1]]
    result = associate(index_of(walls), scan_of(np.array(scan, dtype=float), viewpoint=(0.0, 0.0)))
    assert not set(result.missing_map) & {c.map for c in result.correspondences}


def test_significance_is_a_probability_that_falls_with_the_score():
    index = index_of(maze(1))
    rows = scan_rows(scan_of(seen(maze(1), pose(15.0, 15.0), radius=10.0)[0]), 0.0)
    values = [significance(index, rows, gates(AssociationOptions()), s) for s in (0.0, 30.0, 60.0, 120.0, 1e4)]
    assert values[0] == 1.0
    assert all(0.0 < b <= a <= 1.0 for a, b in itertools.pairwise(values))
    assert values[-1] < 1e-6


@pytest.mark.parametrize("theta", np.linspace(-math.pi, math.pi, 7))
def test_two_perpendicular_walls_fix_the_pose_but_not_which_corner(theta):
    corner = ROOM[:2].copy()
    at = pose(6.0, 2.0, float(theta))
    result = associate(index_of(ROOM), scan_of(seen(corner, at)[0]))
    poses = [result.pose, *(a.pose for a in result.alternatives)]
    assert any(same_pose(p, at) for p in poses)
    assert not result.usable or same_pose(result.pose, at)
