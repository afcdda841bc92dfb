"""Work on pairs of a map and a scan segment, records of type PAIR; those of weight 0 do not count."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..compiling import kernel
from ..layout import PAIR, Floats, Record, Records, X, Y

MIN_SIGMA = 1e-12  # m; a smaller one that is not 0 counts as this, so that its square is not lost


class SegmentArrays(NamedTuple):
    """Segments, an array for each property."""

    directions: Floats  # (n, 2)
    midpoints: Floats  # (n, 2) m
    lengths: Floats  # (n,) m


class PointArrays(NamedTuple):
    """What is known of the points behind each segment."""

    centroids: Floats  # (n, 2) m
    spreads: Floats  # (n,) m^2
    sigmas: Floats  # (n,) m
    counts: Floats  # (n,)


@kernel
def first_outside(indices: NDArray[np.intp], count: int) -> int:
    """Return the first place of `indices` (n,) that does not hold one from 0 to ``count - 1``, or -1."""
    for i in range(len(indices)):
        if indices[i] < 0 or indices[i] >= count:
            return i
    return -1


@kernel
def gather(
    scan_indices: NDArray[np.intp],
    map_indices: NDArray[np.intp],
    map_segments: SegmentArrays,
    scan_segments: SegmentArrays,
    points: PointArrays,
) -> Records:
    """Return the pairs of indices (n,) each, all in range."""
    # Taken out once: an array that is taken out of a tuple is counted as referenced.
    map_directions = map_segments.directions
    map_midpoints = map_segments.midpoints
    map_lengths = map_segments.lengths
    directions = scan_segments.directions
    midpoints = scan_segments.midpoints
    lengths = scan_segments.lengths
    centroids = points.centroids
    spreads = points.spreads
    sigmas = points.sigmas
    counts = points.counts
    pairs = np.empty(len(scan_indices), PAIR)
    for k in range(len(pairs)):
        i = scan_indices[k]
        j = map_indices[k]
        line = pairs[k].map
        line.dx = map_directions[j, X]
        line.dy = map_directions[j, Y]
        line.x = map_midpoints[j, X]
        line.y = map_midpoints[j, Y]
        line.offset = offset_of(line)
        line.length = map_lengths[j]
        seen = pairs[k].scan
        seen.dx = directions[i, X]
        seen.dy = directions[i, Y]
        seen.x = midpoints[i, X]
        seen.y = midpoints[i, Y]
        seen.length = lengths[i]
        seen.centroid_x = centroids[i, X]
        seen.centroid_y = centroids[i, Y]
        seen.spread = spreads[i]
        sigma = max(sigmas[i], MIN_SIGMA) if sigmas[i] > 0.0 else 0.0
        seen.variance = sigma * sigma / counts[i]
    return pairs


@kernel
def offset_of(line: Record) -> float:
    """Return the offset of a line by its direction and a point on it, a record with `dx`, `dy`, `x` and `y`."""
    return -line.dy * line.x + line.dx * line.y


@kernel
def inverse_variances(pairs: Records, map_variance: float) -> tuple[Floats, bool]:
    """Return 1 / variance of each pair's offset (n,), and whether all pairs have a variance."""
    inverses = np.empty(len(pairs))
    for i in range(len(pairs)):
        variance = pairs[i].scan.variance + map_variance
        if not variance > 0.0:
            return inverses, False
        inverses[i] = 1.0 / variance
    return inverses, True


@kernel
def middles(pairs: Records, weights: Floats) -> tuple[float, float, float, float, int]:
    """Return the means of the map midpoints and of the points' means, ``(map_x, map_y, scan_x, scan_y)``, and n."""
    map_x = 0.0
    map_y = 0.0
    scan_x = 0.0
    scan_y = 0.0
    count = 0
    for i in range(len(pairs)):
        if weights[i] > 0.0:
            map_x += pairs[i].map.x
            map_y += pairs[i].map.y
            scan_x += pairs[i].scan.centroid_x
            scan_y += pairs[i].scan.centroid_y
            count += 1
    return map_x / count, map_y / count, scan_x / count, scan_y / count, count


@kernel
def moved_origins(pairs: Records, map_x: float, map_y: float, scan_x: float, scan_y: float) -> Records:
    """Return the pairs in frames that have been moved to new origins."""
    moved = pairs.copy()
    for i in range(len(moved)):
        line = moved[i].map
        line.x -= map_x
        line.y -= map_y
        line.offset = offset_of(line)
        seen = moved[i].scan
        seen.x -= scan_x
        seen.y -= scan_y
        seen.centroid_x -= scan_x
        seen.centroid_y -= scan_y
    return moved


@kernel
def relative_angles(pairs: Records, theta: float) -> Floats:
    """Return ``wrap(angle(d_map) - angle(d_scan) - theta)``, (n,) radians."""
    c = math.cos(theta)
    s = math.sin(theta)
    angles = np.empty(len(pairs))
    for i in range(len(pairs)):
        line = pairs[i].map
        seen = pairs[i].scan
        dx = c * seen.dx - s * seen.dy
        dy = s * seen.dx + c * seen.dy
        angles[i] = math.atan2(dx * line.dy - dy * line.dx, dx * line.dx + dy * line.dy)
    return angles


@kernel
def offset_at(line: Record, x: float, y: float, c: float, s: float, tx: float, ty: float) -> float:
    """Return the signed distance of a scan point from a map line at a pose of cosine c and sine s."""
    gx = c * x - s * y + tx - line.x
    gy = s * x + c * y + ty - line.y
    return line.dx * gy - line.dy * gx


@kernel
def residuals(
    pairs: Records, used: Floats, information: Floats, theta: float, tx: float, ty: float
) -> tuple[Floats, Floats, float, float, float]:
    """Return offsets at the midpoints and angles, (n,) each, then chi2 and the root mean squares of both.

    `information` are the weights of chi2; the last three are of the pairs that count, whose `used` is over 0.
    """
    c = math.cos(theta)
    s = math.sin(theta)
    angles = relative_angles(pairs, theta)
    offsets = np.empty(len(pairs))
    chi2 = 0.0
    squared_offsets = 0.0
    squared_angles = 0.0
    count = 0
    for i in range(len(pairs)):
        line = pairs[i].map
        seen = pairs[i].scan
        offsets[i] = offset_at(line, seen.x, seen.y, c, s, tx, ty)
        if used[i] > 0.0:
            at_mean = offset_at(line, seen.centroid_x, seen.centroid_y, c, s, tx, ty)
            sine = math.sin(angles[i])
            chi2 += information[i] * (at_mean * at_mean + seen.spread * sine * sine)
            squared_offsets += offsets[i] * offsets[i]
            squared_angles += angles[i] * angles[i]
            count += 1
    return offsets, angles, chi2, math.sqrt(squared_offsets / count), math.sqrt(squared_angles / count)
