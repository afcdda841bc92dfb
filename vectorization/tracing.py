"""The way from ordered points to segments: their noise, pieces, lines, the extension of these, corners."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from registration import MeasuredSegments, Segments
from registration.layout import Floats, Records, floats

from . import tuning
from .kernels.corners import cut_corners, share_corners
from .kernels.lines import bridge, fit_lines, rejoin
from .kernels.pieces import find_gaps, merge, move_breaks, split
from .kernels.rays import misfits_and_quantum, select
from .layout import FITTED, PIECE, SCANNER, SUMS
from .options import VectorizationOptions


@dataclass(frozen=True, slots=True, eq=False)
class Traced:
    """Lines of the segments, in order, and what is known of them.

    Attributes
    ----------
    lines : (k,) FITTED
    found : (k, 8) end points, then centroid, sigma and root mean square distance of the points, metres
    spans : (k, 2) first and last point
    """

    lines: Records
    found: Floats
    spans: NDArray[np.int64]

    def measured(self) -> MeasuredSegments:
        """Return the segments."""
        segments, moments, lines = Segments.derived(self.found[:, :4]), self.found[:, 4:], self.lines
        return MeasuredSegments(segments, moments[:, 2], lines["count"], moments[:, :2], lines["spread"])


NOTHING = Traced(np.zeros(0, FITTED), np.zeros((0, 8)), np.zeros((0, 2), np.int64))


def trace(
    points: Records, increment: float, closed: bool, sigma: float, options: VectorizationOptions, origin: Floats
) -> Traced:
    """Return the lines of points, with the sensor at `origin` (2,); if `closed`, the last is next to the first."""
    n = len(points)
    if n < options.min_points:
        return NOTHING
    scanner = _scanner(points, increment, sigma, options)
    sums, starts = np.zeros(n + 1, SUMS), np.empty(n, np.int64)
    gaps = starts[: find_gaps(points, scanner, sums, starts)]
    pieces, growth = np.empty(n, PIECE), np.empty(n)
    pieces = pieces[: split(points, sums, gaps, scanner, pieces, np.empty(n, PIECE))]
    pieces = pieces[: merge(pieces, sums, gaps, scanner, growth)]
    for _ in range(tuning.SETTLING_ROUNDS):
        if not move_breaks(pieces, sums, gaps, scanner):
            break
        pieces = pieces[: merge(pieces, sums, gaps, scanner, growth)]

    own, scratch = np.empty(len(pieces) + 2, SUMS), np.empty(2, FITTED)
    pieces = pieces[: bridge(pieces, sums, own, points, scanner, scratch)]
    lines = np.empty(len(pieces), FITTED)
    lines = lines[: fit_lines(points, pieces, own, scanner, np.zeros(n, np.bool_), lines)]
    lines = lines[: rejoin(points, lines, scanner, scratch)]
    share_corners(points, lines, scanner, closed, scratch)
    found, spans = np.empty((len(lines), 8)), np.empty((len(lines), 2), np.int64)
    k = cut_corners(points, lines, scanner, closed, origin, found, spans)
    return Traced(lines[:k], found[:k], spans[:k])


def _scanner(points: Records, increment: float, sigma: float, options: VectorizationOptions) -> Records:
    """Return what the lines depend on besides the points, (1,) of `SCANNER`."""
    floor = max(tuning.ROUGHNESS, tuning.RELATIVE_ROUGHNESS * sigma) ** 2
    max_gap = math.inf if options.max_gap is None else options.max_gap
    default_gap, longest = 0.0, tuning.LONGEST_STEP
    if increment == 0.0:
        x, y = floats(points, "x", "y")
        spacing = float(np.median(np.hypot(np.diff(x), np.diff(y))))
        default_gap = longest = tuning.SPACINGS * spacing + tuning.GAP_NOISE * sigma
    asked = options.min_points, options.min_length
    scanner = (increment, sigma, sigma * sigma, floor, default_gap, max_gap, min(longest, max_gap), *asked)
    return np.array([scanner], SCANNER)


def noise_of_ranges(points: Records, increment: float, as_read: Records) -> float:
    """Return the standard deviation of ranges, metres, from the points of neighbouring rays.

    It is no less than what the quantisation of the ranges `as_read` lets it be.
    """
    misfits = np.empty(len(points))
    count, quantum = misfits_and_quantum(points, increment, as_read, misfits)
    noise = 0.0
    if count >= tuning.LEAST_TRIPLES:
        k = int(tuning.TRUSTED * count)
        select(misfits[:count], k)
        trusted = misfits[:k]
        noise = math.sqrt(float(trusted @ trusted) / (k * tuning.TRUSTED_MEAN_SQUARE))
    return max(noise or tuning.UNKNOWN_SIGMA, tuning.LEAST_SIGMA, quantum / math.sqrt(12.0))


def noise_of_points(places: Floats) -> float:
    """Return the standard deviation of points (n, 2) normal to the walls, metres, from small windows."""
    windows = len(places) - tuning.WINDOW + 1
    if windows < tuning.LEAST_TRIPLES:
        return max(tuning.UNKNOWN_SIGMA, tuning.LEAST_SIGMA)
    shifted = [places[k : k + windows].T for k in range(tuning.WINDOW)]
    middle = np.sum(shifted, axis=0) / tuning.WINDOW
    xx, xy, yy = np.zeros((3, windows))
    for x, y in (place - middle for place in shifted):
        xx += x * x
        xy += x * y
        yy += y * y
    squares = np.maximum(0.0, 0.5 * (xx + yy - np.hypot(xx - yy, 2.0 * xy))) / (tuning.WINDOW - 2)
    k = windows // 2
    select(squares, k)
    return max(math.sqrt(squares[k] / tuning.MEDIAN_CHI) or tuning.UNKNOWN_SIGMA, tuning.LEAST_SIGMA)
