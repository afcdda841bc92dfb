from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from registration.layout import Floats, Records
from vectorization import LaserScan
from vectorization.kernels import lines, pieces
from vectorization.kernels import rays as beams
from vectorization.layout import FITTED, PIECE, POINT, SCANNER, SUMS
from vectorization.tracing import noise_of_points, noise_of_ranges
from vectorization.tuning import (
    LEAST_SIGMA,
    MEDIAN_CHI,
    TRUSTED,
    TRUSTED_MEAN_SQUARE,
    UNKNOWN_SIGMA,
    WINDOW,
    WORST_ANGLE,
    WORST_FIT,
)

from . import reference

VARIANCE = 0.02**2
FLOOR = 0.003**2

seeds = st.integers(0, 100_000)


def drawn(seed: int, n: int = 40, isotropic: bool = False) -> tuple[Floats, Floats]:
    """A noisy scan of a jagged wall with a gap or two: points and rays."""
    rng = np.random.default_rng(seed)
    angles = np.cumsum(rng.choice([0.01, 0.01, 0.01, 0.02], n))
    knots = rng.uniform(2, 4, 6) + 3 * (rng.random(6) < 0.2)
    ranges = np.interp(angles, np.linspace(angles[0], angles[-1], 6), knots) + rng.normal(0, 0.02, n)
    rays = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return ranges[:, None] * rays, np.zeros_like(rays) if isotropic else rays


def records(points: Floats, rays: Floats) -> Records:
    """Return points (n, 2) and their rays as the kernels take them."""
    ranges = np.where((rays == 0).all(axis=1), 0.0, np.hypot(*points.T))
    return np.array([(*p, *u, r) for p, u, r in zip(points, rays, ranges, strict=True)], POINT)


def scanner_of(
    increment: float = 0.01,
    variance: float = VARIANCE,
    floor: float = FLOOR,
    default_gap: float = 0.0,
    max_gap: float = math.inf,
    least: tuple[int, float] = (3, 0.0),
) -> Records:
    """Return what is known of a scanner as the kernels take it."""
    values = (increment, math.sqrt(variance), variance, floor, default_gap, max_gap, 1.5, *least)
    return np.array([values], SCANNER)


def stretches(points: Records, scanner: Records) -> tuple[Records, NDArray[np.int64]]:
    """Return the running sums of points, and where their stretches without a gap begin."""
    sums, starts = np.zeros(len(points) + 1, SUMS), np.empty(len(points), np.int64)
    return sums, starts[: pieces.find_gaps(points, scanner, sums, starts)]


def line_with(**fields: float) -> Records:
    """Return a line whose other fields are 0."""
    line = np.zeros(1, FITTED)
    for name, value in fields.items():
        line[name] = value
    return line


def bounds(pieces: Records) -> list[tuple[int, int]]:
    """Return pieces as pairs."""
    return [(int(piece["first"]), int(piece["end"])) for piece in pieces]


@settings(deadline=None, max_examples=40)
@given(seed=seeds, increment=st.sampled_from([0.0, 0.01]), max_gap=st.sampled_from([0.05, math.inf]))
def test_gaps_are_where_the_twin_finds_them(seed: int, increment: float, max_gap: float) -> None:
    points, rays = drawn(seed)
    scanner = scanner_of(increment, default_gap=0.1, max_gap=max_gap)
    _, starts = stretches(records(points, rays), scanner)
    assert starts.tolist() == reference.find_gaps(points, rays, increment, 0.02, 0.1, max_gap)


@settings(deadline=None, max_examples=40)
@given(seed=seeds)
def test_pieces_cover_the_points_and_are_merged_and_settled_as_by_the_twin(seed: int) -> None:
    points, rays = drawn(seed)
    measured, scanner = records(points, rays), scanner_of()
    sums, gaps = stretches(measured, scanner)
    parts, stack, growth = np.empty(len(points), PIECE), np.empty(len(points), PIECE), np.empty(len(points))
    parts = parts[: pieces.split(measured, sums, gaps, scanner, parts, stack)]
    assert parts["first"][0] == 0
    assert parts["end"][-1] == len(points)
    np.testing.assert_array_equal(parts["first"][1:], parts["end"][:-1])
    assert set(gaps) <= set(parts["first"])
    before = bounds(parts)
    left = parts[: pieces.merge(parts, sums, gaps, scanner, growth)]
    assert bounds(left) == reference.merge(before, points, rays, set(gaps), VARIANCE, FLOOR)
    before = bounds(left)
    expected = reference.settle_breaks(before, points, rays, set(gaps), VARIANCE, FLOOR)
    moved = pieces.move_breaks(left, sums, gaps, scanner)
    assert bounds(left) == expected
    assert moved == (before != expected)


def noisy_wall(seed: int, n: int = 60, sigma: float = 0.02) -> tuple[Floats, Floats]:
    rng = np.random.default_rng(seed)
    angle, distance = rng.uniform(-3, 3), rng.uniform(1, 4)
    angles = angle + np.linspace(-0.9, rng.uniform(0.3, 1.2), n)
    rays = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    ranges = distance / (rays @ [np.cos(angle), np.sin(angle)]) + rng.normal(0, sigma, n)
    return ranges, rays


def fitted(points: Records, scanner: Records) -> Any:
    """Return the one line of all points."""
    sums, _ = stretches(points, scanner)
    whole, found = np.array([(0, len(points))], PIECE), np.zeros(1, FITTED)
    assert lines.fit_lines(points, whole, sums[-1:], scanner, np.zeros(len(points), np.bool_), found) == 1
    return found[0]


