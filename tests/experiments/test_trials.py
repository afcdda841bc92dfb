"""Scans with their known walls, trials of them and their means; cases whose numbers are known."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from experiments.accuracy import (
    Means,
    correlation_over_poses,
    correlation_over_scans,
    correlation_pooled,
    correlation_within_poses,
    gain,
    means,
    over_bound,
    slopes,
)
from experiments.constant_time import drawn_pairs
from experiments.icp import align
from experiments.mean_angles import CASES, examples, mitsuta, spread
from experiments.measuring import Setup, take
from experiments.precision import translation as rounded_translation
from experiments.printed import FOLLOWED, ambiguity, exact_case, rotation, translation
from experiments.scenes import NAMES, UNIT, bound, poses, world
from experiments.trials import ESTIMATORS, Condition, Trials, of_world, run
from registration import OneStepSums, RigidTransform, wrap_angle
from simulation import Scanner, scan
from tests.registration import reference

NOISE = (300, 3.0)
CUTS = {"vectorizer": Setup(), "walls": Setup(cut="walls")}


def measured(name, setup, seed=0, noise=NOISE, pose=0):
    truth = poses(name, setup.places)[pose]
    return truth, take(world(name), truth, noise, setup, np.random.default_rng(seed))


@pytest.mark.parametrize("cut", CUTS)
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("noise", ["range", "point"])
def test_each_segment_lies_on_the_wall_that_it_is_paired_with(cut, name, noise):
    setup = Setup(cut=CUTS[cut].cut, noise=noise, min_length=40.0)
    truth, scan_ = measured(name, setup, noise=(300, 1.0))
    segments = scan_.measured.segments.take(scan_.pairs[:, 0])
    walls = world(name).segments.take(scan_.pairs[:, 1])
    assert len(segments) >= 4
    ends = truth.apply(segments.endpoints.reshape(-1, 2, 2))
    distances = np.einsum("ijk,ik->ij", ends - walls.midpoints[:, None], walls.normals) / UNIT
    assert np.abs(distances).max() < 6.0
    angles = np.arctan2(*walls.directions.T[::-1]) - np.arctan2(*segments.directions.T[::-1]) - truth.theta
    assert max(abs(wrap_angle(a)) for a in angles) < math.radians(6.0)


def test_the_bound_is_that_of_the_ranges_derivatives():
    name, points, sigma, step = "Oblique", 60, 3.0, 1e-7
    # Turned a little, so that no beam ends in a corner.
    pose = poses(name)[4].compose(RigidTransform(0.0, 0.0, 0.01))
    scanner = Scanner.over(math.tau, points, sigma=0.0, range_max=100.0)

    def ranges(dx, dy, dt):
        moved = RigidTransform(pose.x + dx, pose.y + dy, pose.theta + dt)
        return scan(world(name).segments, moved, scanner).ranges / UNIT

    columns = [
        (ranges(*(step * e)) - ranges(*(-step * e))) / (2 * step) * scale
        for e, scale in zip(np.eye(3), (UNIT, UNIT, 1.0), strict=True)
    ]
    jacobian = np.stack(columns, axis=1)
    np.testing.assert_allclose(
        bound(name, pose, points, sigma), np.linalg.inv(jacobian.T @ jacobian / sigma**2), rtol=1e-4
    )


ALL = tuple(ESTIMATORS)
CORNERS = Setup(cut="walls", min_points=3, min_length=0.0)


def made(condition, errors, ambiguity, fixed=None, weights=None):
    errors = np.asarray(errors, float)
    shape = errors.shape[:3]
    return Trials(
        condition,
        errors=errors,
        own_errors=2.0 * errors,
        ambiguity=np.asarray(ambiguity, float),
        weights=np.ones(shape) if weights is None else weights,
        reliability=np.ones(shape),
        pairs=np.full(shape[:2], 5),
        fixed=np.ones(shape[:2], bool) if fixed is None else fixed,
        bounds=np.tile(np.diag([8.0, 8.0, 4.0]), (shape[0], 1, 1)),
    )


def drawn(seed=0, poses=4, scans=6):
    rng = np.random.default_rng(seed)
    condition = Condition("CutSquare", 300, 3.0, scans, 1)
    return made(condition, rng.normal(size=(poses, scans, 2, 3)), rng.uniform(1.0, 2.0, (poses, scans, 2, 2)))


def test_means_and_gains_of_known_numbers():
    errors = np.zeros((1, 2, 2, 3))
    errors[0, :, 0] = [[3.0, 4.0, 0.2], [0.0, 0.0, 0.0]]
    errors[0, :, 1] = [[3.0, 0.0, 0.1], [0.0, 0.0, 0.0]]
    ambiguity = np.array([[[[8.0, 4.0], [2.0, 1.0]], [[0.0, 0.0], [0.0, 0.0]]]])
    trials = made(Condition("CutSquare", 300, 3.0, 2, 1), errors, ambiguity)
    before = means(trials, "unweighted")
    assert (before.D_t, before.A_t, before.A_alpha) == (12.5, 4.0, 2.0)
    assert before.D_alpha == pytest.approx(0.02)
    ratios = gain([trials, trials])
    assert (ratios.D_t, ratios.D_alpha) == (pytest.approx(9 / 25), pytest.approx(1 / 4))
    assert (ratios.A_t, ratios.A_alpha) == (pytest.approx(1 / 4), pytest.approx(1 / 4))


def test_scans_that_fix_no_pose_do_not_count():
    trials = drawn()
    fixed = trials.fixed.copy()
    fixed[0, 0] = False
    wild = trials.errors.copy()
    wild[0, 0] = 1e6
    spoilt = dataclasses.replace(trials, errors=wild, fixed=fixed)
    assert means(spoilt, "unweighted").D_t < 10.0
    assert over_bound(spoilt, "unweighted")[0] < 10.0


def test_correlation_over_scans_poses_and_within():
    a = np.array([[1.0, 2.0, 3.0], [11.0, 12.0, 13.0], [21.0, 22.0, 23.0]])
    # Within each pose the error falls as the ambiguity grows; over the poses it grows.
    d = np.array([[3.0, 2.0, 1.0], [13.0, 12.0, 11.0], [23.0, 22.0, 21.0]])
    errors = np.zeros((3, 3, 2, 3))
    errors[..., 0, 0] = errors[..., 1, 0] = np.sqrt(d)
    errors[..., 0, 2] = np.sqrt(a)
    errors[..., 1, 2] = np.sqrt(a)
    ambiguity = np.repeat(np.repeat(a[:, :, None, None], 2, axis=2), 2, axis=3)
    trials = made(Condition("CutSquare", 300, 3.0, 3, 1), errors, ambiguity)
    assert correlation_within_poses(trials, "unweighted") == (pytest.approx(-1.0), pytest.approx(1.0))
    assert correlation_over_poses(trials, "weighted")[0] == pytest.approx(1.0)
    expected = np.corrcoef(a.ravel(), d.ravel())[0, 1]
    assert correlation_over_scans(trials, "unweighted")[0] == pytest.approx(expected)
    assert correlation_pooled([trials, trials], "unweighted")[0] == pytest.approx(expected)


def test_slopes_are_the_powers_of_points_and_noise():
    def with_means(points, sigma):
        value = 7.0 * points**-1.0 * sigma**2.0
        errors = np.zeros((1, 1, 2, 3))
        errors[..., 0] = errors[..., 2] = np.sqrt(value)
        return made(Condition("CutSquare", points, sigma, 1, 1), errors, np.full((1, 1, 2, 2), value))

    found = slopes([with_means(p, s) for p in (100, 300, 1000) for s in (1.0, 3.0)], "unweighted")
    for name in Means.__slots__:
        assert found[name] == (pytest.approx(-1.0), pytest.approx(2.0))


def test_over_the_bound():
    errors = np.zeros((2, 3, 2, 3))
    errors[..., 0], errors[..., 2] = 8.0, 6.0
    trials = made(Condition("CutSquare", 300, 3.0, 3, 1), errors, np.ones((2, 3, 2, 2)))
    assert over_bound(trials, "unweighted") == (pytest.approx(2.0), pytest.approx(3.0))


def test_the_same_condition_gives_the_same_scans_whatever_is_estimated():
    one = run(Condition("CutSquare", 200, 3.0, 2, 5, CORNERS))
    again = run(Condition("CutSquare", 200, 3.0, 2, 5, CORNERS, estimators=("joint", "weighted")))
    np.testing.assert_array_equal(one.errors[:, :, one.of("weighted")], again.errors[:, :, again.of("weighted")])
    other = run(Condition("CutSquare", 200, 3.0, 2, 6, CORNERS))
    assert not np.array_equal(one.errors, other.errors)
    assert of_world([one, other], "CutSquare") == [one, other]
    assert of_world([one], "Pillars") == []


def test_the_joint_estimator_reaches_the_bound_where_the_papers_does_not():
    trials = run(Condition("CutSquare", 300, 3.0, 40, 1, CORNERS, ALL))
    position, heading = over_bound(trials, "joint")
    # A plain total least squares line does not weigh noise along the ray by the cosine of incidence.
    assert 0.9 < position < 1.2
    assert 0.9 < heading < 1.2
    assert over_bound(trials, "unweighted")[0] > 1.3
    assert trials.fixed.all()


def test_as_printed_the_mean_of_equal_angles_is_a_third():
    found = {angles: means for angles, *means in examples()}
    assert found["[10, 10, 10]"] == [pytest.approx(10.0), pytest.approx(10.0 / 3.0), pytest.approx(10.0)]
    # The paper's own example hides the misprint; in another order it does not.
    assert found["[0, 0, 90]"] == pytest.approx([30.0, 30.0, 26.565], abs=1e-3)
    assert found["[90, 0, 0]"][1] == pytest.approx(0.0)


def test_mitsutas_mean_is_that_of_its_twin():
    rng = np.random.default_rng(1)
    for angles in rng.uniform(-math.pi, math.pi, (50, 6)):
        assert mitsuta(angles) == pytest.approx(reference.mitsuta(list(angles), np.ones(6))[0] / 6.0)
    across = np.array([[3.0, -3.1, 3.1], [0.1, 0.2, 0.3]])
    np.testing.assert_allclose(mitsuta(across), [(3.0 + (math.tau - 3.1) + 3.1) / 3.0, 0.2])


def test_deviations_of_the_means():
    limits = np.radians([10.0, 170.0])
    found = {name: spread(limits, 40_000, np.random.default_rng(2), turned) for name, turned in CASES.items()}
    one, all_ = found["one pair of 3 turned"], found["one segment of each of 10 pairs turned"]
    # Uniform noise of half width a deviates by a / sqrt(3); over a third of it, or over the root of ten.
    np.testing.assert_allclose(one["Mitsuta"], limits / math.sqrt(3.0) / 3.0, rtol=0.02)
    assert all_["Mitsuta"][0] == pytest.approx(limits[0] / math.sqrt(30.0), rel=0.02)
    for spreads in found.values():
        assert spreads["Wahba"][0] == pytest.approx(spreads["Mitsuta"][0], rel=0.02)
    assert one["Wahba"][1] < 0.8 * one["Mitsuta"][1]
    assert one["kurtosis"][0] == pytest.approx(-1.2, abs=0.05)
    assert all_["kurtosis"][0] == pytest.approx(-0.12, abs=0.06)


def test_what_each_misprint_gives_of_an_exact_scan():
    pairs, truth = exact_case()
    t = np.array([truth.x, truth.y])
    np.testing.assert_allclose(translation(pairs, FOLLOWED["corrected"]), t, atol=1e-9)
    np.testing.assert_allclose(translation(pairs, FOLLOWED["Eq. 1"]), -t, atol=1e-9)
    assert np.abs(translation(pairs, FOLLOWED["Eq. 8"]) - t).max() > 0.1
    assert rotation(pairs, FOLLOWED["corrected"]) == pytest.approx(truth.theta)
    assert rotation(pairs, FOLLOWED["Alg. 1"]) == pytest.approx(truth.theta / len(pairs))
    assert rotation(pairs, FOLLOWED["Eq. 15"]) == pytest.approx(-truth.theta)


def test_ambiguity_as_printed_holds_at_the_optimum_and_at_zero_only():
    pairs, truth = exact_case()
    best = np.array([truth.x, truth.y])
    sums = OneStepSums.of_set(pairs, np.ones(len(pairs)))
    for at in (np.zeros(2), best, best + np.array([0.1, 0.0])):
        right = sums.translation_cost(RigidTransform(*at, 0.0))
        assert ambiguity(pairs, at, as_printed=False) == pytest.approx(right, abs=1e-9)
        if at is best or not at.any():
            assert ambiguity(pairs, at, as_printed=True) == pytest.approx(right, abs=1e-9)
        else:
            assert ambiguity(pairs, at, as_printed=True) < -0.1


def test_icp_comes_home_from_near_and_not_from_anywhere():
    segments, truth = world("CutSquare").segments, poses("CutSquare")[2]
    points = scan(segments, truth, Scanner.over(math.tau, 300, sigma=0.0, range_max=100.0)).points
    near = align(points, segments, RigidTransform(truth.x + 0.2, truth.y - 0.1, truth.theta + 0.1))
    assert near.converged
    assert near.pose.x == pytest.approx(truth.x, abs=1e-6)
    assert near.pose.theta == pytest.approx(truth.theta, abs=1e-6)
    away = align(points, segments, RigidTransform(truth.x, truth.y, truth.theta + math.pi))
    assert abs(away.pose.theta - truth.theta) > 0.1


def test_float32_segments_lose_what_float64_sums_cannot_bring_back():
    truth = RigidTransform(1003.0, 698.0, 0.7)
    pairs = drawn_pairs(20_000, np.random.default_rng(6), truth)
    off = {}
    for types in ((np.float32, np.float32), (np.float32, np.float64), (np.float64, np.float64)):
        off[types] = np.hypot(*(rounded_translation(pairs, *types) - [truth.x, truth.y]))
    all32, mixed, all64 = off.values()
    assert all32 > 100.0 * mixed > 1e4 * all64
