"""Walls of a blurred map get their position from all scans."""

from __future__ import annotations

import numpy as np

from association import MapIndex
from benchmarks.worlds.map_errors import walls_off
from map_quality import MapUpdate
from registration import Segments

from .hall import PILLAR, RACK, box, segments, update, visit

HIDDEN = box(20.0, 0.0, 24.0, 3.0)
TRUE = segments(RACK, PILLAR, HIDDEN)
SIGMA = 0.025
UNSEEN = slice(20, 24)  # the hidden box


def blurred(seed: int) -> Segments:
    return walls_off(TRUE, np.random.default_rng(seed), SIGMA).segments


def updated(old: Segments, sigma: float = SIGMA) -> MapUpdate:
    scans = [one for k in range(5) for one in visit(TRUE, f"day {k}", k)]
    return update(MapIndex.build(old, sigma), scans)


def off(ends: np.ndarray, indices: np.ndarray) -> np.ndarray:
    """Return how far the middles of segments are from the true lines, metres."""
    middles = 0.5 * (ends[:, :2] + ends[:, 2:])
    return np.asarray(np.einsum("ij,ij->i", middles, TRUE.normals[indices]) - TRUE.offsets[indices])


def test_walls_come_nearer_to_the_truth_and_their_sigma_tells_how_near() -> None:
    squares, ratios = [], []
    for seed in range(3):
        old = blurred(seed)
        found = updated(old)
        assert found.changes == ()
        sharp = found.sharpened
        assert found.segments.endpoints[UNSEEN].tolist() == old.endpoints[UNSEEN].tolist()
        assert len(sharp.segments) >= 12
        error, before = off(sharp.ends, sharp.segments), off(old.endpoints[sharp.segments], sharp.segments)
        # The whole map may be a little off: only its own walls determine its position.
        assert np.sqrt(np.mean(error**2)) < 0.6 * np.sqrt(np.mean(before**2))
        squares += error.tolist()
        ratios += ((error / sharp.sigma) ** 2).tolist()
        assert found.sigma is not None
        assert found.sigma < SIGMA
    assert np.sqrt(np.mean(np.square(squares))) < 0.012
    assert 0.2 < np.mean(ratios) < 1.5


def test_a_map_that_is_sharp_or_does_not_declare_its_sigma_stays_as_it_is() -> None:
    assert len(updated(TRUE, 0.005).sharpened.segments) == 0
    scans = [one for k in range(3) for one in visit(TRUE, f"day {k}", k)]
    found = update(MapIndex.build(TRUE), scans)
    assert (found.sigma, len(found.sharpened.segments)) == (None, 0)
