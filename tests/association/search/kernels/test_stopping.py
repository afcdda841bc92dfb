"""The stop rule agrees with the references and with brute force over all sets."""

from __future__ import annotations

import itertools
import math
from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings

from association.layout import SCAN_LINE, WALL
from association.search.kernels import stopping

from ...kernels.drawn import MODEL, SEEDS, drawn
from ...kernels.plans import sampled
from ...reference import planning as twin
from ...reference.consensus import Pairs, log_determinant
from ...reference.scans import freedom_alone


def test_bound_is_never_below_what_can_have_been_missed() -> None:
    """Brute force over all consensus sets that contain none of the bases; the lowered values are returned."""
    rng = np.random.default_rng(4)
    gains = rng.uniform(1.0, 10.0, 9)
    residual, bound = gains.copy(), float(gains.sum())
    tried = []
    for _ in range(12):
        a, b = rng.choice(9, 2, replace=False).tolist()
        bound -= stopping.cover(residual, a, b)
        tried.append((1 << a) | (1 << b))
        free = [s for s in range(512) if not any(s & t == t for t in tried)]
        missed = max(sum(gains[i] for i in range(9) if s >> i & 1) for s in free)
        assert bound >= missed - 1e-9
        assert bound >= residual.sum() - 1e-9
    assert bound < 0.7 * gains.sum()


@pytest.mark.parametrize("n", [1, 4, 6])
def test_orders_of_fewer(n: int) -> None:
    """Of all orders of six those of the first n come as often as one another, with the places of each."""
    drawn = np.array(list(itertools.permutations(range(6))), np.uint8)
    orders, ranks = np.full((len(drawn), n), 99, np.uint8), np.full((n, len(drawn)), 99, np.uint8)
    stopping.restrict(drawn, orders, ranks)
    assert orders.tolist() == [[k for k in row if k < n] for row in drawn.tolist()]
    assert np.array_equal(ranks, orders.argsort(axis=1).T)
    assert set(Counter(map(tuple, orders.tolist())).values()) == {len(drawn) // math.factorial(n)}


@given(SEEDS)
@settings(max_examples=40, deadline=None)
def test_strike(seed: int) -> None:
    """The sets that are left are counted, as they grow; what all segments together do not come to has none."""
    rng = np.random.default_rng(seed)
    samples, scan = sampled(7, 200, rng), drawn(seed).scan[:7]
    most = int(rng.integers(0, 200))
    gains = scan["gain"]
    tried, total = [], float(scan["gain"].sum())
    for needed in np.sort(rng.uniform(-5.0, 1.1 * total, 5)):
        a, b = rng.choice(7, 2, replace=False).tolist()
        tried.append({"sliding": a, "crossing": b})
        stopping.strike(samples, a, b)
        fewest = twin.fewest_segments((-np.sort(-gains)).tolist(), 0.0, needed)
        expected = round(200 * twin.missed_share(samples.orders, gains, tried, needed))
        assert stopping.missed_sets(scan, samples, fewest, needed, most) == min(expected, most + 1)
        assert stopping.missed_sets(scan, samples, fewest, needed, 200) == expected


@given(SEEDS)
@settings(max_examples=60, deadline=None)
def test_fewest_segments(seed: int) -> None:
    rng = np.random.default_rng(seed)
    gains = -np.sort(-rng.integers(1, 9, 6).astype(float))
    beyond, needed = float(rng.choice([0.0, 3.0])), float(rng.integers(-1, 50))
    assert stopping.fewest_segments(gains, beyond, needed) == twin.fewest_segments(gains.tolist(), beyond, needed)


def test_drawn_probability() -> None:
    for count in range(8):
        for fewest in range(2, max(3, count + 1)):
            assert stopping.drawn_probability(fewest, count) == pytest.approx(twin.drawn_chance(fewest, count))


@given(SEEDS)
@settings(max_examples=60, deadline=None)
def test_least_freedom(seed: int) -> None:
    """Brute force over all sets; some lines take as much as others, and some sets reach what is needed to the bit."""
    rng = np.random.default_rng(seed)
    scan = np.zeros(int(rng.integers(1, 9)), SCAN_LINE)
    scan["gain"], scan["freedom"] = rng.integers(1, 9, len(scan)), rng.integers(1, 6, len(scan))
    freest = np.argsort(-scan["freedom"], kind="stable")
    for needed in (*rng.integers(1, int(scan["gain"].sum()) + 1, 5), scan["gain"].sum()):
        got = stopping.least_freedom(scan, freest, float(needed))
        assert got == twin.least_freedom(scan, needed) == twin.least_freedom_sorted(scan, needed)
    assert stopping.least_freedom(scan, freest, 0.0) == 0.0
    assert stopping.least_freedom(scan, freest, scan["gain"].sum() + 1.0) == scan["freedom"].max()


@given(SEEDS)
@settings(max_examples=20, deadline=None)
def test_no_set_takes_less_freedom(seed: int) -> None:
    """Brute force over the sets of some lines, on walls that lie as they do, several of them on one wall."""
    d = drawn(seed)
    scan = d.scan[np.sort(d.rng.choice(len(d.scan), 7, replace=False))].copy()
    walls = np.zeros(len(scan), WALL)
    walls["dx"], walls["dy"] = scan["dx"], scan["dy"]
    of_wall = np.arange(len(scan))
    for k in range(3):  # these lie on the wall of the first, farther on
        scan[["dx", "dy", "angle"]][k] = scan[["dx", "dy", "angle"]][0]
        of_wall[k] = 0
    model = MODEL[0]
    for line in scan:
        line["freedom"] = freedom_alone(line, model)
    freest = np.argsort(-scan["freedom"], kind="stable")
    taken = {}
    for size in range(1, len(scan) + 1):
        for some in itertools.combinations(range(len(scan)), size):
            held = np.where(np.isin(np.arange(len(scan)), some), of_wall, -1)
            pairs = Pairs.of(scan, held, walls, float(model["wall_variance"]))
            taken[some] = log_determinant(pairs.information(0.0), model), scan["gain"][list(some)].sum()
    for needed in d.rng.uniform(1.0, scan["gain"].sum(), 8):
        least = min(freedom for freedom, gain in taken.values() if gain >= needed)
        assert stopping.least_freedom(scan, freest, needed) <= least + 1e-9
