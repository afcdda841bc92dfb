"""Probability that random walls score as high."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from association.verdict.chance import EXPONENTS, significance
from association.verdict.tuning import LEAST_SIGNIFICANCE

from ..reference import chance as twin
from ..scenes import context_of, index_of, maze, pose, scan_of, seen

INDEX = index_of(maze(1))
CONTEXT = context_of(INDEX, scan_of(seen(maze(1), pose(15.0, 15.0), radius=10.0)[0]))


def test_it_is_a_probability_that_falls_with_the_score() -> None:
    values = [significance(CONTEXT, score) for score in (0.0, 30.0, 60.0, 120.0, 1e4)]
    assert values[0] == 1.0
    assert all(0.0 < b <= a <= 1.0 for a, b in itertools.pairwise(values))
    assert values[-1] == LEAST_SIGNIFICANCE


@pytest.mark.parametrize("score", [40.0, 80.0, 150.0])
def test_it_bounds_the_chance_of_all_poses_that_can_be_told_apart(score: float) -> None:
    """Those are as many as squares of the offset gate and turns of the angle gate fit in."""
    gates, rows = CONTEXT.gates[0], CONTEXT.lines.rows
    lengths = np.asarray(INDEX.walls.longest)
    chances = twin.chance_matches(rows, lengths, INDEX.wall_lengths.agreeing, INDEX.area, CONTEXT.gates)
    poses = INDEX.area / (2.0 * gates["least_offset"]) ** 2 * math.tau / (2.0 * gates["least_angle"])
    expected = math.exp(twin.log_tail(rows, chances, score, EXPONENTS)) * poses
    assert significance(CONTEXT, score) == pytest.approx(min(1.0, expected))


def test_there_is_one_pose_at_least() -> None:
    """On a map of one wall, with gates as wide as they may be."""
    small = context_of(index_of([[0.0, 0.0, 0.05, 0.0]]), scan_of([[0, 0, 0.05, 0]]), offset_tolerance=0.4)
    assert 0.0 < significance(small, 5.0) <= 1.0
