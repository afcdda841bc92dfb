"""Walls that nearly continue one another keep their own lines, and are one wall the less the larger the step is."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from association import AssociationResult, MapIndex, Scan
from registration import MeasuredSegments, RegistrationOptions, Segments, register
from registration.layout import Floats

from .scenes import INSIDE, ROOM, answer_of, index_of, pose, pose_in, scan_of, seen

HALL = np.array([[0, 0, 8, 0], [8, 0, 8, 5], [8, 5, 3, 5], [3, 5, 3, 7], [3, 7, 0, 7], [0, 7, 0, 0]], dtype=float)
STEPS = st.floats(0.0, 0.1)


def stepped(step: float, gap: float = 0.0, at: float = 4.5) -> Floats:
    """Return the hall whose first wall has a step to its left, and a gap."""
    halves = [[0.0, 0.0, at - 0.5 * gap, 0.0], [at + 0.5 * gap, step, 8.0, step]]
    return np.vstack([halves, HALL[1:]])


def of_hall(seed: int, fraction: float = 0.3) -> Scan:
    """Return what is seen of four walls of the hall, the first of them from end to end."""
    ends = seen(HALL[[1, 2, 5]], pose(4.0, 2.5, 0.4), noise=0.005, cut=fraction, seed=seed)[0]
    first = pose(4.0, 2.5, 0.4).inverse().apply(np.array([[0.4, 0.0], [7.6, 0.0]])).reshape(1, 4)
    return scan_of(np.vstack([ends, first]), 0.01, (0.0, 0.0))


def one_wall(index: MapIndex, first: int = 0, second: int = 1) -> float:
    """Return how the errors of the walls of two segments are correlated."""
    a, b = index.wall_of_piece[[first, second]]
    if a == b:
        return 1.0
    ties = index.ties[[a, b]]
    return 0.0 if (ties < 0.0).any() else math.exp(-abs(ties[0] - ties[1]))


def test_pieces_of_one_line_are_one_wall_and_others_are_not() -> None:
    assert len(set(index_of(stepped(0.0)).wall_of_piece[:2])) == 1
    assert len(set(index_of(stepped(1e-3)).wall_of_piece[:2])) == 2
    assert len(set(index_of(stepped(5e-5), 0.0001).wall_of_piece[:2])) == 2, "the declared deviation is smaller"


def test_walls_are_one_the_less_the_larger_the_step_or_the_gap_is() -> None:
    by_step = [one_wall(index_of(stepped(step))) for step in np.linspace(0.0, 0.08, 81)]
    by_gap = [one_wall(index_of(stepped(0.0, gap))) for gap in np.linspace(0.0, 0.6, 601)]
    for correlations in (by_step, by_gap):
        assert correlations[0] == 1.0
        assert correlations[-1] < 1e-9
        assert (np.diff(correlations) <= 1e-12).all()
        assert np.abs(np.diff(correlations)).max() < 0.05


@pytest.mark.parametrize("sigma", [0.0, 0.001, 0.003])
@pytest.mark.parametrize("step", [0.012, 0.02, 0.028])
def test_a_map_that_is_said_to_be_exact_keeps_its_steps(step: float, sigma: float) -> None:
    """A scan of one side of the step is where that side is: the lines of a map are not moved by more than its error."""
    walls = stepped(step)
    ends = np.array([[5.0, step, 7.8, step], [8.0, 0.5, 8.0, 4.5], [7.5, 5.0, 3.4, 5.0], [3.0, 5.2, 3.0, 6.8]])
    at = pose(5.0, 2.0, 0.3)
    scan = scan_of(at.inverse().apply(ends.reshape(-1, 2, 2)).reshape(-1, 4), 0.005)
    found = pose_in(answer_of(index_of(walls, sigma), scan))
    assert (found.x, found.y, found.theta) == pytest.approx((at.x, at.y, at.theta), abs=3e-4 + sigma)


@given(st.integers(0, 50), STEPS)
@settings(max_examples=25, deadline=None)
def test_a_millimetre_of_a_step_changes_the_probability_little(seed: int, step: float) -> None:
    scan = of_hall(seed)
    one, other = (answer_of(index_of(stepped(s)), scan) for s in (step, step + 1e-3))
    if abs(step - 0.08) > 2e-3:
        assert other.probability == pytest.approx(one.probability, abs=0.1)


@pytest.mark.parametrize("step", [0.0295, 0.0305])
def test_a_step_of_three_centimetres_is_no_edge(step: float) -> None:
    result, plain = answer_of(index_of(stepped(step)), of_hall(3)), answer_of(index_of(HALL), of_hall(3))
    assert (result.status, result.usable) == (plain.status, plain.usable)
    assert result.probability == pytest.approx(plain.probability, abs=0.02)


def registered(result: AssociationResult, walls: Floats, sigma: float, scan: Scan, **options: Any) -> Any:
    pairs = [[one.scan, one.map] for one in result.correspondences]
    return register(Segments.from_array(walls), scan.measured, pairs, sigma, RegistrationOptions(**options))


def assert_same_answer(result: AssociationResult, again: Any) -> None:
    assert result.diagnostics is not None
    found = pose_in(result)
    assert (again.pose.x, again.pose.y, again.pose.theta) == pytest.approx((found.x, found.y, found.theta), abs=1e-9)
    assert result.covariance is not None
    np.testing.assert_allclose(again.covariance, result.covariance, atol=1e-9)
    assert again.diagnostics.chi2 == pytest.approx(result.diagnostics.registration.chi2, abs=1e-6)
    assert again.diagnostics.dof == result.diagnostics.registration.dof


@pytest.mark.parametrize("sigma", [0.0, 0.001, 0.02])
@pytest.mark.parametrize("seed", range(4))
def test_the_correspondences_of_an_answer_register_to_its_pose(seed: int, sigma: float) -> None:
    """With nothing but the pairs, where each is alone on its wall; with covariance and chi-square."""
    scan = scan_of(seen(ROOM, INSIDE, noise=0.01, cut=0.4, seed=seed)[0], 0.01)
    result = answer_of(index_of(ROOM, sigma), scan)
    assert_same_answer(result, registered(result, ROOM, sigma, scan))


@pytest.mark.parametrize("sigma", [None, 0.01])
@pytest.mark.parametrize("seed", range(4))
def test_with_their_weights_they_do_where_pairs_share_a_wall(seed: int, sigma: float | None) -> None:
    """Cut, repeated and with steps, and where the error of the map is estimated."""
    rng = np.random.default_rng(seed)
    walls = stepped(0.02)
    ends = of_hall(seed).measured.segments.endpoints
    middles = ends[:, :2] + rng.uniform(0.3, 0.7, (len(ends), 1)) * (ends[:, 2:] - ends[:, :2])
    pieces = np.vstack([np.hstack([ends[:, :2], middles]), np.hstack([middles, ends[:, 2:]]), ends[:2]])
    scan = Scan(MeasuredSegments.from_segments(Segments.from_array(pieces), 0.01, np.full(len(pieces), 20.0)))
    result = answer_of(index_of(walls, sigma), scan)
    weights = [one.weight for one in result.correspondences]
    assert_same_answer(result, registered(result, walls, sigma or 0.02, scan, weights=weights))
