"""Work on pairs of a map and a scan segment, records of type PAIR; those of weight 0 do not count."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from compiled import kernel

from ..layout import Floats, Record, Records, X, Y
from ..tables import Drawn, Points

MIN_SIGMA = 1e-12  # m; a smaller one that is not 0 counts as this, so that its square is not lost


SCAN, MAP = 0, 1  # columns of the (n, 2) indices that name pairs


@kernel
def first_outside(indices: NDArray[np.intp], scan_count: int, map_count: int) -> tuple[int, int]:
    """Return row and column of the first of `indices` (n, 2) that names no segment, column by column; or row -1."""
    for column in range(2):
        count = scan_count if column == SCAN else map_count
        for i in range(len(indices)):
            if indices[i, column] < 0 or indices[i, column] >= count:
                return i, column
    return -1, 0


@kernel
def fill_in(
    pairs: Records, indices: NDArray[np.intp], on_map: Drawn, scan: Drawn, points: Points
) -> tuple[int, int, float]:
    """Write the segments of map and scan that `indices` (n, 2) name to the pairs, and the points behind these.

    Returns what `first_outside` does, where nothing is written unless that is no row, and how many points are behind
    the scan segment that has fewest of them, named or not.
    """
    row, column = first_outside(indices, len(scan.lengths), len(on_map.lengths))
    fewest = math.inf
    for k in range(len(points.counts)):
        fewest = min(fewest, points.counts[k])
    if row >= 0:
        return row, column, fewest
    for i in range(len(pairs)):
        j = indices[i, MAP]
        line = pairs[i].map
        line.dx = on_map.directions[j, X]
        line.dy = on_map.directions[j, Y]
        line.x = on_map.midpoints[j, X]
        line.y = on_map.midpoints[j, Y]
        line.offset = offset_of(line)
        line.length = on_map.lengths[j]
        j = indices[i, SCAN]
        seen = pairs[i].scan
        seen.dx = scan.directions[j, X]
        seen.dy = scan.directions[j, Y]
        seen.x = scan.midpoints[j, X]
        seen.y = scan.midpoints[j, Y]
        seen.length = scan.lengths[j]
        seen.centroid_x = points.centroids[j, X]
        seen.centroid_y = points.centroids[j, Y]
        seen.spread = points.spreads[j]
        sigma = max(points.sigmas[j], MIN_SIGMA) if points.sigmas[j] > 0.0 else 0.0
        seen.variance = sigma * sigma / points.counts[j]
    return row, column, fewest


@kernel
def offset_of(line: Record) -> float:
    """Return the offset of a line by its direction and a point on it, a record with `dx`, `dy`, `x` and `y`."""
    return -line.dy * line.x + line.dx * line.y


@kernel
def inverse_variances(pairs: Records, map_variance: float) -> tuple[Floats, bool]:
    """Return 1 / variance of each pair's offset (n,), and whether all pairs have a variance."""
    inverses = np.empty(len(pairs), np.float64)
    for i in range(len(pairs)):
        variance = pairs[i].scan.variance + map_variance
        if not variance > 0.0:
            return inverses, False
        inverses[i] = 1.0 / variance
    return inverses, True


@kernel
def angle_chi_square(pairs: Records, weights: Floats) -> tuple[float, int]:
    """Return the smaller eigenvalue of ``sum w s d d'`` over the map lines' directions d, and how many pairs count.

    That is ``sum w s sin^2`` of the angles to the direction from which it is least, s being the spread.
    """
    xx = 0.0
    xy = 0.0
    yy = 0.0
    count = 0
    for i in range(len(pairs)):
        if weights[i] > 0.0:
            line = pairs[i].map
            angle = weights[i] * pairs[i].scan.spread
            xx += angle * line.dx * line.dx
            xy += angle * line.dx * line.dy
            yy += angle * line.dy * line.dy
            count += 1
    return max(0.0, 0.5 * (xx + yy) - math.hypot(0.5 * (xx - yy), xy)), count


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
def move_origins(pairs: Records, map_x: float, map_y: float, scan_x: float, scan_y: float, moved: Records) -> None:
    """Write the pairs in frames that have been moved to new origins to `moved`."""
    for i in range(len(pairs)):
        moved[i] = pairs[i]
        line = moved[i].map
        line.x -= map_x
        line.y -= map_y
        line.offset = offset_of(line)
        seen = moved[i].scan
        seen.x -= scan_x
        seen.y -= scan_y
        seen.centroid_x -= scan_x
        seen.centroid_y -= scan_y


@kernel
def relative_angles(pairs: Records, theta: float) -> Floats:
    """Return ``wrap(angle(d_map) - angle(d_scan) - theta)``, (n,) radians."""
    c = math.cos(theta)
    s = math.sin(theta)
    angles = np.empty(len(pairs), np.float64)
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
) -> tuple[Floats, Floats, float, float, float, bool]:
    """Return offsets at the midpoints and angles, (n,) each, then chi2 and the root mean squares of both.

    `information` are the weights of chi2; these three are of the pairs that count, whose `used` is over 0. At last,
    whether any scan segment runs against its map segment.
    """
    c = math.cos(theta)
    s = math.sin(theta)
    angles = relative_angles(pairs, theta)
    offsets = np.empty(len(pairs), np.float64)
    chi2 = 0.0
    squared_offsets = 0.0
    squared_angles = 0.0
    against = False
    count = 0
    for i in range(len(pairs)):
        line = pairs[i].map
        seen = pairs[i].scan
        against |= abs(angles[i]) > 0.5 * math.pi
        offsets[i] = offset_at(line, seen.x, seen.y, c, s, tx, ty)
        if used[i] > 0.0:
            at_mean = offset_at(line, seen.centroid_x, seen.centroid_y, c, s, tx, ty)
            sine = math.sin(angles[i])
            chi2 += information[i] * (at_mean * at_mean + seen.spread * sine * sine)
            squared_offsets += offsets[i] * offsets[i]
            squared_angles += angles[i] * angles[i]
            count += 1
    return offsets, angles, chi2, math.sqrt(squared_offsets / count), math.sqrt(squared_angles / count), against
