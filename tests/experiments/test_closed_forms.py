"""Cases whose numbers are known: Sec. 4.5, the misprints, the point-to-line method, rounding."""

import math

import numpy as np
import pytest

from experiments.constant_time import drawn_pairs
from experiments.icp import align, nearest
from experiments.mean_angles import CASES, examples, mitsuta, spread
from experiments.precision import translation as rounded_translation
from experiments.printed import FOLLOWED, ambiguity, exact_case, rotation, translation
from experiments.scenes import poses, world
from registration import OneStepSums, RigidTransform
from simulation import Scanner, scan
from tests.registration import reference


def test_the_papers_example_of_means():
    found = {angles: means for angles, *means in examples()}
    assert found["[0, 0, 90]"][0] == pytest.approx(30.0)
    assert found["[0, 0, 90]"][2] == pytest.approx(26.565, abs=1e-3)


def test_as_printed_the_mean_of_equal_angles_is_a_third():
    found = {angles: means for angles, *means in examples()}
    assert found["[10, 10, 10]"] == [pytest.approx(10.0), pytest.approx(10.0 / 3.0), pytest.approx(10.0)]
    # The paper's own example hides the misprint; in another order it does not.
    assert found["[0, 0, 90]"][1] == pytest.approx(30.0)
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


def test_the_nearest_segment_is_the_nearest():
    map = world("Pillars").segments
    points = np.random.default_rng(5).uniform(0.0, 4.0, (8, 2))
    indices, distances = nearest(points, map)
    for point, index, distance in zip(points, indices, distances, strict=True):
        each = []
        for row in map.endpoints:
            steps = np.linspace(0.0, 1.0, 5_001)[:, None]
            each.append(np.linalg.norm(row[:2] + steps * (row[2:] - row[:2]) - point, axis=1).min())
        assert distance == pytest.approx(min(each), abs=1e-3)
        assert each[index] == pytest.approx(min(each), abs=1e-3)


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
