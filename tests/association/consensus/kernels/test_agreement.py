"""The scan is compared with the map in the same way as by the references."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings

from association.consensus.kernels import agreement as comparing
from association.tuning import RAYS
from registration import RigidTransform
from registration.layout import Records

from ...kernels.drawn import INDEX, MAZE, PLACE, SEEDS, drawn
from ...records import estimate_of, sights_of, work_of
from ...reference import agreement as twin
from ...reference.geometry import moved
from ...scenes import context_of, local, pose, scan_of, seen


def agreement(scan: Records, viewpoint: np.ndarray, at: RigidTransform) -> float:
    work = work_of(len(scan), len(PLACE.walls))
    return comparing.agreement(sights_of(scan, viewpoint), estimate_of(at), PLACE, work)


@given(SEEDS)
@settings(max_examples=40, deadline=None)
def test_scan_distances(seed: int) -> None:
    d = drawn(seed)
    (x, y), distances = d.rng.normal(size=2), np.zeros(RAYS)
    farthest = comparing.scan_distances(sights_of(d.scan).seen, x, y, distances)
    expected, reach = twin.scan_distances(d.scan, (x, y), RAYS)
    assert farthest == pytest.approx(reach)
    np.testing.assert_array_equal(np.isinf(distances), np.isinf(expected))
    np.testing.assert_allclose(distances, expected, rtol=1e-9)


@given(SEEDS)
@settings(max_examples=200, deadline=None)
def test_in_view(seed: int) -> None:
    """Gaps of all widths, over angle 0 too, and no segment at all."""
    rng = np.random.default_rng(seed)
    distances, view = np.full(24, math.inf), np.zeros(24, dtype=bool)
    start, count = rng.integers(0, 24), rng.integers(0, 24)
    looked = (start + np.arange(count)) % 24
    distances[looked[rng.random(count) < rng.choice([0.3, 0.8])]] = 1.0
    comparing.in_view(distances, view)
    assert view.tolist() == twin.in_view(distances)


def test_the_sensor_looked_everywhere_but_in_a_wide_gap() -> None:
    """A quarter of the circle is not wide yet."""
    for gap, blind in ((6, 0), (7, 6), (20, 19)):
        distances, view = np.ones(24), np.ones(24, dtype=bool)
        distances[(20 + np.arange(1, gap)) % 24] = math.inf
        comparing.in_view(distances, view)
        assert (~view).sum() == blind, gap


@given(SEEDS)
@settings(max_examples=30, deadline=None)
def test_agreement(seed: int) -> None:
    """At the pose and elsewhere, of what a sensor sees all around and of what it sees ahead."""
    d = drawn(seed)
    viewpoint = d.rng.uniform(-0.3, 0.3, 2)
    ahead = d.scan[d.scan["x"] > 0.0]
    for scan in (d.scan, ahead) if len(ahead) else (d.scan,):
        for at in (d.at, d.near(0.3, 3.0, 3.0)):
            expected = twin.agreement(scan, viewpoint, at, PLACE.walls)
            assert agreement(scan, viewpoint, at) == pytest.approx(expected)


def test_agreement_of_the_true_pose_is_whole_and_of_half_a_turn_is_not() -> None:
    at = pose(14.0, 15.0, 0.4)
    scan, here = context_of(INDEX, scan_of(seen(MAZE, at, radius=12.0)[0])).lines.rows, local(INDEX, at)
    assert agreement(scan, np.zeros(2), here) > 0.9
    assert agreement(scan, np.zeros(2), moved(here, [math.pi, 0.0, 0.0])) < 0.6
