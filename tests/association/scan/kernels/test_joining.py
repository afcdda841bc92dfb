"""Segments of a scan are joined to lines, and these described, as the references do it."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from numpy.typing import ArrayLike

from association import Scan, mirrored
from association.layout import POINT, VARIANCES, Integers, as_records, record
from association.scan.kernels import describing, joining
from association.scan.tuning import CUT_COSINE, CUT_LATERAL, LINE_COSINE, LINE_GAP, LINE_LATERAL
from association.tables import Measured
from registration import MeasuredSegments, Segments
from registration.layout import LEAST_POINTS, Floats, Records

from ...kernels.drawn import SEEDS
from ...records import assert_records
from ...reference import scans as twin
from ...reference.consensus import model_of
from ...scenes import maze


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


def given_to(measured: MeasuredSegments) -> Measured:
    segments = measured.segments
    return Measured(
        as_records(POINT, segments.directions), as_records(POINT, segments.midpoints), segments.lengths,
        as_records(POINT, measured.centroids), measured.spreads, measured.sigma, measured.point_counts,
    )  # fmt: skip


def given_of(measured: MeasuredSegments) -> Records:
    return joining.as_lines(given_to(measured))


def as_measured(lines: Records, *, counted: bool) -> MeasuredSegments:
    """Return lines as segments that were measured so."""
    middles, half = np.stack([lines["x"], lines["y"]], 1), 0.5 * lines["length"][:, None]
    along = half * np.stack([lines["dx"], lines["dy"]], 1)
    segments = Segments.derived(np.hstack([middles - along, middles + along]))
    centroids = np.stack([lines["centroid_x"], lines["centroid_y"]], 1)
    return MeasuredSegments(segments, lines["sigma"], lines["points"], centroids, lines["spread"], counted)


def labelled(
    measured: MeasuredSegments, lateral: float = LINE_LATERAL, cosine: float = LINE_COSINE, *, directed: bool = True
) -> list[int]:
    order = np.array(twin.longest_first(measured.segments.lengths), np.intp)
    return [int(label) for label in joining.collinear_lines(given_of(measured), order, lateral, cosine, directed)]


def joined(measured: MeasuredSegments, labels: list[int] | None = None) -> Records:
    """Join the segments of each label; by default those that continue one another."""
    order = np.array(twin.longest_first(measured.segments.lengths), np.intp)
    of_line: Integers = np.array(labelled(measured) if labels is None else labels, np.intp)
    return joining.join_labelled(given_of(measured), order, of_line, measured.counted)


def test_union_length() -> None:
    lows, highs = np.array([3.0, 0.0, 0.5, 3.0, 9.0]), np.array([4.0, 2.0, 1.0, 5.0, 9.5])
    assert [joining.union_length(lows, highs, count) for count in range(6)] == [0.0, 1.0, 3.0, 3.0, 4.0, 4.5]


@given(SEEDS)
@settings(max_examples=100, deadline=None)
def test_union_length_of_many(seed: int) -> None:
    rng = np.random.default_rng(seed)
    lows = rng.integers(0, 40, 12).astype(float)
    highs = lows + rng.integers(0, 9, 12).astype(float)
    cells = {x for low, high in zip(lows, highs, strict=True) for x in range(int(low), int(high))}
    assert joining.union_length(lows, highs, 12) == len(cells)


@given(SEEDS)
@settings(max_examples=150, deadline=None)
def test_collinear_segments(seed: int) -> None:
    rng = np.random.default_rng(seed)
    ends = in_pieces(rng)
    turned = rng.random(len(ends)) < 0.3
    ends[turned] = ends[turned][:, [2, 3, 0, 1]]
    measured = measured_of(rng, ends)
    for lateral, cosine in ((LINE_LATERAL, LINE_COSINE), (CUT_LATERAL, CUT_COSINE)):
        for directed in (True, False):
            expected = twin.collinear_segments(measured, lateral, cosine, directed=directed)
            assert labelled(measured, lateral, cosine, directed=directed) == expected


@pytest.mark.parametrize(
    ("other", "one_line"),
    [
        ([4.0 + LINE_GAP - 1e-6, 0.0, 6.0, 0.0], True),
        ([4.0 + LINE_GAP + 1e-6, 0.0, 6.0, 0.0], False),
        ([-2.0, 0.0, -LINE_GAP + 1e-6, 0.0], True),
        ([-2.0, 0.0, -LINE_GAP - 1e-6, 0.0], False),
        ([4.0, LINE_LATERAL - 1e-6, 6.0, LINE_LATERAL - 1e-6], True),
        ([4.0, LINE_LATERAL + 1e-6, 6.0, LINE_LATERAL + 1e-6], False),
        ([4.0, -LINE_LATERAL + 1e-6, 6.0, -LINE_LATERAL + 1e-6], True),
        ([4.0, -LINE_LATERAL - 1e-6, 6.0, -LINE_LATERAL - 1e-6], False),
        ([1.0, 0.0, 2.0, 0.0], True),
        ([2.0, 0.0, 1.0, 0.0], False),  # seen from the other side
        ([4.0, 0.0, 4.0 + math.cos(math.radians(2.4)), math.sin(math.radians(2.4))], True),
        ([4.0, 0.0, 4.0 + math.cos(math.radians(2.6)), math.sin(math.radians(2.6))], False),
        ([4.0, 0.0, 4.0 + math.cos(math.radians(2.6)), -math.sin(math.radians(2.6))], False),
    ],
)
def test_what_continues_or_repeats_another_is_of_its_line(other: list[float], one_line: bool) -> None:
    for ends in ([[0.0, 0.0, 4.0, 0.0], other], [other, [0.0, 0.0, 4.0, 0.0]]):
        assert (len(set(labelled(measured_of(np.random.default_rng(0), ends)))) == 1) is one_line


def test_pieces_are_taken_on_one_after_the_other() -> None:
    """The last is far from the first, and near another one that is near it; what lies beyond a gap is another line."""
    cuts = [(0.0, 4.0), (6.0, 8.0), (4.2, 5.8), (8.4, 9.0)]
    measured = measured_of(np.random.default_rng(0), [[a, 0.0, b, 0.0] for a, b in cuts])
    assert labelled(measured) == [0, 0, 0, 1]


@given(SEEDS)
@settings(max_examples=150, deadline=None)
def test_join_segments(seed: int) -> None:
    """Lines of one segment and of many; some segments are exact."""
    rng = np.random.default_rng(seed)
    measured = measured_of(rng, in_pieces(rng))
    if seed % 3 == 0:
        measured = replace(measured, sigma=np.where(rng.random(len(measured)) < 0.2, 0.0, measured.sigma))
    labels = twin.collinear_segments(measured, LINE_LATERAL, LINE_COSINE)
    assert_records(joined(measured, labels), twin.join_segments(measured, labels), rtol=1e-8, atol=1e-9)


@given(SEEDS)
@settings(max_examples=40, deadline=None)
def test_a_segment_in_pieces_or_twice_is_the_segment(seed: int) -> None:
    """Whether its points were counted or not; of a short one, too."""
    rng = np.random.default_rng(seed)
    begin, turn, length = rng.uniform(-9.0, 9.0, 2), rng.uniform(-3.1, 3.1), rng.choice([0.06, 0.4, 5.0])
    end = begin + length * np.array([math.cos(turn), math.sin(turn)])
    cuts = np.unique([0.0, *rng.random(rng.integers(1, 16)), 1.0])
    shares = [(0.0, 1.0), (0.0, 1.0)] if seed % 3 == 0 else list(itertools.pairwise(cuts.tolist()))
    points = None if seed % 2 else np.array([(b - a) * 400.0 + 1e-9 for a, b in shares])
    if points is not None and points.min() < 1.0:
        return
    ends = [[*(begin + a * (end - begin)), *(begin + b * (end - begin))] for a, b in shares]
    whole = MeasuredSegments.from_segments(
        Segments.from_array([[*begin, *end]]), 0.03, None if points is None else np.array([400.0])
    )
    pieces = MeasuredSegments.from_segments(Segments.from_array(ends), 0.03, points)
    assert_records(joined(pieces), joined(whole), rtol=1e-6, atol=1e-6)


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
    (line,) = joined(measured)
    assert line["variance"] == pytest.approx(0.03**2 / expected)


@given(SEEDS)
@settings(max_examples=60, deadline=None)
def test_describe_lines(seed: int) -> None:
    """Some are equally long; variances are below and above what they come to at least."""
    rng = np.random.default_rng(seed)
    measured = measured_of(rng, in_pieces(rng))
    lines = joined(measured, list(range(len(measured))))
    lines["spread"] *= rng.choice([1e-6, 1.0], len(lines))
    lines["variance"] *= rng.choice([0.0, 1.0], len(lines))
    lines["covered"] *= rng.uniform(0.5, 1.0, len(lines))
    names = ("map", "common", "least_offset", "least_angle")
    variances = record(VARIANCES, **dict(zip(names, rng.choice([0.0, 1e-10, 1e-3, 1.0], 4), strict=True)))
    model = model_of(float(rng.choice([1e-4, 1e-2])), 0.3, 0.1)
    order, expected = twin.describe_lines(lines, variances[0], model[0])
    got = describing.describe_lines(lines, np.array(order), variances, model)
    assert_records(got, expected, rtol=1e-8, atol=1e-12)


def view_of(seed: int) -> tuple[MeasuredSegments, Records, Records]:
    """Return segments, and what goes into the variances of lines and of walls."""
    rng = np.random.default_rng(seed)
    return measured_of(rng, in_pieces(rng)), record(VARIANCES, map=1e-4), model_of(1e-3, 0.3, 0.1)


def assert_rows(got: Records, expected: Records, rtol: float) -> None:
    """Compare rows; half a turn to the left is one to the right."""
    np.testing.assert_allclose(np.exp(1j * got["angle"]), np.exp(1j * expected["angle"]), atol=rtol)
    got, expected = got.copy(), expected.copy()
    got["angle"] = expected["angle"] = 0.0
    assert_records(got, expected, rtol=rtol, atol=1e-9)


@given(SEEDS)
@settings(max_examples=60, deadline=None)
def test_describe_view(seed: int) -> None:
    """First what was cut is joined, then what lies about on a line; the longest comes first, and is seen as it is."""
    measured, variances, model = view_of(seed)
    cut = twin.collinear_segments(measured, CUT_LATERAL, CUT_COSINE)
    once = as_measured(twin.join_segments(replace(measured, counted=True), cut), counted=measured.counted)
    if len(once) == len(measured):
        once, cut = measured, list(range(len(measured)))
    apart = twin.collinear_segments(once, LINE_LATERAL, LINE_COSINE)
    order, expected = twin.describe_lines(twin.join_segments(once, apart), variances[0], model[0])
    row_of, rows, seen = describing.describe_view(given_to(measured), measured.counted, True, variances, model)
    assert row_of.tolist() == [order.index(apart[line]) for line in cut]
    assert_rows(rows, expected, 1e-7)
    assert seen["row"].tolist() == list(range(len(rows)))
    assert (seen["sensor"] == 0).all()
    for name in ("dx", "dy", "x", "y", "length"):
        np.testing.assert_array_equal(seen[name], rows[name])


@given(SEEDS)
@settings(max_examples=60, deadline=None)
def test_mirror_lines(seed: int) -> None:
    """Those of the mirrored scan, to rounding: its segments lie in the same order, and go together in the same way."""
    measured, variances, model = view_of(seed)
    row_of, rows, _ = describing.describe_view(given_to(measured), measured.counted, True, variances, model)
    other = mirrored(Scan(measured)).measured
    expected_row_of, expected, _ = describing.describe_view(given_to(other), other.counted, True, variances, model)
    assert row_of.tolist() == expected_row_of.tolist()
    got, got_seen = describing.mirror_lines(rows)
    assert_rows(got, expected, 1e-9)
    np.testing.assert_array_equal(got_seen, describing.seen_at_once(got))


def test_a_scan_of_nothing_has_no_lines() -> None:
    measured = MeasuredSegments.from_segments(Segments.from_array(np.zeros((0, 4))))
    assert labelled(measured) == []
    assert len(joined(measured)) == 0
