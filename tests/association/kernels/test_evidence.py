"""Things, passed walls, accepted pieces and weights of pairs against plain NumPy, SciPy and sets."""

from __future__ import annotations

import math
from collections import Counter

import numpy as np
from hypothesis import given
from scipy.sparse.csgraph import connected_components

from association.consensus.kernels.acceptance import lay_segments, weigh_pairs
from association.consensus.kernels.rays import passed_walls
from association.consensus.tuning import MAX_OTHERS, SIGHT_TOLERANCE
from association.layout import BEAM, ENDS, MATCH, SHOWN, WALL, as_records, record
from association.tables import Pieces
from association.verdict.kernels.things import compare_things
from association.verdict.tuning import LEAST_OF_BEAM, THING_WIDTH, THINGS_APART
from registration.layout import POSE

from .reference import SEEDS


@given(seed=SEEDS)
def test_things_are_connected_places(seed: int) -> None:
    rng = np.random.default_rng(seed)
    m = int(rng.integers(0, 40))
    beams, angles = np.zeros(m, BEAM), rng.uniform(-math.pi, math.pi, m)
    beams["dx"], beams["dy"] = np.cos(angles), np.sin(angles)
    values, distances = rng.normal(0.0, 2.0, (3, m)) * (rng.random((3, m)) < 0.5), rng.uniform(0.5, 5.0, (3, m))
    of_a_thing, expected = float(rng.uniform(0.0, 3.0)), []
    for other in (1, 2):
        more = values[0] - values[other]
        differs = np.abs(more) > LEAST_OF_BEAM
        away = np.where(more > 0.0, distances[other], distances[0])[differs]
        places = (away * np.stack([beams["dx"], beams["dy"]])[:, differs]).T
        near = np.hypot(*np.moveaxis(places[:, None] - places, 2, 0)) <= THINGS_APART
        count, thing = connected_components(near, directed=False) if len(places) else (0, np.zeros(0, int))
        gap = 0.0
        for one in range(count):
            width = math.hypot(*np.ptp(places[thing == one], axis=0))
            limit = of_a_thing * max(1.0, width / THING_WIDTH)
            gap += float(np.clip(more[differs][thing == one].sum(), -limit, limit))
        expected.append(gap)
    assert np.allclose(compare_things(values, distances, beams, of_a_thing), expected)


@given(seed=SEEDS)
def test_passed_walls_are_counted_by_view(seed: int) -> None:
    rng = np.random.default_rng(seed)
    k, m, n = 2, 30, 4
    beams, table, matches = np.zeros(m, BEAM), np.zeros((k, m), SHOWN), np.zeros((k, n), MATCH)
    beams["range"], table["distance"] = rng.uniform(0.0, 2.0, m), rng.uniform(0.0, 2.0, (k, m))
    table["wall"], matches["wall"] = rng.integers(-1, 4, (k, m)), rng.integers(-1, 2, (k, n))
    line, sensor = rng.integers(-1, n, m), rng.integers(0, 3, m)
    found: Counter[tuple[int, int, int, bool]] = Counter()
    for p, b in np.ndindex(k, m):
        if table["wall"][p, b] >= 0 and line[b] >= 0 and beams["range"][b] - SIGHT_TOLERANCE > table["distance"][p, b]:
            key = (p, int(table["wall"][p, b]), int(sensor[b]), bool(matches["wall"][p, line[b]] >= 0))
            found[key] += 1
    expected = [
        (p, w, *(max(found[p, w, view, own] for view in range(3)) for own in (True, False)))
        for p, w in sorted({(p, w) for p, w, *_ in found})
    ]
    assert [*zip(*(column.tolist() for column in passed_walls(beams, line, sensor, table, matches)), strict=True)] == (
        expected
    )


@given(seed=SEEDS)
def test_the_piece_that_a_segment_lies_on_most_is_accepted(seed: int) -> None:
    rng = np.random.default_rng(seed)
    lows, n = np.sort(rng.uniform(0.0, 10.0, 8)), 5
    highs = lows + rng.uniform(0.1, 3.0, 8)
    # Two walls on the x-axis, one after the other, of four pieces each.
    walls = np.zeros(2, WALL)
    walls["dx"], walls["before"], walls["after"] = 1.0, [-1, 0], [1, -1]
    ends = as_records(ENDS, np.column_stack([lows, np.zeros(8), highs, np.zeros(8)]))
    ends.flags.writeable = False
    pieces = Pieces(np.arange(8, dtype=np.int32), np.array([0, 4, 8]), ends, np.zeros(2, np.int64))
    begins = rng.uniform(-1.0, 11.0, n)
    segments = np.column_stack([begins, np.zeros(n), begins + rng.uniform(0.2, 2.0, n), np.zeros(n)])
    own = rng.integers(0, 2, n)
    on, overlaps, others = own.copy(), np.empty(n), np.empty((n, MAX_OTHERS), np.intp)
    lay_segments(segments, on, record(POSE), walls, pieces, overlaps, others)
    for k, (begin, _, end, _) in enumerate(segments):
        shared = np.minimum(highs, end) - np.maximum(lows, begin)
        over_half = (np.arange(8) // 4 == own[k]) & (shared > 0.5 * (end - begin))
        assert on[k] == max(range(8), key=lambda i: (over_half[i], shared[i], -i))
        grid = begin + (np.arange(2000) + 0.5) / 2000 * (end - begin)
        inside = ((grid >= lows[:, None]) & (grid <= highs[:, None])).any(axis=0)
        assert abs(overlaps[k] - inside.mean()) < 5e-3
        assert [i for i in others[k] if i >= 0] == [i for i in range(8) if shared[i] > 0.0 and i != on[k]]


@given(seed=SEEDS)
def test_pairs_share_the_error_of_their_wall_and_the_evidence_of_their_line(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n, sigma = 6, 0.02
    rows, walls, lows = rng.integers(0, 3, n), rng.integers(0, 3, n), rng.uniform(0.0, 3.0, n)
    of_walls = np.array([-1.0, 0.5, 0.8])
    lengths, variances = rng.uniform(0.2, 2.0, n), rng.uniform(1e-6, 1e-4, n)
    ends, weights = np.column_stack([lows, np.zeros(n), lows + lengths, np.zeros(n)]), np.empty(n)
    shared = weigh_pairs(rows, walls, of_walls[walls], ends, variances, sigma**2, weights)
    grid = np.linspace(0.0, 5.0, 20001)
    alone = np.empty(n)
    for i in range(n):
        longer = [j for j in range(n) if rows[j] == rows[i] and lengths[j] > lengths[i]]
        free = (grid >= lows[i]) & (grid <= lows[i] + lengths[i])
        for j in longer:
            free &= (grid < lows[j]) | (grid > lows[j] + lengths[j])
        alone[i] = free.sum() * (grid[1] - grid[0]) / lengths[i] / variances[i]
    tied = (of_walls[walls][:, None] >= 0.0) & (of_walls[walls] >= 0.0)
    correlation = np.where(tied, np.exp(-np.abs(of_walls[walls][:, None] - of_walls[walls])), 0.0)
    correlation[walls[:, None] == walls] = 1.0
    expected = alone / (1.0 + sigma**2 * (correlation @ alone))
    assert np.allclose(weights, expected, rtol=0.02, atol=1e-3 * expected.max())
    assert shared == (len(set(walls.tolist())) < n or bool((of_walls[walls] >= 0.0).any()))
