"""Raw beams speak for the pose at which they read what they should."""

import math

import numpy as np
import pytest
from association._beam_kernels import beam_evidence, rank_beams

from association import Beams, MapIndex, Scan, Status, associate
from registration import MeasuredSegments, Segments

from . import reference
from .scenes import CORRIDOR, ROOM, pose, scan_of, seen

INDEX = MapIndex.build(Segments.from_array(ROOM))
INSIDE = pose(3.0, 2.5, 0.7)
ANGLES = np.linspace(-math.pi, math.pi, 240, endpoint=False)


def arrays(index):
    return index.walls.rows, index.grid.starts, index.grid.items, index.grid.shape


def read(index, at, reach=20.0):
    """Return the exact ranges at a pose in the map frame, inf beyond `reach`."""
    x, y = at.x - index.origin[0], at.y - index.origin[1]
    rays = [(x, y, math.cos(at.theta + a), math.sin(at.theta + a), reach) for a in ANGLES]
    found = [reference.first_hit(*ray, index.walls.rows) for ray in rays]
    return np.array([distance if wall >= 0 else math.inf for distance, wall in found])


def local(index, at):
    return np.array([at.theta, at.x - index.origin[0], at.y - index.origin[1]])


def test_evidence_at_the_truth_and_elsewhere():
    ranges = read(INDEX, INSIDE)
    right = beam_evidence(ANGLES, ranges, 20.0, np.zeros(2), local(INDEX, INSIDE), *arrays(INDEX))
    assert right == pytest.approx((1.0, 0.0), abs=1e-9)
    nearer = beam_evidence(ANGLES, 0.5 * ranges, 20.0, np.zeros(2), local(INDEX, INSIDE), *arrays(INDEX))
    assert nearer[0] < 0.1
    assert nearer[1] == 0.0, "what ends before a wall has passed through none"
    farther = beam_evidence(ANGLES, ranges + 0.6, 20.0, np.zeros(2), local(INDEX, INSIDE), *arrays(INDEX))
    assert farther[1] > 0.5
    silent = beam_evidence(ANGLES, np.full(240, math.inf), 20.0, np.zeros(2), local(INDEX, INSIDE), *arrays(INDEX))
    assert silent == (0.0, 0.0)


def test_beams_move_a_pose_to_where_they_fit():
    poses = np.add(local(INDEX, INSIDE), [[0.02, 0.1, -0.08]])
    out = np.zeros((1, 2))
    rank_beams(ANGLES, read(INDEX, INSIDE), 20.0, np.zeros(2), poses, *arrays(INDEX), 1, out)
    np.testing.assert_allclose(poses[0], local(INDEX, INSIDE), atol=1e-3)
    assert out[0, 0] > 0.99


def test_beams_tell_where_along_a_corridor():
    """The segments are those of the two long walls; single beams meet the one end that is closed."""
    index = MapIndex.build(Segments.from_array(np.vstack([CORRIDOR, [[0.0, 2.0, 0.0, 0.0]]])))
    at = pose(7.0, 0.8, 0.1)
    walls = scan_of(seen(CORRIDOR, at, cut=0.5, seed=2)[0]).measured
    blind = associate(index, Scan(walls))
    told = associate(index, Scan(walls, (0.0, 0.0), Beams(ANGLES, read(index, at), 20.0)))
    assert blind.status is told.status is Status.DEGENERATE
    assert abs(blind.pose.x - at.x) > 0.5
    assert (told.pose.x, told.pose.y, told.pose.theta) == pytest.approx((7.0, 0.8, 0.1), abs=0.1)


def test_beams_tell_equal_rooms_apart():
    """One of two equal rooms has a niche that no segment shows."""
    niche = np.array([[0, 0, 9, 0], [9, 0, 9, 1.5], [9, 1.5, 10.5, 1.5], [10.5, 1.5, 10.5, 2.5], [10.5, 2.5, 9, 2.5],
                      [9, 2.5, 9, 4]], dtype=float)  # fmt: skip
    rooms = np.vstack([ROOM, np.vstack([niche, ROOM[2:]]) + np.tile([20.0, 0.0], 2)])
    index, at = MapIndex.build(Segments.from_array(rooms)), pose(3.0, 2.0, 0.3)
    measured = MeasuredSegments.from_segments(Segments.from_array(seen(ROOM[2:], at)[0]), 0.02)
    assert associate(index, Scan(measured)).status is Status.AMBIGUOUS
    result = associate(index, Scan(measured, (0.0, 0.0), Beams(ANGLES, read(index, at), 20.0)))
    assert (result.pose.x, result.pose.y) == pytest.approx((3.0, 2.0), abs=0.05)
    assert result.diagnostics.margin > 1.0
