"""Segments of a scan are joined to lines, and these described, as the references do it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from numpy.typing import ArrayLike

from association import AssociationOptions, Scan, mirrored
from association.layout import LINE_PARTS
from association.scan.kernels.joining import join_lines
from association.scan.scan_lines import ScanLines, variances_of
from association.scan.tuning import CUT_COSINE, CUT_LATERAL, LINE_COSINE, LINE_GAP, LINE_LATERAL
from registration import MeasuredSegments, Segments
from registration.layout import LEAST_POINTS, Floats, Records

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
    middles, half = np.stack([lines["x"], lines["y"]], 1), 0.5 * lines["length"][:, None]
    along = half * np.stack([lines["dx"], lines["dy"]], 1)
    segments = Segments.derived(np.hstack([middles - along, middles + along]))
    centroids = np.stack([lines["centroid_x"], lines["centroid_y"]], 1)
    return MeasuredSegments(segments, lines["sigma"], lines["points"], centroids, lines["spread"], counted)


def joined(
    measured: MeasuredSegments, lateral: float = LINE_LATERAL, cosine: float = LINE_COSINE, *, directed: bool = True
) -> tuple[list[int], Records]:
    """Return the line of each segment, and the lines."""
    labels, lines = join_lines(given_of(measured), np.array([[lateral, cosine]]), measured.counted, directed)
    return labels.tolist(), lines


def same_groups(one: list[int], other: list[int]) -> bool:
    """Return whether labels mean the same groups, whatever their numbers are."""
    return [one.index(label) for label in one] == [other.index(label) for label in other]


@given(SEEDS)
@settings(max_examples=60, deadline=None)
def test_collinear_segments(seed: int) -> None:
    rng = np.random.default_rng(seed)
    ends = in_pieces(rng)
    turned = rng.random(len(ends)) < 0.3
    ends[turned] = ends[turned][:, [2, 3, 0, 1]]
    measured = measured_of(rng, ends)
    for lateral, cosine in ((LINE_LATERAL, LINE_COSINE), (CUT_LATERAL, CUT_COSINE)):
        for directed in (True, False):
            expected = twin.collinear_segments(measured, lateral, cosine, directed=directed)
            assert same_groups(joined(measured, lateral, cosine, directed=directed)[0], expected)


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
        assert (len(joined(measured_of(np.random.default_rng(0), ends))[1]) == 1) is one_line


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
    (line,) = joined(measured)[1]
    assert line["variance"] == pytest.approx(0.03**2 / expected)


def assert_rows(got: Records, expected: Records, rtol: float) -> None:
    """Compare rows; half a turn to the left is one to the right."""
    np.testing.assert_allclose(np.exp(1j * got["angle"]), np.exp(1j * expected["angle"]), atol=rtol)
    got, expected = got.copy(), expected.copy()
    got["angle"] = expected["angle"] = 0.0
    assert_records(got, expected, rtol=rtol, atol=1e-9)


@given(SEEDS)
@settings(max_examples=60, deadline=None)
def test_lines_of_a_view(seed: int) -> None:
    """First what was cut is joined, then what lies about on a line; the longest comes first."""
    rng, options = np.random.default_rng(seed), AssociationOptions()
    measured = measured_of(rng, in_pieces(rng))
    cut = twin.collinear_segments(measured, CUT_LATERAL, CUT_COSINE)
    once = as_measured(twin.join_segments(replace(measured, counted=True), cut), counted=measured.counted)
    if len(once) == len(measured):
        once, cut = measured, list(range(len(measured)))
    apart = twin.collinear_segments(once, LINE_LATERAL, LINE_COSINE)
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


def test_a_scan_of_nothing_has_no_lines() -> None:
    measured = MeasuredSegments.from_segments(Segments.from_array(np.zeros((0, 4))))
    labels, lines = joined(measured)
    assert labels == []
    assert len(lines) == 0
