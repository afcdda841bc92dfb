"""Poses are estimated as by the reference, which solves every set of pairs from the start."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, settings

from association.consensus.kernels.pose_estimation import estimate_poses, weakest_direction
from association.consensus.kernels.wall_errors import sort_by_ties
from association.consensus.tuning import FREE_DEVIATION, LEAST_KNOWN_VARIANCE, SORTED_BY_INSERTION, UNSEEN_ERROR
from association.layout import ESTIMATED, LEVERAGE, WALL, Integers
from association.tables import KnownWalls
from registration import RigidTransform
from registration.layout import Record, Records

from ...kernels.drawn import ASKED, PLACE, SEEDS, Drawn, drawn
from ...records import covariance_of, estimate_of, pose_of, work_of
from ...reference import pose_estimation as twin
from ...reference.consensus import matches_on
from ...reference.geometry import direction, normal
from ...scenes import pose, same_pose


@dataclass(frozen=True)
class Set:
    """Scan lines on walls, near which they lie, and a pose to begin at."""

    scan: Records
    walls: Records
    held: Integers
    start: RigidTransform

    def estimated(self, map_variance: float = -1.0) -> tuple[Record, Records]:
        """Return `ESTIMATED` and the leverages."""
        out, leverages = np.zeros(1, ESTIMATED), np.zeros(len(self.scan), LEVERAGE)
        question, work = ASKED._replace(scan=self.scan), work_of(len(self.scan), len(self.walls))
        start, matches = estimate_of(self.start), matches_on(self.held)[None]
        count = estimate_poses(question, known_walls(self, map_variance), matches, start, out, 0, leverages, work)
        assert start == estimate_of(self.start)
        return out[0], leverages[:count]


def known_walls(one: Set, map_variance: float = -1.0) -> KnownWalls:
    return KnownWalls(one.walls, np.full(len(one.walls), -1.0), map_variance)


def laid_on(walls: Records, held: Integers, at: RigidTransform, d: Drawn, wall_error: float, noise: float) -> Records:
    """Return the first scan lines of `d` moved onto walls that are off by so much, with that noise of each line."""
    scan = d.scan[: len(held)].copy()
    scan["weight"] = 1.0 / (0.01**2 + 0.02**2 / d.rng.uniform(10.0, 60.0, len(held)))
    errors = dict(zip(range(len(walls)), d.rng.normal(0.0, wall_error, len(walls)).tolist(), strict=True))
    back = at.inverse()
    for line, w in zip(scan, held.tolist(), strict=True):
        if w < 0:
            continue
        wall, along = walls[w], d.rng.uniform(walls[w]["begin"], walls[w]["end"])
        off = wall["offset"] + errors[w] + d.rng.normal(0.0, noise)
        line["centroid_x"], line["centroid_y"] = back.apply(along * direction(wall) + off * normal(wall))
        turn = wall["angle"] - at.theta + d.rng.normal(0.0, noise / math.sqrt(line["spread"]))
        line["dx"], line["dy"] = math.cos(turn), math.sin(turn)
    return scan


def some(seed: int, wall_error: float = 0.03) -> Set:
    """Draw a set of up to 14 lines on up to 6 walls, some of them on none."""
    d = drawn(seed, clutter=6)
    walls = d.rng.choice(PLACE.walls, 6, replace=False)
    held = d.rng.integers(-1, 6, min(14, len(d.scan)))
    held[:3] = [0, 1, 2]
    return Set(laid_on(walls, held, d.at, d, wall_error, 0.01), walls, held, d.near(0.01, 0.05, 0.05))


@given(SEEDS)
@settings(max_examples=40, deadline=None)
def test_a_pose_is_estimated_as_by_the_twin(seed: int) -> None:
    """With what is known of the walls, or what their residuals show."""
    one = some(seed)
    for known in (None, 0.0, 0.05**2):
        got, _ = one.estimated(-1.0 if known is None else known)
        expected = twin.estimate_poses(one.scan, one.held, one.walls, one.start, known)
        # What the spring alone holds is moved by rounding.
        if max(got["weakest"], math.sqrt(np.linalg.norm(expected.at.covariance))) > 1.0:
            continue
        assert got["wall_variance"] == pytest.approx(expected.variance, rel=1e-5)
        assert same_pose(pose_of(got["pose"]), expected.at.pose, 1e-6, 1e-7)
        np.testing.assert_allclose(covariance_of(got["pose"]), expected.at.covariance, rtol=1e-4, atol=1e-9)
        assert got["weakest"] == pytest.approx(expected.weakest, rel=1e-5)
        across = got["dx"] * expected.direction[1] - got["dy"] * expected.direction[0]
        assert abs(across) < 1e-3 or expected.weakest < 1e-3 or is_round(one, known)
        assert got["parallel"] == expected.parallel


def is_round(one: Set, known: float | None) -> bool:
    """Tell whether all directions are about as weak, so that rounding tells which is weakest."""
    at = twin.estimate_poses(one.scan, one.held, one.walls, one.start, known).at
    low, high = np.linalg.eigvalsh(at.covariance[:2, :2])
    return bool(high < 1.2 * low)


@given(SEEDS)
@settings(max_examples=40, deadline=None)
def test_what_the_pose_would_be_without_a_wall(seed: int) -> None:
    """As solved again from the others alone; walls in the order in which the lines lie on them."""
    one = some(seed)
    _, leverages = one.estimated(0.02**2)
    expected = twin.estimate_poses(one.scan, one.held, one.walls, one.start, 0.02**2).leverages
    assert leverages["wall"].tolist() == [leverage.wall for leverage in expected]
    for got, leverage in zip(leverages, expected, strict=True):
        if leverage.deviation < 1.0:  # else rounding moves it
            assert got["displacement"] == pytest.approx(leverage.moves, rel=1e-4, abs=1e-6)
            assert got["deviation"] == pytest.approx(leverage.deviation, rel=1e-4)
        else:
            assert got["deviation"] > 0.9
        if leverage.moves > 1.1 * leverage.deviation:
            assert [got["dx"], got["dy"]] == pytest.approx(leverage.direction.tolist(), abs=1e-4)


def test_leverages_begin_at_any_wall() -> None:
    one = some(7)
    everything, every = one.estimated(0.02**2)
    out, leverages = np.zeros(1, ESTIMATED), np.zeros(2, LEVERAGE)
    question, work = ASKED._replace(scan=one.scan), work_of(len(one.scan), len(one.walls))
    matches, start = matches_on(one.held)[None], estimate_of(one.start)
    assert (
        estimate_poses(question, known_walls(one, 0.02**2), matches, start, out, 1, leverages, work) == len(every) > 3
    )
    assert out == everything
    np.testing.assert_array_equal(leverages, every[1:3])


@pytest.mark.parametrize("count", [0, 1, 2, SORTED_BY_INSERTION, SORTED_BY_INSERTION + 1, 300])
def test_walls_are_put_in_order_along_their_chains(count: int) -> None:
    rng = np.random.default_rng(count)
    ties, walls = rng.integers(0, 40, 400) / 7.0, rng.permutation(400)[:count]
    expected = walls[np.argsort(ties[walls], kind="stable")]
    sort_by_ties(walls, ties)
    np.testing.assert_array_equal(walls, expected)


def test_several_sets_are_each_estimated_as_if_alone() -> None:
    """Leverages are those of the first."""
    one = some(7)
    helds = np.stack([one.held[::-1], one.held])
    out, leverages = np.zeros(2, ESTIMATED), np.zeros(len(one.scan), LEVERAGE)
    starts = np.concatenate([estimate_of(one.start)] * 2)
    question, work = ASKED._replace(scan=one.scan), work_of(len(one.scan), len(one.walls))
    matches = np.stack([matches_on(held) for held in helds])
    count = estimate_poses(question, known_walls(one), matches, starts, out, 0, leverages, work)
    for k, held in enumerate(helds):
        alone, without = Set(one.scan, one.walls, held, one.start).estimated()
        assert out[k] == alone
        if k == 0:
            np.testing.assert_array_equal(leverages[:count], without)
    assert out[0] != out[1]


def crossing_walls(*angles: float) -> Records:
    """Return walls of 6 m through the origin."""
    walls = np.zeros(len(angles), WALL)
    walls["dx"], walls["dy"], walls["angle"], walls["begin"], walls["end"] = (
        np.cos(angles),
        np.sin(angles),
        angles,
        -3,
        3,
    )
    return walls


def test_without_the_only_wall_across_a_corridor_the_place_is_free_along_it() -> None:
    d = drawn(1)
    walls, held, at = crossing_walls(0.0, 0.0, math.pi / 2), np.array([0, 1, 2]), pose(0.3, 0.2, 0.1)
    one = Set(laid_on(walls, held, at, d, 0.0, 0.0), walls, held, at)
    estimated, leverages = one.estimated(0.0)
    assert estimated["weakest"] < 0.1
    assert leverages["deviation"] == pytest.approx([0.0, 0.0, FREE_DEVIATION], abs=0.05)
    assert [abs(leverages["dx"][2]), abs(leverages["dy"][2])] == pytest.approx([1.0, 0.0], abs=1e-6)
    assert leverages["displacement"] == pytest.approx([0.0] * 3, abs=1e-6)


def test_a_wall_that_is_off_moves_the_pose_by_so_much() -> None:
    """Two walls across hold the place in the middle of 20 cm; without either it is where the other one is."""
    d = drawn(1)
    walls, held, at = crossing_walls(0.0, math.pi / 2, math.pi / 2), np.array([0, 1, 2]), pose()
    scan = laid_on(walls, held, at, d, 0.0, 0.0)
    scan["weight"], scan["spread"] = 9e3, 1e3
    walls["offset"][2] = 0.2
    estimated, leverages = Set(scan, walls, held, at).estimated(0.0)
    assert pose_of(estimated["pose"]).x == pytest.approx(-0.1, abs=1e-3)
    assert leverages["displacement"] == pytest.approx([0.0, 0.1, 0.1], abs=2e-3)
    assert leverages["dx"][1:].tolist() == pytest.approx([-1.0, 1.0], abs=1e-3)


def test_the_weakest_direction() -> None:
    covariance = np.zeros((3, 3))
    turn = np.array([[math.cos(0.7), -math.sin(0.7)], [math.sin(0.7), math.cos(0.7)]])
    covariance[:2, :2] = turn @ np.diag([0.09, 0.01]) @ turn.T
    deviation, dx, dy = weakest_direction(estimate_of(pose(), covariance)[0])
    assert deviation == pytest.approx(0.3)
    assert abs(dx * math.sin(0.7) - dy * math.cos(0.7)) < 1e-9


@pytest.mark.parametrize("wall_error", [0.01, 0.02, 0.05])
def test_the_error_of_many_walls_is_estimated_from_their_residuals(wall_error: float) -> None:
    """The mean of 300 sets of 60 walls is within a tenth of it, with what is added for those that match nothing."""
    estimates = []
    for seed in range(300):
        d = drawn(seed)
        held = np.arange(60)
        d = Drawn(d.rng, d.endpoints, d.truth, d.row_of, np.resize(d.scan, 60), d.at)
        scan = laid_on(PLACE.walls, held[: len(PLACE.walls)], d.at, d, wall_error, 0.0)
        # Each line has the noise that its weight states.
        scan = with_noise(scan, PLACE.walls, d, wall_error)
        found, _ = Set(scan, PLACE.walls, held[: len(scan)], d.at).estimated()
        estimates.append(math.sqrt(found["wall_variance"]))
    assert np.mean(estimates) == pytest.approx(math.sqrt(UNSEEN_ERROR) * wall_error, rel=0.1)


def with_noise(scan: Records, walls: Records, d: Drawn, wall_error: float) -> Records:
    """Move each line across its wall, and turn it, by what its weight says."""
    deviations = 1.0 / np.sqrt(twin.reweighted(scan, wall_error**2)["weight"])
    for k, line in enumerate(scan):
        across = d.at.inverse().theta + walls[k]["angle"] + math.pi / 2
        off = d.rng.normal(0.0, deviations[k])
        line["centroid_x"] += off * math.cos(across)
        line["centroid_y"] += off * math.sin(across)
        turn = math.atan2(line["dy"], line["dx"]) + d.rng.normal(0.0, deviations[k]) / math.sqrt(line["spread"])
        line["dx"], line["dy"] = math.cos(turn), math.sin(turn)
    return scan


def test_what_few_walls_show_is_shrunk_to_what_is_usual() -> None:
    """Two walls that fit exactly do not make the walls exact; what is known of them stays."""
    d = drawn(1)
    walls, held, at = crossing_walls(0.0, math.pi / 2), np.array([0, 1]), pose()
    one = Set(laid_on(walls, held, at, d, 0.0, 0.0), walls, held, at)
    assert 0.015 < math.sqrt(one.estimated()[0]["wall_variance"]) < 0.06
    assert one.estimated(0.0)[0]["wall_variance"] == pytest.approx(LEAST_KNOWN_VARIANCE)
    assert one.estimated(0.07**2)[0]["wall_variance"] == pytest.approx(0.07**2)
