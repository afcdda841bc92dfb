import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vectorization._fit_kernels import BEGIN, CHI2, COUNT, END, LINE, MEAN, NX, NY, SPREAD, WEIGHT, P, fit_line, line_of
from vectorization._kernels import (
    best_break,
    farthest_point,
    find_gaps,
    merge,
    running_sums,
    settle_breaks,
    split,
    stretch_cost,
    sums_cost,
)
from vectorization._ray_kernels import (
    MEDIAN_CHI,
    TRUSTED,
    TRUSTED_MEAN_SQUARE,
    WINDOW,
    clean,
    gather,
    quantum,
    ray_noise,
    window_noise,
)
from vectorization._trace_kernels import WORST_ANGLE, WORST_FIT, acceptable, large_enough

from . import reference

VARIANCE = 0.02**2
FLOOR = 0.003**2

seeds = st.integers(0, 100_000)


def drawn(seed, n=40, isotropic=False):
    """A noisy scan of a jagged wall with a gap or two: points and rays."""
    rng = np.random.default_rng(seed)
    angles = np.cumsum(rng.choice([0.01, 0.01, 0.01, 0.02], n))
    knots = rng.uniform(2, 4, 6) + 3 * (rng.random(6) < 0.2)
    ranges = np.interp(angles, np.linspace(angles[0], angles[-1], 6), knots) + rng.normal(0, 0.02, n)
    rays = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return ranges[:, None] * rays, np.zeros_like(rays) if isotropic else rays


def columns(points, rays):
    return (*np.ascontiguousarray(points.T), *np.ascontiguousarray(rays.T))


@settings(deadline=None, max_examples=40)
@given(seed=seeds, isotropic=st.booleans(), a=st.integers(0, 30), length=st.integers(0, 40))
def test_the_cost_of_a_stretch_comes_from_running_sums(seed, isotropic, a, length):
    points, rays = drawn(seed, isotropic=isotropic)
    b = min(40, a + length)
    sums = running_sums(*columns(points, rays))
    expected = reference.stretch_cost(points[a:b], rays[a:b], VARIANCE, FLOOR)
    assert stretch_cost(sums, a, b, VARIANCE, FLOOR) == pytest.approx(expected, rel=1e-6, abs=1e-6)
    assert sums_cost(sums[b] - sums[a], VARIANCE, FLOOR) == stretch_cost(sums, a, b, VARIANCE, FLOOR)


@settings(deadline=None, max_examples=40)
@given(seed=seeds, increment=st.sampled_from([0.0, 0.01]), max_gap=st.sampled_from([0.05, math.inf]))
def test_gaps_are_where_the_twin_finds_them(seed, increment, max_gap):
    points, rays = drawn(seed)
    starts = find_gaps(*columns(points, rays), increment, 0.02, 0.1, max_gap)
    assert starts.tolist() == reference.find_gaps(points, rays, increment, 0.02, 0.1, max_gap)


@settings(deadline=None, max_examples=40)
@given(seed=seeds, isotropic=st.booleans())
def test_the_farthest_point_is_the_twins(seed, isotropic):
    points, rays = drawn(seed, isotropic=isotropic)
    k, square = farthest_point(*columns(points, rays), 0, len(points), VARIANCE, FLOOR)
    expected_k, expected_square = reference.farthest_point(points, rays, VARIANCE, FLOOR)
    assert k == expected_k
    assert square == pytest.approx(expected_square)


@settings(deadline=None, max_examples=40)
@given(seed=seeds)
def test_pieces_cover_the_points_and_are_merged_and_settled_as_by_the_twin(seed):
    points, rays = drawn(seed)
    xy = columns(points, rays)
    gaps = find_gaps(*xy, 0.01, 0.02, 0.0, math.inf)
    sums = running_sums(*xy)
    pieces = split(*xy, sums, gaps, VARIANCE, FLOOR)
    assert pieces[0, 0] == 0
    assert pieces[-1, 1] == len(points)
    np.testing.assert_array_equal(pieces[1:, 0], pieces[:-1, 1])
    assert set(gaps) <= set(pieces[:, 0])
    left = merge(pieces, sums, gaps, VARIANCE, FLOOR)
    assert [tuple(p) for p in left] == reference.merge(pieces, points, rays, set(gaps), VARIANCE, FLOOR)
    expected = reference.settle_breaks(left, points, rays, set(gaps), VARIANCE, FLOOR)
    before = [tuple(p) for p in left]
    moved = settle_breaks(left, sums, gaps, VARIANCE, FLOOR)
    assert [tuple(p) for p in left] == expected
    assert moved == (before != expected)


