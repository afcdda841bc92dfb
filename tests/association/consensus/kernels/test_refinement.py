"""A consensus set grows and shrinks as its reference's, which solves again from nothing in every round."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import example, given, settings
from numpy.typing import ArrayLike

from association import Scan
from association.consensus.kernels import matching, pair_sums, refinement, scoring, wall_errors
from association.consensus.tuning import MAX_STEP, MAX_TURN, ROUNDS, SPRING
from association.layout import MATCH, Integers
from association.tables import Place, Workspace
from registration import MeasuredSegments, RigidTransform, Segments
from registration.kernels import joint_cost, joint_information
from registration.layout import JOINT_SUMS, SYMMETRIC3, Floats, Records

from ...kernels.drawn import ASKED, GATES, INDEX, MODEL, PLACE, SEEDS, SMALL, covariance, drawn, workspace_of
from ...records import assert_records, covariance_of, estimate_of, pose_of, work_of
from ...reference import consensus as twin
from ...reference import proposing
from ...reference.geometry import moved
from ...reference.matching import match_scan
from ...scenes import context_of, index_of, local, pose, same_pose, scan_of

NO_TIES = np.full(1, -1.0)


def test_covariance_about_a_point() -> None:
    """As its reference has it, and the covariance of the place of the point that is held is 0."""
    out = np.zeros(1, SYMMETRIC3)
    scoring.covariance_about(0.01, 2.0, -3.0, out[0])
    got = covariance_of(out[0])
    np.testing.assert_allclose(got, proposing.turning(0.01, np.array([2.0, -3.0])), rtol=1e-15)
    at_pin = np.array([[1.0, 0.0, 3.0], [0.0, 1.0, 2.0]])  # derivative of R p + t by (x, y, theta), R p = (2, -3)
    np.testing.assert_allclose(at_pin @ got @ at_pin.T, 0.0, atol=1e-15)


@dataclass(frozen=True)
class Some:
    """Scan lines on some of the walls, several on one.

    Attributes
    ----------
    scan : (n,) of `SCAN_LINE`
    walls : (3,) of `WALL`
    held : (n,) which wall each line lies on, or -1
    at : RigidTransform
    variance : float
        Of a wall's own error, m^2.
    ties : (3,) of the walls
    """

    scan: Records
    walls: Records
    held: Integers
    at: RigidTransform
    variance: float
    ties: Floats

    @classmethod
    def drawn(cls, seed: int) -> Some:
        """Draw them; no line lies as its wall does."""
        d = drawn(seed)
        walls = d.rng.choice(PLACE.walls, 3, replace=False)
        held = d.rng.integers(-1, 3, len(d.scan))
        held[0] = 0
        ties = d.rng.choice([-1.0, 0.0, 0.02, 0.3, 2.0, 40.0], 3)
        return cls(d.scan, walls, held, d.near(), float(10.0 ** d.rng.uniform(-5.0, -1.0)), ties)

    @property
    def pairs(self) -> twin.Pairs:
        return twin.Pairs.of(self.scan, self.held, self.walls, self.variance, self.ties)

    def summed(self, *before: Integers) -> Workspace:
        """Return a workspace with the sums of these pairs, which held other pairs before."""
        work = work_of(len(self.scan), len(self.walls))
        pair_sums.empty_sums(work)
        for held in (*before, self.held):
            pair_sums.update_pairs(self.scan, twin.matches_on(held), self.walls, work)
        wall_errors.eliminate_wall_errors(work, self.ties, self.variance)
        return work


@given(SEEDS)
@settings(max_examples=40, deadline=None)
def test_sums_are_those_of_the_full_covariance(seed: int) -> None:
    """At any pose the cost of a set, and its information, whatever pairs came and went before."""
    some = Some.drawn(seed)
    rng = np.random.default_rng(seed)
    sums = some.summed(*rng.integers(-1, 3, (5, len(some.scan)))).scratch["sums"]
    assert sums["count"][0] == (some.held >= 0).sum()
    for at in (some.at, moved(some.at, rng.normal(size=3)), pose()):
        assert joint_cost(sums[0], at.theta, at.x, at.y) == pytest.approx(some.pairs.cost(at), rel=1e-7)
        information = np.zeros(1, SYMMETRIC3)
        joint_information(sums[0], at.theta, information[0])
        expected = some.pairs.information(at.theta)
        np.testing.assert_allclose(covariance_of(information[0]), expected, rtol=1e-7, atol=1e-7 * expected.max())


@given(SEEDS)
@settings(max_examples=20, deadline=None)
def test_what_each_wall_has_in_the_sums(seed: int) -> None:
    """Walls without pairs have nothing, to the bit; and when all is started over, no wall has."""
    some = Some.drawn(seed)
    others = np.random.default_rng(seed).integers(-1, 3, (5, len(some.scan)))
    work, fresh = some.summed(*others), some.summed()
    assert_records(work.wall_sums, fresh.wall_sums, rtol=1e-9, atol=1e-7)
    for k in range(3):
        assert work.wall_sums["count"][k] == (some.held == k).sum()
        assert work.wall_sums["weight"][k] == pytest.approx(some.scan["weight"][some.held == k].sum())
        assert any(work.wall_sums[name][k] for name in ("c", "s", "x", "y", "one", "weight")) == (k in some.held)
    np.testing.assert_array_equal(work.held, some.held)
    assert not pair_sums.update_pairs(some.scan, twin.matches_on(some.held), some.walls, work)
    pair_sums.empty_sums(work)
    for left in (work.wall_sums[["c", "s", "x", "y", "one", "weight", "count"]], work.scratch["plain"]):
        assert not np.array(left.tolist()).any()
    assert (work.held == -1).all()


def test_pieces_of_one_wall_are_no_better_than_the_wall() -> None:
    """Of a thousand exact measurements of a wall, each of them fixes what is across it as well as the wall is known."""
    scan, walls = np.repeat(drawn(0).scan[:1], 1000), PLACE.walls[:1]
    scan["weight"], scan["centroid_x"], scan["centroid_y"] = 1e8, 0.0, 0.0
    for variance in (1e-4, 0.25):
        alone = Some(scan[:1], walls, np.zeros(1, int), pose(), variance, NO_TIES).summed()
        together = Some(scan, walls, np.zeros(1000, int), pose(), variance, NO_TIES).summed()
        for work in (alone, together):
            across = work.scratch["sums"]["xx"][0] + work.scratch["sums"]["yy"][0]
            assert across == pytest.approx(1.0 / variance, rel=1e-3)


@given(SEEDS)
@settings(max_examples=30, deadline=None)
def test_solve_pose(seed: int) -> None:
    """From where the pairs were seen; from far off, where the pose stays and the cost is that of it."""
    d = drawn(seed)
    matches, _ = match_scan(d.scan, d.at, SMALL, PLACE, GATES)
    some = Some(d.scan, PLACE.walls, matches["wall"], d.at, float(MODEL["wall_variance"][0]), PLACE.ties)
    if not (some.held >= 0).any():
        return
    work = some.summed()
    for start in (d.near(), d.near(0.01, 0.3, 0.3), moved(d.at, [0.25, 0.0, 0.0]), moved(d.at, [0.0, 1.5, 1.5])):
        expected, estimate = twin.solve(some.pairs, start), estimate_of(start)
        step = np.hypot(expected.pose.x - start.x, expected.pose.y - start.y)
        near = bool(step <= MAX_STEP and abs(expected.pose.theta - start.theta) <= MAX_TURN)
        got = scoring.solve_pose(
            work.scratch[0]["sums"], estimate[0], work.scratch[0]["information"], work.scratch[0]["terms"]
        )
        assert got is near
        assert same_pose(pose_of(estimate[0]), expected.pose if near else start, 1e-5, 1e-6)
        np.testing.assert_allclose(
            covariance_of(estimate[0]), np.linalg.inv(expected.information), rtol=1e-4, atol=1e-8
        )
        cost = expected.cost if near else some.pairs.cost(start)
        assert work.scratch["terms"]["chi_square"][0] == pytest.approx(cost, abs=1e-4, rel=1e-6)
    assert_records(work.scratch["sums"], some.summed().scratch["sums"], rtol=1e-9, atol=1e-6)


@given(SEEDS)
@settings(max_examples=30, deadline=None)
def test_score_pairs(seed: int) -> None:
    """Also of matches that cost more than they gain, on separate walls and next to others."""
    d = drawn(seed)
    variance = float(10.0 ** d.rng.uniform(-4.0, -1.0))
    wide = GATES.copy()
    wide["least_offset"], wide["least_angle"] = 0.4, 0.3
    d.scan["weight"] *= 10.0 ** d.rng.uniform(-2.0, 0.0)
    at = d.near(0.03, 0.1, 0.1)
    matches, _ = match_scan(d.scan, at, SMALL, PLACE, wide)
    # Lines are cut in two, so that walls have several of them.
    scan, matches = np.concatenate([d.scan, d.scan]), np.concatenate([matches, matches])
    matches["score"] = d.rng.normal(size=len(matches))  # of another pose
    # Some walls are one in part.
    ties = d.rng.choice([-1.0, 0.0, 0.1, 0.5, 3.0], len(PLACE.walls))
    place = PLACE._replace(ties=ties)
    work = Some(scan, PLACE.walls, matches["wall"], at, variance, ties).summed()
    got, expected = matches.copy(), matches.copy()
    total = scoring.score_pairs(scan, estimate_of(at)[0], place, variance, got, work)
    assert total == pytest.approx(twin.score_pairs(scan, at, place, variance, expected), abs=1e-9)
    assert_records(got, expected, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize(("share", "stays"), [(0.99, True), (1.01, False)])
def test_a_match_that_costs_what_it_gains_is_none(share: float, stays: bool) -> None:
    """Beside a wall of its own, by so much that half the square of the deviation is the gain."""
    index = index_of([[0.0, 0.0, 10.0, 0.0], [10.0, 0.0, 10.0, 10.0]])
    rows = context_of(index, scan_of([[2.0, 0.0, 6.0, 0.0]])).lines.rows
    variance = float(MODEL["wall_variance"][0])
    off = share * math.sqrt(2.0 * rows["gain"][0] * (1.0 / rows["weight"][0] + variance))
    at, walls = local(index, pose(0.0, off)), index.walls.rows
    matches = twin.matches_on(np.array([int(np.argmax(walls["dx"]))]), rows)
    work = Some(rows, walls, matches["wall"], at, variance, index.ties).summed()
    total = scoring.score_pairs(rows, estimate_of(at)[0], index.tables.place, variance, matches, work)
    assert (matches["wall"][0] >= 0, total > 0.0) == (stays, stays)
    assert matches["score"][0] == pytest.approx(rows["gain"][0] * (1.0 - share**2) if stays else 0.0)


def test_spring_and_clear_sums() -> None:
    """The spring costs the square of the distance from where it holds, and lets go without a trace."""
    sums = np.zeros(1, JOINT_SUMS)
    scoring.add_spring(sums[0], 2.0, -1.0, 1.0)
    assert joint_cost(sums[0], 0.7, 5.0, 3.0) == pytest.approx(SPRING * (3.0**2 + 4.0**2))
    assert joint_cost(sums[0], -0.7, 2.0, -1.0) == pytest.approx(0.0, abs=1e-12)
    scoring.add_spring(sums[0], 2.0, -1.0, -1.0)
    np.testing.assert_allclose(sums.view(float), 0.0, atol=1e-15)
    sums.view(float)[:] = 1.0
    pair_sums.clear_sums(sums[0])
    assert not sums.view(float).any()


def refine(
    rows: Records, estimate: Records, place: Place, matches: Records, work: Workspace, floor: float = 0.0
) -> float:
    """Match at a pose and refine it, (1,) of `ESTIMATE`; return the score."""
    matching.match_scan(rows, estimate[0], place, GATES[0], rows["gain"].copy(), 0.0, matches)
    return refinement.refine(rows, estimate[0], place, ASKED.terms[0], matches, work, floor)


@given(SEEDS)
@example(15105341)  # where a consensus set loses all its pairs
@settings(max_examples=20, deadline=None)
def test_refine(seed: int) -> None:
    """From poses that are a little off, and from some that are far off."""
    d = drawn(seed)
    work = workspace_of(d.scan)
    pair_sums.update_pairs(d.scan, twin.matches_on(d.rng.integers(-1, 9, len(d.scan))), PLACE.walls, work)
    work.scratch["terms"] = 1.0, 2.0, 3.0  # what another pose left behind
    for start in (d.near(), d.near(0.05, 0.2, 0.2), d.near(0.02, 4.0, 4.0)):
        spread = covariance(d.rng)
        expected = twin.refine(d.scan, start, spread, PLACE, GATES, MODEL, ROUNDS)
        for floor in (0.0, max(0.0, expected.score - 1e-2)):
            estimate, matches = estimate_of(start, spread), np.zeros(len(d.scan), MATCH)
            got = refine(d.scan, estimate, PLACE, matches, work, floor)
            rounding = 100.0 if expected.free else 1.0
            assert got == pytest.approx(expected.score, abs=1e-4 * rounding)
            assert same_pose(pose_of(estimate[0]), expected.pose, 1e-5 * rounding, 1e-6 * rounding)
            np.testing.assert_allclose(covariance_of(estimate[0]), expected.covariance, rtol=1e-4 * rounding, atol=1e-8)
            np.testing.assert_array_equal(matches["wall"], expected.matches["wall"])
            np.testing.assert_allclose(matches["score"], expected.matches["score"], atol=1e-4 * rounding)
            gain, chi_square, log_determinant = work.scratch["terms"][0].item()
            assert (
                got == pytest.approx(max(0.0, gain - 0.5 * chi_square - log_determinant))
                or not (matches["wall"] >= 0).any()
            )
        assert refine(d.scan, estimate_of(start, spread), PLACE, matches, work, gain + 1e-6) == 0.0


def test_refine_finds_the_pose_again() -> None:
    """From 10 cm and 1 degree off, the consensus set grows back to all walls that were seen."""
    d = drawn(7, radius=12.0)
    estimate = estimate_of(moved(d.at, [0.017, 0.07, -0.07]), np.diag([0.01, 0.01, 4e-4]))
    matches = np.zeros(len(d.scan), MATCH)
    refine(d.scan, estimate, PLACE, matches, workspace_of(d.scan))
    assert same_pose(pose_of(estimate[0]), d.at, 0.03, 0.005)
    expected = np.full(len(d.scan), -1)
    expected[d.row_of[d.truth >= 0]] = INDEX.wall_of_piece[d.truth[d.truth >= 0]]
    np.testing.assert_array_equal(matches["wall"][expected >= 0], expected[expected >= 0])


def refined(walls: ArrayLike, scan: Scan, start: RigidTransform) -> tuple[float, RigidTransform]:
    """Return the score and the pose, in the map frame, of a pose that comes without a covariance."""
    index = index_of(walls)
    rows = context_of(index, scan).lines.rows
    estimate, matches, work = (
        estimate_of(local(index, start), SMALL),
        np.zeros(len(rows), MATCH),
        workspace_of(rows, index),
    )
    score = refine(rows, estimate, index.tables.place, matches, work)
    x, y = index.origin
    return score, moved(pose_of(estimate[0]), [0.0, x, y])


@pytest.mark.parametrize(("off", "stays"), [(0.02, False), (0.06, True)])
def test_a_set_that_would_carry_its_pose_far_away_leaves_it(off: float, stays: bool) -> None:
    """Two walls 30 mrad apart: what is seen `off` next to one of them puts the crossing 33 times as far along."""
    walls = [[0.0, 0.0, 10.0, 0.0], [10.0, 3.0, 0.0, 3.3]]
    seen = [[2.0, 0.0, 8.0, 0.0], [8.0, 3.06 + off, 2.0, 3.24 + off]]
    score, at = refined(walls, scan_of(seen), pose())
    assert score > 10.0
    assert same_pose(at, pose(), 1e-9, 1e-9) is stays


@pytest.mark.parametrize(("off", "stays"), [(0.15, False), (0.25, True)])
def test_a_set_that_would_turn_its_pose_far_leaves_it(off: float, stays: bool) -> None:
    """A short segment knows so little of its angle that its gate is wide."""
    score, at = refined(
        [[0.0, 0.0, 10.0, 0.0]], scan_of([[4.75, 0.0, 5.25, 0.0]], 0.06), pose(5.0, 0.0, off).compose(pose(-5.0))
    )
    assert score > 0.0
    assert at.theta == pytest.approx(off if stays else 0.0, abs=0.01)


def test_a_set_that_does_not_fix_the_rotation_scores_nothing() -> None:
    """A segment that is known by one point, where the sensor stands."""
    seen = Segments.from_array([[-0.5, 0.0, 0.5, 0.0]])
    point = MeasuredSegments.from_segments(seen, 0.02, moments=(np.zeros((1, 2)), np.zeros(1)))
    assert refined([[0.0, 0.0, 10.0, 0.0]], Scan(point), pose(5.0, 0.0))[0] == 0.0
