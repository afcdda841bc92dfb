"""The way from ordered points to segments: pieces, lines, their extension, corners."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from compiled import kernel
from registration.layout import SEGMENT, Floats, Record, Records, X, Y

from ..layout import FITTED
from ..tuning import (
    END_GATE,
    LEAST_COSINE,
    MISSING_STEPS,
    POINT_GATE,
    SETTLING_ROUNDS,
    WIDENING,
    WORST_ANGLE,
    WORST_FIT,
    WORST_KNOWN,
)
from .corners import cut_corners
from .lines import abscissa_on, bridge, distance_from, fit_line, incidence, line_of, rejoin
from .pieces import find_gaps, merge, running_sums, settle_breaks, split

Flags = NDArray[np.bool_]


@kernel
def trace(points: Records, scanners: Records, closed: bool, min_points: int, min_length: float) -> Records:
    """Return the lines of the segments, in order.

    Parameters
    ----------
    points : (n,) POINT
    scanners : (1,) SCANNER
    closed : bool
        True if the last point's neighbour is the first.
    min_points : int
    min_length : float
        Metres.
    """
    scanner = scanners[0]
    gaps = find_gaps(points, scanner)
    sums = running_sums(points)
    pieces = merge(split(points, sums, gaps, scanner), sums, gaps, scanner)
    for _ in range(SETTLING_ROUNDS):
        if not settle_breaks(pieces, sums, gaps, scanner):
            break
        pieces = merge(pieces, sums, gaps, scanner)
    bounds, totals = bridge(pieces, sums, points, min_points, scanner)
    lines = fit_all(points, bounds, totals, min_points, scanner)
    keep = 0
    for k in range(rejoin(points, lines, scanner)):
        if large_enough(lines[k], min_points, min_length) and acceptable(lines[k], scanner.increment > 0.0):
            lines[keep] = lines[k]
            keep += 1
    lines = lines[:keep]
    cut_corners(points, lines, scanner, closed)
    # At a corner a line may have lost points, or an end.
    left = 0
    for k in range(keep):
        if large_enough(lines[k], min_points, min_length):
            lines[left] = lines[k]
            left += 1
    return lines[:left].copy()


@kernel
def large_enough(line: Record, min_points: int, min_length: float) -> bool:
    """Tell whether a line is one that was asked for."""
    return line.count >= min_points and line.end - line.begin >= min_length


@kernel
def acceptable(line: Record, rays: bool) -> bool:
    """Tell whether a line is one: its angle known, its points on it."""
    return (
        line.weight * line.spread * WORST_ANGLE * WORST_ANGLE >= 1.0
        and line.chi2 <= WORST_FIT * max(1.0, line.count - 2.0)
        and not (rays and line.p <= 0.0)
    )


@kernel
def fit_all(points: Records, bounds: Records, totals: Records, min_points: int, scanner: Record) -> Records:
    """Fit every piece of at least `min_points` and extend it over the points around that no such piece has."""
    taken = np.zeros(len(points), np.bool_)
    own = np.zeros(len(points), np.bool_)
    lines = np.empty(len(bounds), FITTED)
    for k in range(len(bounds)):
        if totals[k].count >= min_points:
            taken[bounds[k].first : bounds[k].end] = True
    count = 0
    for k in range(len(bounds)):
        if totals[k].count < min_points:
            continue
        line = lines[count]
        line_of(totals[k], line)
        line.middle = abscissa_on(line, totals[k].x, totals[k].y) / totals[k].count
        line.first = bounds[k].first
        line.last = bounds[k].end - 1
        if fit_and_extend(points, taken, line, scanner, own):
            taken[line.first : line.last + 1] = True
            count += 1
    return lines[:count].copy()


@kernel
def fit_and_extend(points: Records, taken: Flags, line: Record, scanner: Record, own: Flags) -> bool:
    """Fit a line to its points, extend it, and take back what strays at its ends; return whether there is one."""
    a = line.first
    z = line.last
    if not fit_line(points, a, z + 1, scanner, line, own):
        return False
    low = extend(points, a, -1, taken, line, scanner)
    high = extend(points, z, 1, taken, line, scanner)
    if (low < a or high > z) and not fit_line(points, low, high + 1, scanner, line, own):
        return False
    first = low
    last = high
    while low < high and strays(points[low], line, scanner):
        low += 1
    while high > low and strays(points[high], line, scanner):
        high -= 1
    line.first = low
    line.last = high
    return (low == first and high == last) or fit_line(points, low, high + 1, scanner, line, own)


@kernel
def strays(point: Record, line: Record, scanner: Record) -> bool:
    """Tell whether a point, the last of its line, belongs rather to an object next to the wall."""
    e = distance_from(line, point)
    cosine = incidence(line, point)
    return e * e > END_GATE * END_GATE * (scanner.variance * cosine * cosine + scanner.floor)


@kernel
def extend(points: Records, start: int, direction: int, taken: Flags, line: Record, scanner: Record) -> int:
    """Return the last point, from `start` on in `direction`, that still lies on the line; one misfit may intervene."""
    last = start
    misfits = 0
    i = start + direction
    while 0 <= i < len(points) and not taken[i] and misfits <= 1:
        point = points[i]
        before = points[last]
        e = distance_from(line, point)
        cosine = 1.0
        if scanner.increment > 0.0:
            cosine = line.nx * point.ray_x + line.ny * point.ray_y
            sine = abs(before.ray_x * point.ray_y - before.ray_y * point.ray_x)
            turn = math.atan2(sine, before.ray_x * point.ray_x + before.ray_y * point.ray_y)
            if turn > MISSING_STEPS * scanner.increment:
                break
        if math.hypot(point.x - before.x, point.y - before.y) > scanner.longest:
            break
        lever = abscissa_on(line, point.x, point.y) - line.middle
        known = (1.0 + lever * lever / line.spread) / line.weight
        v = scanner.variance * cosine * cosine + scanner.floor + known
        certain = known < WORST_KNOWN * (scanner.variance + scanner.floor)
        if e * e <= POINT_GATE * POINT_GATE * v and cosine > LEAST_COSINE and certain:
            last = i
            misfits = 0
        else:
            misfits += 1
        i += direction
    return last


@kernel
def describe(lines: Records, x: float, y: float) -> tuple[Floats, Floats, Floats, Floats]:
    """Return the results of each line, moved to the place (x, y) of the sensor: endpoints, sigma, centroid and rms.

    Sigma is such that count / sigma^2 is the weight, and widened where the points lie worse than chance lets them.
    """
    m = len(lines)
    segments = np.empty(m, SEGMENT)
    sigmas = np.empty(m, np.float64)
    centroids = np.empty((m, 2), np.float64)
    rms = np.empty(m, np.float64)
    for k in range(m):
        line = lines[k]
        foot_x = x + line.p * line.nx
        foot_y = y + line.p * line.ny
        segments[k].begin_x = foot_x - line.begin * line.ny
        segments[k].begin_y = foot_y + line.begin * line.nx
        segments[k].end_x = foot_x - line.end * line.ny
        segments[k].end_y = foot_y + line.end * line.nx
        centroids[k, X] = foot_x - line.middle * line.ny
        centroids[k, Y] = foot_y + line.middle * line.nx
        dof = max(1.0, line.count - 2.0)
        sigmas[k] = math.sqrt(line.count / line.weight)
        if line.chi2 > dof + WIDENING * math.sqrt(2.0 * dof):
            sigmas[k] *= math.sqrt(line.chi2 / dof)
        rms[k] = math.sqrt(line.chi2 / line.weight)
    return segments.view(np.float64).reshape((m, 4)), sigmas, centroids, rms
