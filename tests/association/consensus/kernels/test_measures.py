"""The paper's measures of a consensus set are those of the same pairs handed to `registration`."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings

from association.consensus.kernels.measures import paper_measures
from association.layout import POSE_AMONG_WALLS, Integers
from registration import Correspondences, MeasuredSegments, OneStepSums, Segments
from registration.layout import Floats, Records

from ...kernels.drawn import SEEDS
from ...reference.consensus import matches_on
from ...reference.geometry import normal
from ...reference.pose_estimation import registering
from .test_pose_estimation import Set, known_walls, some


def ends(rows: Records, middles: Floats, lengths: Floats) -> Floats:
    half = 0.5 * lengths[:, None] * np.stack([rows["dx"], rows["dy"]], axis=1)
    return np.hstack([middles - half, middles + half])


def sums_of(one: Set, wall_sigma: float) -> OneStepSums:
    """Return the sums of its pairs by the library, about its pose."""
    lines, walls = one.scan[one.held >= 0], one.walls[one.held[one.held >= 0]]
    normals = np.array([normal(wall) for wall in walls])
    along = 0.5 * (walls["begin"] + walls["end"])
    on_walls = along[:, None] * np.stack([walls["dx"], walls["dy"]], axis=1) + walls["offset"][:, None] * normals
    drawn = Segments.from_array(ends(walls, on_walls, walls["end"] - walls["begin"]))
    seen = Segments.from_array(ends(lines, np.stack([lines["x"], lines["y"]], axis=1), lines["length"]))
    rows = np.repeat(np.arange(len(lines)), 2).reshape(-1, 2)
    pairs = Correspondences.of(drawn, MeasuredSegments.from_segments(seen, 0.01), rows)
    weights = registering(one.scan, one.held, wall_sigma**2)["weight"][one.held >= 0]
    return OneStepSums.of_set(pairs, weights, one.start)


def measures_at(one: Set, held: Integers, wall_sigma: float) -> list[float]:
    """Return what they are with these walls held, the second of two sets of which the first is another."""
    at = one.start
    poses = np.array([(0.0, 0.0, 0.0, 0.01), (at.theta, at.x, at.y, wall_sigma)], POSE_AMONG_WALLS)
    matches = np.stack([matches_on(one.held[::-1]), matches_on(held)])
    found: list[float] = paper_measures(one.scan, matches, known_walls(one), poses)[1].tolist()
    return found


@given(SEEDS)
@settings(max_examples=40, deadline=None)
def test_they_are_those_of_the_one_step_sums(seed: int) -> None:
    one, wall_sigma = some(seed), 0.02 * (seed % 3)
    at = one.start
    translation, mitsuta, wahba, reliability = measures_at(one, one.held, wall_sigma)
    sums = sums_of(one, wall_sigma)
    assert (translation, mitsuta) == pytest.approx(sums.costs(at, "mitsuta"), rel=1e-6)
    assert (translation, wahba) == pytest.approx(sums.costs(at, "wahba"), rel=1e-6)
    assert reliability == pytest.approx(sums.reliability, rel=1e-6, abs=1e-6)


def test_of_no_pair_there_is_nothing_to_tell() -> None:
    one = some(1)
    assert measures_at(one, np.full_like(one.held, -1), 0.0) == [0.0, 0.0, 0.0, 0.0]
