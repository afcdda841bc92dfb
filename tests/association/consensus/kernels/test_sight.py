"""Rays meet the walls that their references meet, and what passes through a wall is counted once."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings

from association.consensus.kernels import sight
from association.layout import BLOCKER, MATCH, RAY, record
from association.tables import Blockers
from registration import RigidTransform
from registration.layout import Records

from ...kernels.drawn import PLACE, SEEDS, drawn
from ...records import estimate_of, sights_of
from ...reference import sight as twin
from ...scenes import ROOM, context_of, index_of, local, pose, scan_of


def no_blockers(walls: Records) -> Blockers:
    return Blockers(np.zeros(len(walls), BLOCKER), np.full(len(walls), -1))


def counted(blockers: Blockers, count: int) -> twin.Counts:
    return {w: list(blockers.counts[w].item())[:2] for w in blockers.touched[:count].tolist()}


@given(SEEDS)
@settings(max_examples=200, deadline=None)
def test_first_hit(seed: int) -> None:
    """From places inside and outside of the grid, in all directions and along its axes."""
    rng = np.random.default_rng(seed)
    at = rng.uniform(-25.0, 25.0, 2)
    angle = rng.choice([rng.uniform(-math.pi, math.pi), 0.0, math.pi / 2, -math.pi / 2, math.pi])
    limit = rng.choice([3.0, 60.0])
    ray = record(RAY, x=at[0], y=at[1], dx=math.cos(angle), dy=math.sin(angle), limit=limit)[0]
    grid = PLACE.grid
    distance, wall = sight.first_hit(ray, PLACE.walls, grid.starts, grid.items, grid.shape[0])
    expected, by = twin.first_hit(at, angle, limit, PLACE.walls)
    assert distance == pytest.approx(expected, abs=1e-9)
    assert wall == by


@given(SEEDS)
@settings(max_examples=25, deadline=None)
def test_count_blockers(seed: int) -> None:
    d = drawn(seed)
    matches = np.zeros(len(d.scan), MATCH)
    matches["wall"] = d.rng.integers(-1, 2, len(d.scan))
    viewpoint = d.rng.normal(size=2)
    at, blockers, ray = d.near(1.0, 3.0, 3.0), no_blockers(PLACE.walls), np.zeros(1, RAY)[0]
    sights = sights_of(d.scan, viewpoint)
    count = sight.count_blockers(sights, matches, estimate_of(at)[0], PLACE, blockers, ray)
    expected = twin.count_blockers(d.scan, matches["wall"] >= 0, viewpoint, at, PLACE.walls)
    assert counted(blockers, count) == expected
    assert len(set(blockers.touched[:count].tolist())) == count


@given(SEEDS)
@settings(max_examples=50, deadline=None)
def test_sight_penalty(seed: int) -> None:
    """It clears both counts, so that the next pose is not charged for this one."""
    rng = np.random.default_rng(seed)
    blockers = no_blockers(PLACE.walls)
    touched = rng.permutation(len(PLACE.walls))[:9]
    blockers.touched[:9] = touched
    for name in ("to_matched", "to_clutter"):
        blockers.counts[name][touched] = rng.integers(0, 9, 9)
    expected = twin.sight_penalty(counted(blockers, 9), PLACE.walls)
    assert sight.sight_penalty(blockers, 9, PLACE.walls) == pytest.approx(expected)
    assert not any(blockers.counts[name].any() for name in ("to_matched", "to_clutter", "row"))
    assert sight.sight_penalty(blockers, 9, PLACE.walls) == 0.0


def penalty(scan: list[list[float]], at: RigidTransform, walls: np.ndarray) -> float:
    """Return what lines of sight speak against a pose at which the first segment is matched."""
    index = index_of(walls)
    rows = context_of(index, scan_of(scan)).lines.rows
    matches, blockers = np.zeros(len(rows), MATCH), no_blockers(index.walls.rows)
    matches["wall"][1:] = -1
    sights, estimate = sights_of(rows), estimate_of(local(index, at))
    count = sight.count_blockers(sights, matches, estimate[0], index.tables.place, blockers, np.zeros(1, RAY)[0])
    return sight.sight_penalty(blockers, count, index.walls.rows)


def test_what_is_charged_for_a_wall_between() -> None:
    """Two nats a metre up to three metres, as soon as four rays pass; in part for fewer; and the same for clutter."""
    far = [5.0, -1.0, 5.0, 1.0]  # 2 m, 5 m ahead: eight rays
    assert penalty([far], pose(1.0, 3.0), ROOM) == 0.0
    for length, expected in ((2.0, 4.0), (4.0, 6.0)):
        screen = np.vstack([ROOM, [[3.5, 3.0 - length / 2, 3.5, 3.0 + length / 2]]])
        assert penalty([far], pose(1.0, 3.0), screen) == pytest.approx(expected)
    hole = np.vstack([ROOM, [[3.5, 3.0, 3.5, 3.2]]])  # two of the rays pass through it
    assert penalty([far], pose(1.0, 3.0), hole) == pytest.approx(0.2 * 2.0 * 2 / 4)
    # The same segment as clutter, with a longer one matched elsewhere.
    elsewhere = [-0.5, 2.0, -0.5, -2.5]
    assert penalty([elsewhere, far], pose(1.0, 3.0), np.vstack([ROOM, [[3.5, 2.0, 3.5, 4.0]]])) == pytest.approx(4.0)
