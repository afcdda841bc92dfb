"""Single beams speak for the pose at which they read what they should, as their references say."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings

from association.consensus.beams import beam_rows
from association.consensus.kernels import beams
from association.layout import BEAM_EVIDENCE, RAY
from association.tables import Rays
from registration import RigidTransform

from ...kernels.drawn import INDEX, OBSTACLES, PLACE, SEEDS
from ...records import estimate_of, pose_of, rays_of, work_of
from ...reference import beams as twin
from ...reference.geometry import moved
from ...scenes import ANGLES, INSIDE, ROOM, index_of, local, pose, read, same_pose

ROOM_INDEX = index_of(ROOM)
HERE = local(ROOM_INDEX, INSIDE)


def drawn_rays(rng: np.random.Generator, count: int) -> tuple[Rays, RigidTransform]:
    """Return what two sensors next to the origin of their frame read in the maze, with noise, people and mirrors."""
    at = moved(pose(), rng.uniform(-1.0, 1.0, 3) * [3.0, 7.0, 7.0])
    places = rng.uniform(-0.3, 0.3, (2, 2))
    by_sensor = [read(INDEX, moved(at.compose(pose(*place)), [0.0, *INDEX.origin])) for place in places.tolist()]
    sensor = rng.integers(0, 2, len(ANGLES))
    ranges = np.choose(sensor, by_sensor)
    ranges += rng.normal(size=len(ranges)) * 0.02
    ranges *= np.where(rng.random(len(ranges)) < 0.2, rng.uniform(0.3, 1.5, len(ranges)), 1.0)
    some = np.sort(rng.permutation(len(ANGLES))[:count])
    return Rays(beam_rows(places[sensor[some]].T, ANGLES[some], ranges[some]), 20.0), at


def evidence_of(ranges: np.ndarray) -> tuple[float, float]:
    out, rays = np.zeros(1, BEAM_EVIDENCE), rays_of(ANGLES, ranges)
    place = ROOM_INDEX.tables.place
    beams.beam_evidence(rays, estimate_of(HERE)[0], place, place, np.zeros(1, RAY)[0], out[0])
    read, passed = out[0].item()
    return read, passed


def test_evidence_at_the_truth_and_elsewhere() -> None:
    ranges = read(ROOM_INDEX, INSIDE)
    assert evidence_of(ranges) == pytest.approx((1.0, 0.0), abs=1e-9)
    nearer = evidence_of(0.5 * ranges)
    assert nearer[0] < 0.1
    assert nearer[1] == 0.0, "what ends before a wall has passed through none"
    assert evidence_of(ranges + 0.6)[1] > 0.5
    assert evidence_of(np.full(240, math.inf)) == (0.0, 0.0)


@given(SEEDS)
@settings(max_examples=25, deadline=None)
def test_beam_evidence(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rays, truth = drawn_rays(rng, 120)
    for at in (truth, moved(truth, rng.normal(size=3) * [0.1, 0.3, 0.3])):
        for obstacles in (PLACE, OBSTACLES):
            out = np.zeros(1, BEAM_EVIDENCE)
            beams.beam_evidence(rays, estimate_of(at)[0], PLACE, obstacles, np.zeros(1, RAY)[0], out[0])
            assert out[0].item() == pytest.approx(twin.beam_evidence(rays, at, PLACE, obstacles))


def shares_of(ranges: np.ndarray) -> tuple[float, float, float]:
    rays, place = rays_of(ANGLES, ranges), ROOM_INDEX.tables.place
    return beams.beam_fractions(rays, estimate_of(HERE), place, place, work_of(1, 1))


def test_beams_that_read_farther_and_nearer_than_the_map_shows() -> None:
    """By 5 and 10 cm across the wall; behind a reading, the search for the wall goes far beyond what evidence needs."""
    ranges = read(ROOM_INDEX, INSIDE)
    assert shares_of(ranges) == (0.0, 0.0, 0.0)
    assert shares_of(ranges + 0.049)[0] == 0.0
    assert shares_of(ranges - 0.099)[1] == 0.0
    assert shares_of(ranges + 0.4)[0] == 1.0
    assert shares_of(0.02 * ranges)[1] == 1.0
    some = np.arange(240) < 60
    assert shares_of(np.where(some, 1.5 * ranges, math.inf)) == (0.25, 0.0, 0.25)
    assert shares_of(np.full(240, math.inf)) == (0.0, 0.0, 0.0)


def test_beams_that_pass_through_walls_count_from_10_cm_on_and_in_full_from_20() -> None:
    wall = index_of(np.array([[4.0, 5.0, 4.0, -5.0]])).tables.place  # its middle is the origin of the index
    for behind, passed in ((0.09, 0.0), (0.15, 0.5), (0.21, 1.0)):
        rays = rays_of(np.array([0.0, math.pi]), np.array([4.0 + behind, 3.0]))
        at = estimate_of(RigidTransform(-4.0, 0.0, 0.0))
        found = beams.beam_fractions(rays, at, wall, wall, work_of(1, 1))
        assert found[2] == pytest.approx(0.5 * passed, abs=1e-9)


@given(SEEDS)
@settings(max_examples=25, deadline=None)
def test_beam_shares(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rays, truth = drawn_rays(rng, 120)
    for at in (truth, moved(truth, rng.normal(size=3) * [0.1, 0.3, 0.3])):
        for obstacles in (PLACE, OBSTACLES):
            found = beams.beam_fractions(rays, estimate_of(at), PLACE, obstacles, work_of(1, 1))
            assert found == pytest.approx(twin.beam_fractions(rays, at, PLACE, obstacles))


@given(SEEDS)
@settings(max_examples=12, deadline=None)
def test_refine_by_beams(seed: int) -> None:
    """In the same workspace one after the other."""
    rng = np.random.default_rng(seed)
    rays, truth = drawn_rays(rng, 60)
    work = work_of(1, 1)
    for count in (len(rays.beams), 16, 12):
        some = rays._replace(beams=rays.beams[:count])
        start = moved(truth, rng.normal(size=3) * [0.02, 0.05, 0.05])
        for gate in (0.35, 0.15):
            estimate = estimate_of(start)
            beams.refine_by_beams(some, estimate[0], PLACE, gate, work)
            expected = twin.refine_by_beams(some, start, PLACE, gate)
            assert same_pose(pose_of(estimate[0]), expected, 1e-5, 1e-6), count


@given(SEEDS)
@settings(max_examples=8, deadline=None)
def test_weigh_beams(seed: int) -> None:
    """The first poses are moved, if beams fit better there and do not pass through more; the others stay."""
    rng = np.random.default_rng(seed)
    rays, truth = drawn_rays(rng, 40)
    starts = [moved(truth, rng.normal(size=3) * scale) for scale in (0.0, [0.02, 0.1, 0.1], [0.1, 1.0, 1.0], 0.05)]
    poses, out = np.concatenate([estimate_of(at) for at in starts]), np.zeros(4, BEAM_EVIDENCE)
    beams.weigh_beams(rays, poses, PLACE, OBSTACLES, 3, work_of(1, 1), out)
    for k, start in enumerate(starts):
        at, there, here = twin.weigh_beams(rays, start, PLACE, OBSTACLES)
        if k == 3:
            at, there = start, here
        assert same_pose(pose_of(poses[k]), at, 1e-5, 1e-6)
        assert out[k].item() == pytest.approx(there, abs=1e-5)


def test_beams_move_a_pose_to_where_they_fit() -> None:
    poses, out = estimate_of(moved(HERE, [0.02, 0.1, -0.08])), np.zeros(1, BEAM_EVIDENCE)
    rays = rays_of(ANGLES, read(ROOM_INDEX, INSIDE))
    place = ROOM_INDEX.tables.place
    beams.weigh_beams(rays, poses, place, place, 1, work_of(1, 1), out)
    assert same_pose(pose_of(poses[0]), HERE, 1e-3, 1e-3)
    assert out[0]["read"] > 0.99


@pytest.mark.parametrize(("count", "moves"), [(9, False), (10, True)])
def test_few_beams_do_not_move_a_pose(count: int, moves: bool) -> None:
    start, ranges = moved(HERE, [0.01, 0.03, -0.03]), read(ROOM_INDEX, INSIDE)
    estimate, every = estimate_of(start), slice(None, None, 240 // count)
    rays, work = rays_of(ANGLES[every][:count], ranges[every][:count]), work_of(1, 1)
    beams.refine_by_beams(rays, estimate[0], ROOM_INDEX.tables.place, 0.35, work)
    assert same_pose(pose_of(estimate[0]), start, 1e-9, 1e-9) is not moves