def test_the_best_break_of_a_corner_is_the_corner():
    points = np.vstack(
        [np.stack([np.arange(10.0), np.zeros(10)], 1), np.stack([np.full(8, 9.5), np.arange(1.0, 9)], 1)]
    )
    sums = running_sums(*columns(points, np.zeros_like(points)))
    assert best_break(sums, 0, 18, 3, 15, 1, VARIANCE, FLOOR) == (10, pytest.approx(0.0, abs=1e-6))


def noisy_wall(seed, n=60, sigma=0.02):
    rng = np.random.default_rng(seed)
    angle, distance = rng.uniform(-3, 3), rng.uniform(1, 4)
    angles = angle + np.linspace(-0.9, rng.uniform(0.3, 1.2), n)
    rays = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    ranges = distance / (rays @ [np.cos(angle), np.sin(angle)]) + rng.normal(0, sigma, n)
    return ranges, rays


@settings(deadline=None, max_examples=40)
@given(seed=seeds)
def test_the_fitted_line_is_the_most_likely_one_and_carries_its_information(seed):
    ranges, rays = noisy_wall(seed)
    xy = columns(ranges[:, None] * rays, rays)
    line = np.empty(LINE)
    line[[NX, NY, P]] = line_of(running_sums(*xy)[-1])
    line[MEAN] = 0.0
    own = np.zeros(len(ranges), dtype=bool)
    # A variance this large lets no point be gated out; it cancels in the estimate.
    assert fit_line(*xy, 0, len(ranges), 1.0, 0.0, line, own)
    assert own.all()
    assert line[COUNT] == len(ranges)
    (angle, distance), information = reference.fit_line(ranges, rays, math.atan2(line[NY], line[NX]), line[P])
    assert math.atan2(line[NY], line[NX]) == pytest.approx(angle, abs=1e-5)
    assert line[P] == pytest.approx(distance, abs=1e-5)
    # The information of (angle, distance): weight, weight times mean, and weight times the second moment about 0.
    w, m = line[WEIGHT], line[MEAN]
    expected = [[w * (line[SPREAD] + m * m), -w * m], [-w * m, w]]
    np.testing.assert_allclose(np.abs(information), np.abs(expected), rtol=1e-3, atol=1e-3 * w)
    residuals = ranges - line[P] / (rays @ line[[NX, NY]])
    assert line[CHI2] == pytest.approx(residuals @ residuals, rel=1e-4)


def test_a_point_off_the_line_does_not_pull_it():
    ranges, rays = noisy_wall(1, sigma=0.0)
    exact = ranges[:, None] * rays
    xy = columns(exact, rays)
    line = np.empty(LINE)
    line[[NX, NY, P]] = line_of(running_sums(*xy)[-1])
    line[MEAN] = 0.0
    expected = line[[NX, NY, P]].copy()
    ranges[20] += 0.5
    own = np.zeros(len(ranges), dtype=bool)
    fit_line(*columns(ranges[:, None] * rays, rays), 0, len(ranges), VARIANCE, FLOOR, line, own)
    assert np.flatnonzero(~own).tolist() == [20]
    np.testing.assert_allclose(line[[NX, NY, P]], expected, atol=1e-9)


@settings(deadline=None, max_examples=40)
@given(seed=seeds)
def test_the_noise_estimates_are_the_twins(seed):
    points, rays = drawn(seed)
    ranges = np.linalg.norm(points, axis=1)
    angles = np.arctan2(rays[:, 1], rays[:, 0])
    expected = reference.ray_noise(ranges, angles, 0.01, TRUSTED, TRUSTED_MEAN_SQUARE)
    assert ray_noise(ranges, *np.ascontiguousarray(rays.T), 0.01) == pytest.approx(expected)
    expected = reference.window_noise(points, WINDOW, MEDIAN_CHI)
    assert window_noise(*np.ascontiguousarray(points.T)) == pytest.approx(expected)


