"""A scan is described as its twin describes it."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings

from association.kernels.scans import describe_segments
from association.layout import POINT, VARIANCES, Measured, as_records, record
from registration import MeasuredSegments, Segments

from ..records import assert_records
from ..reference import scans as twin
from ..scenes import maze
from .drawn import SEEDS


@given(SEEDS)
@settings(max_examples=60, deadline=None)
def test_describe_segments(seed: int) -> None:
    """Some are equally long; variances are below and above what they come to at least."""
    rng = np.random.default_rng(seed)
    segments = Segments.from_array(maze(seed, 9)[[0, 1, 2, 3, 4, 5, 6, 7, 8, 2]])
    moments = segments.midpoints + 0.1, rng.random(10) * rng.choice([1e-5, 1.0])
    sigma, points = rng.choice([0.0, 0.01, 0.1], 10), rng.uniform(2.0, 50.0, 10)
    measured = MeasuredSegments.from_segments(segments, sigma, points, moments)
    names = ("map", "common", "least_offset", "least_angle")
    variances = record(VARIANCES, **dict(zip(names, rng.choice([0.0, 1e-10, 1e-3, 1.0], 4), strict=True)))
    order, expected = twin.describe_segments(measured, variances[0])
    given = Measured(
        as_records(POINT, segments.directions), as_records(POINT, segments.midpoints), segments.lengths,
        as_records(POINT, measured.centroids), measured.spreads, measured.sigma, measured.points,
    )  # fmt: skip
    assert_records(describe_segments(given, np.array(order), variances), expected, rtol=1e-12)
