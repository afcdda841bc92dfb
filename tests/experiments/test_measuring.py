"""Scans, their known walls, and the bound."""

import math

import numpy as np
import pytest

from experiments.measuring import Setup, take
from experiments.scenes import CLEARANCE, NAMES, UNIT, bound, poses, world
from registration import RigidTransform, wrap_angle
from simulation import Scanner, scan

NOISE = (300, 3.0)
CUTS = {"vectorizer": Setup(), "walls": Setup(cut="walls")}


def measured(name, setup, seed=0, noise=NOISE, pose=0):
    truth = poses(name, setup.places)[pose]
    return truth, take(world(name), truth, noise, setup, np.random.default_rng(seed))


@pytest.mark.parametrize("cut", CUTS)
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("noise", ["range", "point"])
def test_each_segment_lies_on_the_wall_that_it_is_paired_with(cut, name, noise):
    setup = Setup(cut=CUTS[cut].cut, noise=noise, min_length=40.0)
    truth, scan_ = measured(name, setup, noise=(300, 1.0))
    segments = scan_.measured.segments.take(scan_.pairs[:, 0])
    walls = world(name).segments.take(scan_.pairs[:, 1])
    assert len(segments) >= 4
    ends = truth.apply(segments.endpoints.reshape(-1, 2, 2))
    distances = np.einsum("ijk,ik->ij", ends - walls.midpoints[:, None], walls.normals) / UNIT
    assert np.abs(distances).max() < 6.0
    angles = np.arctan2(*walls.directions.T[::-1]) - np.arctan2(*segments.directions.T[::-1]) - truth.theta
    assert max(abs(wrap_angle(a)) for a in angles) < math.radians(6.0)


@pytest.mark.parametrize("cut", CUTS)
def test_short_segments_and_segments_of_few_points_are_left_out(cut):
    long, many = Setup(cut=CUTS[cut].cut, min_length=80.0), Setup(cut=CUTS[cut].cut, min_points=20)
    _, everything = measured("Pillars", Setup(cut=CUTS[cut].cut))
    _, only_long = measured("Pillars", long)
    _, only_many = measured("Pillars", many)
    assert 0 < len(only_long.pairs) < len(everything.pairs)
    assert only_long.measured.segments.lengths[only_long.pairs[:, 0]].min() >= 80.0 * UNIT
    assert 0 < len(only_many.pairs) < len(everything.pairs)
    assert only_many.measured.point_counts[only_many.pairs[:, 0]].min() >= 20


def test_a_wall_behind_a_pillar_is_cut_where_it_is_hidden():
    _, scan_ = measured("Pillars", CUTS["walls"])
    walls = scan_.pairs[:, 1]
    assert len(walls) > len(np.unique(walls))
    assert scan_.measured.point_counts.sum() <= NOISE[0]


def test_a_segment_over_two_walls_is_left_out_unless_asked_for():
    counts = {purity: sum(len(measured("Pillars", Setup(purity=purity), seed, (300, 10.0), pose)[1].pairs)
                          for seed in range(3) for pose in range(5)) for purity in (0.0, 0.9)}  # fmt: skip
    assert counts[0.0] > counts[0.9]


def test_scattered_poses_see_free_sides_and_keep_clear():
    for name in NAMES:
        for pose in poses(name, "scattered"):
            seen = scan(world(name).segments, pose, Scanner(sigma=0.0, range_max=100.0))
            assert seen.facing.all()
            assert seen.ranges.min() > CLEARANCE
    assert poses("Pillars", "scattered") != poses("Pillars")


def test_the_bound_is_that_of_the_ranges_derivatives():
    name, points, sigma, step = "Oblique", 60, 3.0, 1e-7
    # Turned a little, so that no beam ends in a corner.
    pose = poses(name)[4].compose(RigidTransform(0.0, 0.0, 0.01))
    scanner = Scanner.over(math.tau, points, sigma=0.0, range_max=100.0)

    def ranges(dx, dy, dt):
        moved = RigidTransform(pose.x + dx, pose.y + dy, pose.theta + dt)
        return scan(world(name).segments, moved, scanner).ranges / UNIT

    columns = [
        (ranges(*(step * e)) - ranges(*(-step * e))) / (2 * step) * scale
        for e, scale in zip(np.eye(3), (UNIT, UNIT, 1.0), strict=True)
    ]
    jacobian = np.stack(columns, axis=1)
    np.testing.assert_allclose(
        bound(name, pose, points, sigma), np.linalg.inv(jacobian.T @ jacobian / sigma**2), rtol=1e-4
    )