@settings(deadline=None, max_examples=40)
@given(seed=seeds)
def test_the_fitted_line_is_the_most_likely_one_and_carries_its_information(seed: int) -> None:
    ranges, rays = noisy_wall(seed)
    # A variance this large lets no point be gated out; it cancels in the estimate.
    line = fitted(records(ranges[:, None] * rays, rays), scanner_of(variance=1.0, floor=0.0))
    assert line["count"] == len(ranges)
    (angle, distance), information = reference.fit_line(ranges, rays, math.atan2(line["ny"], line["nx"]), line["p"])
    assert math.atan2(line["ny"], line["nx"]) == pytest.approx(angle, abs=1e-5)
    assert line["p"] == pytest.approx(distance, abs=1e-5)
    # The information of (angle, distance): weight, weight times mean, and weight times the second moment about 0.
    w, m = line["weight"], line["middle"]
    expected = [[w * (line["spread"] + m * m), -w * m], [-w * m, w]]
    np.testing.assert_allclose(np.abs(information), np.abs(expected), rtol=1e-3, atol=1e-3 * w)
    residuals = ranges - line["p"] / (rays @ [line["nx"], line["ny"]])
    assert line["chi2"] == pytest.approx(residuals @ residuals, rel=1e-4)


@settings(deadline=None, max_examples=40)
@given(seed=seeds)
def test_the_noise_estimates_are_the_twins(seed: int) -> None:
    points, rays = drawn(seed)
    ranges = np.linalg.norm(points, axis=1)
    angles = np.arctan2(rays[:, 1], rays[:, 0])
    expected = reference.ray_noise(ranges, angles, 0.01, TRUSTED, TRUSTED_MEAN_SQUARE)
    measured = records(points, rays)
    assert noise_of_ranges(measured, 0.01, measured) == pytest.approx(max(expected or UNKNOWN_SIGMA, LEAST_SIGMA))
    expected = reference.window_noise(points, WINDOW, MEDIAN_CHI)
    assert noise_of_points(points) == pytest.approx(max(expected, LEAST_SIGMA))


def test_too_few_points_say_nothing_of_noise() -> None:
    ranges, rays = noisy_wall(4, 9)
    points = records(ranges[:, None] * rays, rays)
    assert noise_of_ranges(points, 1.0, points) == UNKNOWN_SIGMA
    assert noise_of_points(ranges[:, None] * rays) == UNKNOWN_SIGMA


@settings(deadline=None, max_examples=40)
@given(seed=seeds, backward=st.booleans(), closed=st.booleans(), lost=st.floats(0, 1))
def test_beams_are_gathered_as_by_the_twin(seed: int, backward: bool, closed: bool, lost: float) -> None:
    rng = np.random.default_rng(seed)
    ranges = rng.uniform(1, 5, 30)
    ranges[rng.random(30) < lost] = rng.choice([np.nan, np.inf])
    angles = np.arange(30.0) * (-0.2 if backward else 0.2)
    order, points = np.empty(30, np.int64), np.empty(30, POINT)
    count = beams.gather(ranges, np.cos(angles), np.sin(angles), backward, closed, order, points)
    order, points = order[:count], points[:count]
    expected_order, expected_r, expected_rays = reference.gather(ranges, angles, backward, closed)
    np.testing.assert_array_equal(order, expected_order)
    np.testing.assert_array_equal(points["range"], expected_r)
    np.testing.assert_array_equal([points["ray_x"], points["ray_y"]], expected_rays)
    np.testing.assert_allclose([points["x"], points["y"]], expected_r * expected_rays)


def test_ranges_are_cleaned_by_rep_117() -> None:
    ranges = np.array([np.nan, np.inf, -np.inf, 0.05, 0.0, -1.0, 0.1, 5.0, 5.01])
    cleaned = LaserScan(0.0, 0.1, ranges, 0.1, 5.0).cleaned
    np.testing.assert_array_equal(cleaned, [np.nan, np.inf, np.nan, np.nan, np.nan, np.nan, 0.1, 5.0, np.inf])


@pytest.mark.parametrize(
    ("ranges", "expected"),
    [([1.05, 2.1, 3.15], 1.05), ([1.0, 1.05, 3.2], 0.05), ([0.99, 1.0], 0.01), ([1.0, 1.00013], 0.0), ([], 0.0)],
)
def test_the_quantum_is_what_all_ranges_are_multiples_of(ranges: Floats, expected: Any) -> None:
    points = np.zeros(len(ranges), POINT)
    points["range"] = np.array(ranges, dtype=np.float32)
    assert beams.misfits_and_quantum(points, 0.0, points, np.empty(len(points)))[1] == pytest.approx(expected)


GOOD = {"nx": 1.0, "p": 2.0, "spread": 0.1, "weight": 1e5, "count": 10.0, "chi2": 8.0, "begin": -0.5, "end": 0.5}


@pytest.mark.parametrize(
    ("field", "value", "accepted"),
    [
        ("count", 10.0, True), ("count", 9.0, False),
        ("end", 0.49, False),
        ("weight", 1.01 / (WORST_ANGLE**2 * 0.1), True), ("weight", 0.99 / (WORST_ANGLE**2 * 0.1), False),
        ("chi2", 0.99 * WORST_FIT * 8, True), ("chi2", 1.01 * WORST_FIT * 8, False),
        ("p", 0.0, False),
    ],
)  # fmt: skip
def test_a_line_is_accepted_for_its_points_length_angle_fit_and_side(field: str, value: Any, accepted: bool) -> None:
    """Points without rays may lie on a line through their middle."""
    for increment, anyway in ((0.01, False), (0.0, field == "p")):
        scanner, line = scanner_of(increment, least=(10, 1.0)), line_with(**{**GOOD, field: value})
        assert lines.rejoin(np.zeros(0, POINT), line, scanner, line_with()) == (accepted or anyway)
