"""Kernels that Python calls, against plain NumPy: lines of a scan, the estimator, evidence and weights of pairs."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from numpy.typing import ArrayLike
from scipy.sparse.csgraph import connected_components

from association import AssociationOptions, Scan, mirrored
from association.consensus.kernels.acceptance import lay_segments, weigh_pairs
from association.consensus.kernels.estimation import COLUMNS, leave_out_walls, linearize, solve_model
from association.consensus.kernels.rays import passed_walls
from association.consensus.tuning import MAX_OTHERS, ROUGH_FRACTION, SIGHT_TOLERANCE
from association.layout import BEAM, ENDS, LINE_PARTS, MATCH, OBSERVATION, SHOWN, WALL, as_records, record
from association.scan.kernels.joining import join_lines
from association.scan.scan_lines import ScanLines, variances_of
from association.scan.tuning import CUT_COSINE, CUT_LATERAL, LINE_COSINE, LINE_LATERAL
from association.tables import Model, Pieces
from association.verdict.kernels.things import compare_things
from association.verdict.tuning import LEAST_OF_BEAM, OF_A_THING, THING_WIDTH, THINGS_APART
from registration import MeasuredSegments, Segments
from registration.layout import LEAST_POINTS, POSE, Floats, Records, floats

from ..scenes import maze
from . import reference as twin
from .reference import SEEDS, assert_records


def in_pieces(rng: np.random.Generator) -> Floats:
    """Draw walls of a maze, cut up, with gaps and overlaps, some off or turned a little, some sent twice."""
    pieces = []
    for wall in maze(int(rng.integers(99)), 4):
        a, d = wall[:2], wall[2:] - wall[:2]
        n = np.array([-d[1], d[0]]) / np.hypot(*d)
        for _ in range(rng.integers(1, 6)):
            begin, end = np.sort(rng.integers(0, 21, 2) / 20.0)
            off = rng.normal(size=2)[:, None] * rng.choice([0.0, 0.01, 0.05]) * n
            pieces.append(np.concatenate([a + begin * d + off[0], a + (end + 0.05) * d + off[1]]))
    return np.array([*pieces, *pieces[::4]])


def measured_of(rng: np.random.Generator, ends: ArrayLike) -> MeasuredSegments:
    """Say what was measured of segments: every number another one; points counted or not."""
    segments = Segments.from_array(ends)
    n = len(segments)
    moments = segments.midpoints + 0.05 * rng.normal(size=(n, 2)), segments.lengths**2 * rng.uniform(0.02, 0.2, n)
    points = rng.uniform(1.0, 50.0, n) if rng.random() < 0.5 else None
    return MeasuredSegments.from_segments(segments, rng.uniform(0.005, 0.1, n), points, moments)


def given_of(measured: MeasuredSegments) -> Records:
    segments, given = measured.segments, np.zeros(len(measured), LINE_PARTS)
    columns = *segments.directions.T, *segments.midpoints.T, segments.lengths, *measured.centroids.T, measured.spreads
    names = "dx", "dy", "x", "y", "length", "centroid_x", "centroid_y", "spread"
    for name, values in zip(names, columns, strict=True):
        given[name] = values
    given["sigma"], given["points"] = measured.sigma, measured.point_counts
    return given


def as_measured(lines: Records, *, counted: bool) -> MeasuredSegments:
    """Return lines as segments that were measured so."""
    x, y, dx, dy, length, *centroids, spread = floats(
        lines, "x", "y", "dx", "dy", "length", "centroid_x", "centroid_y", "spread"
    )
    middles, along = np.stack([x, y], 1), 0.5 * length[:, None] * np.stack([dx, dy], 1)
    segments = Segments.derived(np.hstack([middles - along, middles + along]))
    return MeasuredSegments(segments, lines["sigma"], lines["points"], np.stack(centroids, 1), spread, counted)


@pytest.mark.parametrize(
    ("ends", "points", "expected"),
    [
        ([[0.0, 0.0, 2.0, 0.0]], None, 40.0),
        ([[0.0, 0.0, 0.05, 0.0]], None, LEAST_POINTS),
        ([[0.0, 0.0, 0.05, 0.0]], [1.0], 1.0),
        ([[0.0, 0.0, 0.05, 0.0], [0.05, 0.0, 0.08, 0.0]], None, LEAST_POINTS),
        ([[0.0, 0.0, 0.05, 0.0], [0.05, 0.0, 0.10, 0.0], [0.10, 0.0, 0.15, 0.0]], None, 3.0),
        ([[0.0, 0.0, 2.0, 0.0], [1.0, 0.0, 3.0, 0.0]], None, 60.0),  # what overlaps counts once
        ([[0.0, 0.0, 2.0, 0.0], [0.0, 0.0, 2.0, 0.0]], [10.0, 20.0], 10.0),  # of equally long ones the first
        ([[0.0, 0.0, 2.0, 0.0], [0.5, 0.0, 3.0, 0.0]], [10.0, 20.0], 22.5),  # else the longer
        ([[0.0, 0.0, 2.0, 0.0], [2.2, 0.0, 3.2, 0.0]], [10.0, 20.0], 30.0),
    ],
)
def test_points_of_a_line(ends: list[list[float]], points: list[float] | None, expected: float) -> None:
    measured = MeasuredSegments.from_segments(Segments.from_array(ends), 0.03, points)
    (line,) = join_lines(given_of(measured), np.array([[LINE_LATERAL, LINE_COSINE]]), measured.counted, True)[1]
    assert line["variance"] == pytest.approx(0.03**2 / expected)


def assert_rows(got: Records, expected: Records, rtol: float) -> None:
    """Compare rows; half a turn to the left is one to the right."""
    np.testing.assert_allclose(np.exp(1j * got["angle"]), np.exp(1j * expected["angle"]), atol=rtol)
    got, expected = got.copy(), expected.copy()
    got["angle"] = expected["angle"] = 0.0
    assert_records(got, expected, rtol=rtol, atol=1e-9)


@pytest.mark.parametrize("directed", [True, False])
@given(SEEDS)
@settings(max_examples=60, deadline=None)
def test_lines_of_a_view(directed: bool, seed: int) -> None:
    """First what was cut is joined, then what lies about on a line; the longest comes first."""
    rng, options = np.random.default_rng(seed), AssociationOptions(oriented=directed)
    ends = in_pieces(rng)
    turned = rng.random(len(ends)) < 0.3
    ends[turned] = ends[turned][:, [2, 3, 0, 1]]
    measured = measured_of(rng, ends)
    cut = twin.collinear_segments(measured, CUT_LATERAL, CUT_COSINE, directed=directed)
    once = as_measured(twin.join_segments(replace(measured, counted=True), cut), counted=measured.counted)
    if len(once) == len(measured):
        once, cut = measured, list(range(len(measured)))
    apart = twin.collinear_segments(once, LINE_LATERAL, LINE_COSINE, directed=directed)
    variances, model = variances_of(0.01, options, with_beams=False)
    order, expected = twin.describe_lines(twin.join_segments(once, apart), variances[0], model[0])
    lines = ScanLines.of(Scan(measured), 0.01, options)
    assert lines.row_of.tolist() == [order.index(apart[line]) for line in cut]
    assert_rows(lines.rows, expected, 1e-7)


@given(SEEDS)
@settings(max_examples=60, deadline=None)
def test_mirrored_lines(seed: int) -> None:
    """Those of the mirrored scan, to rounding: its segments lie in the same order, and go together in the same way."""
    rng, options = np.random.default_rng(seed), AssociationOptions()
    scan = Scan(measured_of(rng, in_pieces(rng)))
    got, expected = ScanLines.of(scan, 0.01, options).mirrored(), ScanLines.of(mirrored(scan), 0.01, options)
    assert got.row_of.tolist() == expected.row_of.tolist()
    assert_rows(got.rows, expected.rows, 1e-9)
    assert_records(got.sightings, expected.sightings, rtol=1e-9, atol=1e-9)


VARIANCE = 0.02**2


def drawn(rng: np.random.Generator, views: int) -> Model:
    """Return lines of some views on walls of all directions, of which the first two are tied, and not quite on them."""
    n, m, u = 12, 6, 3 * (views - 1)
    seen = np.zeros(n, OBSERVATION)
    angles, turn = rng.uniform(-np.pi, np.pi, n), rng.normal(0.0, 0.01)
    seen["dx"], seen["dy"] = np.cos(angles), np.sin(angles)
    x, y = seen["centroid_x"], seen["centroid_y"] = rng.uniform(-8.0, 8.0, (2, n))
    normal_x, normal_y = seen["normal_x"], seen["normal_y"] = -np.sin(angles + turn), np.cos(angles + turn)
    seen["offset"] = normal_x * x + normal_y * y + rng.normal(0.0, 0.03, n)
    seen["spread"], seen["variance"] = rng.uniform(0.1, 2.0, n), rng.uniform(1e-6, 1e-4, n)
    seen["wall"], seen["of_view"] = np.arange(n) % m, np.arange(n) % views
    seen["time"], seen["pace"] = rng.uniform(-0.5, 0.5, n), rng.normal(0.0, 0.05, n)
    ties = np.array([-1.0, -1.0, -1.0, -1.0, 1.0, 1.4])
    active = np.concatenate([np.arange(3), np.arange(3, COLUMNS), np.arange(COLUMNS, COLUMNS + u)])
    information = np.diag(np.concatenate([np.full(3, 1e-2), rng.uniform(1e2, 1e4, len(active) - 3)]))
    places, root = rng.uniform(-2.0, 2.0, (views, 2)), rng.normal(0.0, 0.02, (3 * views, u))
    return Model(seen, ties, np.ones(m), rng.normal(size=2), places, root, np.zeros(u), active, information)


def rows(model: Model, x: Floats) -> tuple[Floats, Floats]:
    """Return derivatives and residuals of centroids and directions."""
    a, b = np.empty((2, len(model.seen), len(x) + 1))
    linearize(model, x, a, b)
    return a, b


def normal(model: Model, x: Floats) -> tuple[Floats, Floats]:
    """Return the normal matrix and the gradient, by the covariance of all residuals."""
    (a, b), seen, wall = rows(model, x), model.seen, model.seen["wall"]
    weights = 1.0 / (seen["variance"] + ROUGH_FRACTION * VARIANCE)
    tied = (model.ties[:, None] >= 0.0) & (model.ties >= 0.0)
    correlation = np.where(tied, np.exp(-np.abs(model.ties[:, None] - model.ties)), np.eye(len(model.ties)))
    inverse = np.linalg.inv(np.diag(1.0 / weights) + VARIANCE * correlation[np.ix_(wall, wall)])
    along = weights * seen["spread"]
    both = a.T @ inverse @ a + (b.T * along) @ b
    both[:-1, :-1] += model.information
    both[3:-1, -1] += (model.information @ x[model.active])[3:]
    return both[:-1, :-1], both[:-1, -1]


@given(seed=SEEDS)
def test_the_derivatives_are_those_of_the_residuals(seed: int) -> None:
    rng = np.random.default_rng(seed)
    model, step = drawn(rng, 1 + seed % 3), 1e-6
    x = np.zeros(COLUMNS + len(model.began))
    x[:3] = rng.normal(size=3)
    found = rows(model, x)
    for k, change in enumerate(step * np.eye(len(x))):
        for own, more, less in zip(found, rows(model, x + change), rows(model, x - change), strict=True):
            assert np.allclose(own[:, k], (more[:, -1] - less[:, -1]) / (2.0 * step), atol=1e-6)


@given(seed=SEEDS)
def test_the_solution_is_that_of_dense_least_squares(seed: int) -> None:
    model = drawn(np.random.default_rng(seed), 1 + seed % 3)
    x, covariance = np.zeros(COLUMNS + len(model.began)), np.empty((len(model.active), len(model.active)))
    x[:2] = model.sensor
    variance, _ = solve_model(model, x, covariance, VARIANCE)
    assert variance == VARIANCE
    matrix, gradient = normal(model, x)
    assert np.allclose(np.linalg.solve(matrix, gradient), 0.0, atol=1e-4)
    covariances, places = np.empty((2, *covariance.shape)), np.empty((len(model.ties), 5))
    leave_out_walls(model, x, VARIANCE, VARIANCE, covariances, places)
    assert np.allclose(covariances, np.linalg.inv(matrix), rtol=1e-6, atol=1e-12)


@given(seed=SEEDS)
def test_things_are_connected_places(seed: int) -> None:
    rng = np.random.default_rng(seed)
    m = int(rng.integers(0, 40))
    beams, angles = np.zeros(m, BEAM), rng.uniform(-math.pi, math.pi, m)
    beams["dx"], beams["dy"] = np.cos(angles), np.sin(angles)
    values, distances = rng.normal(0.0, 2.0, (3, m)) * (rng.random((3, m)) < 0.5), rng.uniform(0.5, 5.0, (3, m))
    expected = []
    for other in (1, 2):
        more = values[0] - values[other]
        differs = np.abs(more) > LEAST_OF_BEAM
        away = np.where(more > 0.0, distances[other], distances[0])[differs]
        places = (away * np.stack([np.cos(angles), np.sin(angles)])[:, differs]).T
        near = np.hypot(*np.moveaxis(places[:, None] - places, 2, 0)) <= THINGS_APART
        count, thing = connected_components(near, directed=False) if len(places) else (0, np.zeros(0, int))
        gap = 0.0
        for one in range(count):
            most = OF_A_THING * max(1.0, math.hypot(*np.ptp(places[thing == one], axis=0)) / THING_WIDTH)
            gap += float(np.clip(more[differs][thing == one].sum(), -most, most))
        expected.append(gap)
    assert np.allclose(compare_things(values, distances, beams), expected)


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
