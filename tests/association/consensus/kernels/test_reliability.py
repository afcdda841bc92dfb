"""The sums of a consensus set decide whether it fixes its pose, by the paper's reliability."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings

from association.consensus.kernels.pair_sums import empty_sums, update_pairs
from association.consensus.kernels.reliability import fixes_pose, least_reliability, reliability_of
from association.consensus.tuning import FREE_DEVIATION
from association.layout import MATCH, SCAN_LINE, WALL, Integers
from association.tables import Workspace
from registration.layout import Floats, Records
from registration.observability import most_parallel

from ...kernels.drawn import PLACE, SEEDS, SMALL, drawn, workspace_of
from ...records import covariance_of, estimate_of, pose_of, work_of
from ...reference import reliability as twin
from ...reference.consensus import matches_on
from ...scenes import context_of, index_of, local, pose, scan_of
from .test_refinement import refine


def sums_of(scan: Records, walls: Records, *helds: Integers) -> Workspace:
    """Return a workspace that held these sets of pairs, one after the other."""
    work = work_of(len(scan), len(walls))
    empty_sums(work)
    for held in helds:
        update_pairs(scan, matches_on(held), walls, work)
    return work


@given(SEEDS)
@settings(max_examples=60, deadline=None)
def test_reliability_is_that_of_the_pairs_that_are_held(seed: int) -> None:
    """Whatever pairs came and went before."""
    d = drawn(seed, clutter=6)
    helds = d.rng.integers(-1, 6, (5, len(d.scan)))
    work = sums_of(d.scan, PLACE.walls, *helds)
    angles, most = work.scratch[0]["angles"], most_parallel(int((helds[-1] >= 0).sum()))
    expected = twin.reliability(d.scan, helds[-1], PLACE.walls)
    least = twin.least_reliability(d.scan, helds[-1], PLACE.walls)
    assert reliability_of(angles) == pytest.approx(expected, rel=1e-6, abs=1e-5)
    assert least_reliability(angles, most) == pytest.approx(least, rel=1e-9)
    assert fixes_pose(work) == (expected > least)


def walls_at(angles: Floats) -> Records:
    """Return walls through the origin."""
    walls = np.zeros(len(angles), WALL)
    walls["dx"], walls["dy"] = np.cos(angles), np.sin(angles)
    return walls


def lines_of(weight: Floats, spread: Floats) -> Records:
    lines = np.zeros(len(weight), SCAN_LINE)
    lines["dx"], lines["weight"], lines["spread"] = 1.0, weight, spread
    return lines


def test_parallel_walls_seldom_seem_to_fix_a_pose() -> None:
    """Of sets whose angles are off by their noise alone; those with a wall at 30 degrees across nearly all do."""
    rng = np.random.default_rng(5)
    parallel, across = 0, 0
    for _ in range(2000):
        n = int(rng.integers(2, 12))
        scan = lines_of(10.0 ** rng.uniform(3.0, 4.0, n), rng.uniform(0.05, 4.0, n))
        noise = rng.normal(0.0, 1.0 / np.sqrt(scan["weight"] * scan["spread"]))
        for turn in (0.0, math.radians(30.0)):
            angles = noise + turn * (np.arange(n) == 0)
            fixed = fixes_pose(sums_of(scan, walls_at(angles), np.arange(n)))
            if turn:
                across += fixed
            else:
                parallel += fixed
    assert parallel <= 20
    assert across >= 1900


def test_one_wall_and_no_wall_fix_nothing() -> None:
    scan, walls = lines_of(np.array([1e4, 1e4]), np.ones(2)), walls_at(np.array([0.0, 1.5]))
    for held, fixed in (([-1, -1], False), ([0, -1], False), ([0, 1], True)):
        assert fixes_pose(sums_of(scan, walls, np.array(held))) == fixed


def test_a_pose_is_not_moved_along_the_walls_that_leave_it_open() -> None:
    """Two walls of a corridor, 3 mrad apart on the map and in the scan: less than the noise of their angles.

    The pose moves across the corridor only, and its covariance shows that it is one of many. With a wall across, it is
    found along the corridor, too.
    """
    corridor = [[0.0, 0.0, 12.0, 0.0], [12.0, 2.0, 0.0, 2.036]]
    seen = [[2.0, 0.0, 9.0, 0.0], [9.0, 2.01, 2.0, 2.03]]
    end = [12.0, 0.0, 12.0, 2.0]
    for walls, segments, free in ((corridor, seen, True), ([*corridor, end], [*seen, end], False)):
        index, start = index_of(walls), pose(0.3, 0.05, 0.002)
        rows = context_of(index, scan_of(segments, 0.01)).lines.rows
        estimate, matches = estimate_of(local(index, start), SMALL), np.zeros(len(rows), MATCH)
        refine(rows, estimate, index.tables.place, matches, workspace_of(rows, index))
        assert (matches["wall"] >= 0).all()
        found = pose_of(estimate[0])
        x, y = found.x + index.origin[0], found.y + index.origin[1]
        deviation = math.sqrt(np.linalg.eigvalsh(covariance_of(estimate[0])[:2, :2])[1])
        assert y == pytest.approx(0.0, abs=0.03)
        assert x == pytest.approx(0.3 if free else 0.0, abs=0.02)
        assert (deviation > 0.9 * FREE_DEVIATION) is free
