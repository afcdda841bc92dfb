"""Beams that speak against an alternative, by the thing that they do not show."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from association.consensus.beams import beam_rows
from association.index.tuning import MERGE_GAP
from association.tables import Rays
from association.verdict.kernels.absences import limit_by_things
from association.verdict.tuning import ABSENCE, LEAST_OF_BEAM
from registration.layout import Floats


def limit_of(rays: Rays, here: Floats, there: Floats) -> float:
    """Return the same by SciPy's components of a graph."""
    more = here[:, 0] - there[:, 0]
    distances = np.where(more > 0.0, there[:, 1], here[:, 1])
    ends = np.stack([rays.beams["x"] + distances * rays.beams["dx"], rays.beams["y"] + distances * rays.beams["dy"]])
    which = np.flatnonzero(np.abs(more) > LEAST_OF_BEAM)
    apart = np.hypot(*(ends[:, which, None] - ends[:, None, which]))
    _, thing = connected_components(coo_matrix(apart <= MERGE_GAP), directed=False)
    sums = np.bincount(thing, more[which])
    return float(np.clip(sums, 0.0, ABSENCE).sum())


@pytest.mark.parametrize("seed", range(6))
def test_things_are_components_of_the_ends_of_beams(seed: int) -> None:
    rng = np.random.default_rng(seed)
    angles, ranges = np.linspace(-math.pi, math.pi, 60, endpoint=False), rng.uniform(1.0, 6.0, 60)
    rays = Rays(beam_rows((0.3, -0.2), angles, ranges), 20.0)
    here = np.stack([rng.choice([0.0, 0.55], 60), ranges], axis=1)
    there = np.stack([rng.choice([-0.3, 0.0, 0.55], 60), ranges - rng.uniform(0.0, 1.0, 60)], axis=1)
    found = limit_by_things(rays, here, there, MERGE_GAP, ABSENCE)
    assert found == pytest.approx(limit_of(rays, here, there))
    assert found > 0.0


@pytest.mark.parametrize(("apart", "things"), [(0.1, 1), (2.0, 2)])
def test_each_thing_counts_so_much_at_most(apart: float, things: int) -> None:
    """Forty beams of 1 nat each, to two boxes: one where they touch, two where they stand apart."""
    box = np.stack([np.linspace(-1.0, 1.0, 20), np.full(20, 3.0)])
    x, y = np.hstack([box - np.array([[1.0], [0.0]]), box + np.array([[1.0 + apart], [0.0]])])
    ranges = np.hypot(x, y)
    rays = Rays(beam_rows((0.0, 0.0), np.arctan2(y, x), ranges + 2.0), 20.0)
    here = np.stack([np.full(40, 1.0), ranges + 2.0], axis=1)
    there = np.stack([np.zeros(40), ranges], axis=1)
    assert limit_by_things(rays, here, there, MERGE_GAP, ABSENCE) == pytest.approx(things * ABSENCE)
    assert limit_by_things(rays, there, here, MERGE_GAP, ABSENCE) == 0.0