@pytest.mark.parametrize("sigma", [0.005, 0.02, 0.05])
def test_the_noise_of_a_wall_is_found(sigma):
    ranges, rays = noisy_wall(4, 4000, sigma)
    step = math.acos(rays[0] @ rays[1])
    assert ray_noise(ranges, *np.ascontiguousarray(rays.T), step) == pytest.approx(sigma, rel=0.08)


def test_too_few_points_say_nothing_of_noise():
    ranges, rays = noisy_wall(4, 9)
    assert ray_noise(ranges, *np.ascontiguousarray(rays.T), 1.0) == 0.0
    assert window_noise(*np.ascontiguousarray((ranges[:, None] * rays).T)) == 0.0


@settings(deadline=None, max_examples=40)
@given(seed=seeds, backward=st.booleans(), closed=st.booleans(), lost=st.floats(0, 1))
def test_beams_are_gathered_as_by_the_twin(seed, backward, closed, lost):
    rng = np.random.default_rng(seed)
    ranges = rng.uniform(1, 5, 30)
    ranges[rng.random(30) < lost] = rng.choice([np.nan, np.inf])
    angles = np.arange(30) * (-0.2 if backward else 0.2)
    order, r, rays, points = gather(ranges, np.cos(angles), np.sin(angles), backward, closed)
    expected_order, expected_r, expected_rays = reference.gather(ranges, angles, backward, closed)
    np.testing.assert_array_equal(order, expected_order)
    np.testing.assert_array_equal(r, expected_r)
    np.testing.assert_array_equal(rays, expected_rays)
    np.testing.assert_allclose(points, r * rays)


def test_ranges_are_cleaned_by_rep_117():
    ranges = np.array([np.nan, np.inf, -np.inf, 0.05, 0.0, -1.0, 0.1, 5.0, 5.01])
    cleaned = clean(ranges, 0.1, 5.0)
    np.testing.assert_array_equal(cleaned, [np.nan, np.inf, np.nan, np.nan, np.nan, np.nan, 0.1, 5.0, np.inf])


@pytest.mark.parametrize(
    ("ranges", "expected"),
    [([1.05, 2.1, 3.15], 1.05), ([1.0, 1.05, 3.2], 0.05), ([0.99, 1.0], 0.01), ([1.0, 1.00013], 0.0), ([], 0.0)],
)
def test_the_quantum_is_what_all_ranges_are_multiples_of(ranges, expected):
    assert quantum(np.array(ranges, dtype=np.float32).astype(np.float64)) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("place", "value", "accepted"),
    [
        (COUNT, 10.0, True), (COUNT, 9.0, False),
        (END, 0.49, False),
        (WEIGHT, 1.01 / (WORST_ANGLE**2 * 0.1), True), (WEIGHT, 0.99 / (WORST_ANGLE**2 * 0.1), False),
        (CHI2, 0.99 * WORST_FIT * 8, True), (CHI2, 1.01 * WORST_FIT * 8, False),
        (P, 0.0, False),
    ],
)  # fmt: skip
def test_a_line_is_accepted_for_its_points_length_angle_fit_and_side(place, value, accepted):
    line = np.zeros(LINE)
    line[[NX, P, SPREAD, WEIGHT, COUNT, CHI2, BEGIN, END]] = 1.0, 2.0, 0.1, 1e5, 10.0, 8.0, -0.5, 0.5
    line[place] = value
    assert (large_enough(line, 10, 1.0) and acceptable(line, True)) is accepted


def test_points_without_rays_may_lie_on_a_line_through_their_middle():
    line = np.zeros(LINE)
    line[[NX, P, SPREAD, WEIGHT, COUNT, CHI2, BEGIN, END]] = 1.0, 0.0, 0.1, 1e5, 10.0, 8.0, -0.5, 0.5
    assert acceptable(line, False)
