"""Scans of which answers were usable and wrong, or said to be alone when they were not."""

from __future__ import annotations

import math

import numpy as np
import pytest

from association import AssociationResult, HardPrior, MapIndex, Status
from registration import Segments
from registration.layout import Floats

from .scenes import answer_of, beams_of, index_of, maze, pose, pose_in, same_pose, scan_of, seen

LOBBY = np.array([[0, 0, 8, 0], [8, 0, 8, 3], [8, 3, 5, 3], [5, 3, 5, 6], [5, 6, 0, 6], [0, 6, 0, 0]], dtype=float)
SIGMAS = [0.0, 0.03, None]


def map_of(walls: Floats, sigma: float | None) -> MapIndex:
    return MapIndex.build(Segments.from_array(walls), sigma)


def runner_up(result: AssociationResult) -> float:
    assert result.diagnostics is not None
    assert result.diagnostics.runner_up is not None
    return result.diagnostics.runner_up


# A corner with a doorpost next to it, and what was seen of them.
CORNER_WITH_POST = np.array(
    [
        [23.0, 30.77, 23.0, 34.56],
        [23.0, 34.56, 19.78, 34.56],
        [21.93, 32.7, 21.64, 32.85],
        [21.64, 32.85, 21.79, 33.15],
    ]
)
SEEN_OF_IT = np.array(
    [
        [1.553, -1.553, 2.053, -0.374],
        [1.165, -0.222, 0.806, 0.168],
        [0.788, 0.169, 0.989, 0.346],
        [1.01, 0.35, 0.55, 0.546],
    ]
)


@pytest.mark.parametrize("sigma", SIGMAS)
@pytest.mark.parametrize("viewpoint", [None, (0.0, 0.0)])
def test_a_rival_that_an_exhaustive_search_finds_is_found(
    sigma: float | None, viewpoint: tuple[float, float] | None
) -> None:
    """It was said that there was none, with a confidence of 1."""
    index, scan = map_of(CORNER_WITH_POST, sigma), scan_of(SEEN_OF_IT, viewpoint=viewpoint)
    usual, whole = (answer_of(index, scan, exhaustive=exhaustive) for exhaustive in (False, True))
    assert runner_up(usual) == pytest.approx(runner_up(whole))
    assert runner_up(usual) > 0.7
    assert usual.probability == pytest.approx(whole.probability)
    assert (usual.status, usual.usable) == (whole.status, False)
    assert usual.search.complete_above <= 0.75


@pytest.mark.parametrize("sigma", SIGMAS)
def test_corners_of_other_buildings_are_not_usable(sigma: float | None) -> None:
    """Two walls at right angles, however long: every building has such a corner."""
    index, rng = map_of(LOBBY, sigma), np.random.default_rng(0)
    scans = [[[-4.0, -3.0, 3.8, -3.0], [3.8, -3.0, 3.8, 4.3]]]
    for left, right, down, up in rng.uniform(1.0, 4.5, (40, 4)):
        scans.append([[-left, -down, right, -down], [right, -down, right, up]])
    for scan in scans:
        result = answer_of(index, scan_of(scan, viewpoint=(0.0, 0.0)))
        assert not result.usable
        assert result.status is not Status.OK


@pytest.mark.parametrize("sigma", SIGMAS)
def test_three_sides_of_rooms_of_other_buildings_are_not_usable(sigma: float | None) -> None:
    """The third side may lie anywhere along; those of the width of a room of the map are few."""
    index, rng = map_of(LOBBY, sigma), np.random.default_rng(0)
    usable = 0
    for left, right, down, up in rng.uniform(1.0, 4.0, (60, 4)):
        ends = [[-left, up, -left, -down], [-left, -down, right, -down], [right, -down, right, up]]
        usable += answer_of(index, scan_of(ends, viewpoint=(0.0, 0.0))).usable
    assert usable == 0


def test_three_sides_of_rooms_are_not_usable_with_raw_ranges_either() -> None:
    """What is free before them is free in the map, too."""
    index, rng = map_of(LOBBY, None), np.random.default_rng(1)
    for left, right, down, up in rng.uniform(1.0, 4.0, (40, 4)):
        ends = [[-left, -down, right, -down], [right, -down, right, up], [-left, up, -left, -down]]
        beams = beams_of(index_of(ends), pose(0.0, 0.0))
        assert not answer_of(index, scan_of(ends, viewpoint=(0.0, 0.0), beams=beams)).usable


@pytest.mark.parametrize("sigma", [0.0, 0.05, 0.1, 0.2])
def test_a_map_that_is_far_off_is_not_degenerate_where_the_pose_is_fixed(sigma: float) -> None:
    """Twelve walls hold it however far each is off; what the walls show of their angles is as good as before."""
    ends = seen(maze(1), pose(15.0, 14.0, 0.5), noise=0.02, cut=0.3, seed=1, radius=9.0)[0]
    result = answer_of(index_of(maze(1), sigma), scan_of(ends))
    assert len(result.correspondences) >= 12
    assert result.status is not Status.DEGENERATE
    assert same_pose(pose_in(result), pose(15.0, 14.0, 0.5))
    assert result.covariance is not None


@pytest.mark.parametrize("sigma", SIGMAS)
@pytest.mark.parametrize("degrees", [0.5, 1.0, 2.0])
def test_two_walls_that_are_nearly_parallel_fix_nothing_along_them(degrees: float, sigma: float | None) -> None:
    """Centimetres stated along them were metres."""
    turn = math.radians(degrees)
    c, s = math.cos(turn), math.sin(turn)
    walls = np.array([[0.0, 0.0, 30.0, 0.0], [20.0, 4.0, 20.0 - 15.0 * c, 4.0 - 15.0 * s]])
    scan = scan_of([[-6.0, -2.0, 6.0, -2.0], [6.0, 2.0, 6.0 - 12.0 * c, 2.0 - 12.0 * s]], 0.01)
    result = answer_of(map_of(walls, sigma), scan)
    assert (result.usable, result.covariance) == (False, None)
    assert result.status in (Status.DEGENERATE, Status.NO_MATCH)


@pytest.mark.parametrize("seed", range(40))
def test_no_usable_answer_states_a_deviation_beyond_half_a_metre(seed: int) -> None:
    """Of long walls that are nearly parallel, a short one across, far off or near, and a map of any quality."""
    rng = np.random.default_rng(seed)
    turn, across = rng.uniform(0.0, 0.15), rng.uniform(0.1, 1.0)
    far = [28.0, 4.0, 28.0 - 26.0 * math.cos(turn), 4.0 - 26.0 * math.sin(turn)]
    walls = np.array([[0.0, 0.0, 30.0, 0.0], far, [20.0, 1.0, 20.0, 1.0 + across], [8.0, 2.0 + across, 8.0, 2.0]])
    at = pose(float(rng.uniform(6.0, 18.0)), 1.5, float(rng.uniform(-3.0, 3.0)))
    ends = seen(walls, at, noise=0.01, seed=seed)[0][: int(rng.integers(2, 5))]
    sigma = (None, 0.0, 0.1, 0.3)[int(rng.integers(4))]
    result = answer_of(map_of(walls, sigma), scan_of(ends))
    if result.usable:
        assert result.covariance is not None
        assert math.sqrt(np.linalg.eigvalsh(result.covariance[:2, :2]).max()) <= 0.5


def test_a_window_that_does_not_hold_the_truth_is_contradicted() -> None:
    """What slides along a corridor inside of the window stood for the better pose 8 m away."""
    walls = np.array([[0, 0, 30, 0], [30, 0, 30, 2], [30, 2, 14, 2], [14, 2, 14, 5], [12, 5, 12, 2], [12, 2, 0, 2]])
    at = pose(13.0, 1.0, 0.1)
    scan = scan_of(seen(walls, at, noise=0.01, radius=9.0, seed=1)[0])
    assert same_pose(pose_in(answer_of(index_of(walls), scan)), at)
    result = answer_of(index_of(walls), scan, HardPrior(pose(21.0, 1.0, 0.1), 2.0, 0.3))
    assert not result.usable
    assert "prior_contradicted" in [reason.code for reason in result.reasons]
