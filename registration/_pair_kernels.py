"""Compiled work on pairs of segments: a row of numbers each.

Columns of `rows` (n, 14), the map's in the map frame and the others in the scan frame: unit direction, midpoint (m) and
length (m) of the map segment; the same of the scan segment; mean of the points behind it (m), their second moment along
it (m^2), and the variance of its offset (m^2). Pairs of weight 0 do not count.
"""

import math

import numpy as np

from .compiling import kernel

PAIR_COLUMNS = 14
MAP_DX, MAP_DY, MAP_X, MAP_Y, MAP_LENGTH, DX, DY, X, Y, LENGTH, CENTROID_X, CENTROID_Y, SPREAD, VARIANCE = range(
    PAIR_COLUMNS
)

MIN_SIGMA = 1e-12  # m; a smaller one that is not 0 counts as this, so that its square is not lost


@kernel
def first_outside(pairs, column, count):
    """Return the first row whose index in `column` is not from 0 to ``count - 1``, or -1."""
    for i in range(len(pairs)):
        if pairs[i, column] < 0 or pairs[i, column] >= count:
            return i
    return -1


@kernel
def gather(
    pairs, map_directions, map_midpoints, map_lengths, directions, midpoints, lengths, centroids, spreads, sigmas,
    points,
):  # fmt: skip
    """Return the rows of `pairs` (n, 2) of scan and map indices that are in range."""
    rows = np.empty((len(pairs), PAIR_COLUMNS))
    for k in range(len(pairs)):
        i = pairs[k, 0]
        j = pairs[k, 1]
        sigma = max(sigmas[i], MIN_SIGMA) if sigmas[i] > 0.0 else 0.0
        rows[k, MAP_DX] = map_directions[j, 0]
        rows[k, MAP_DY] = map_directions[j, 1]
        rows[k, MAP_X] = map_midpoints[j, 0]
        rows[k, MAP_Y] = map_midpoints[j, 1]
        rows[k, MAP_LENGTH] = map_lengths[j]
        rows[k, DX] = directions[i, 0]
        rows[k, DY] = directions[i, 1]
        rows[k, X] = midpoints[i, 0]
        rows[k, Y] = midpoints[i, 1]
        rows[k, LENGTH] = lengths[i]
        rows[k, CENTROID_X] = centroids[i, 0]
        rows[k, CENTROID_Y] = centroids[i, 1]
        rows[k, SPREAD] = spreads[i]
        rows[k, VARIANCE] = sigma * sigma / points[i]
    return rows


@kernel
def inverse_variances(rows, map_variance):
    """Return 1 / variance of each pair's offset (n,), and whether all pairs have a variance."""
    inverses = np.empty(len(rows))
    for i in range(len(rows)):
        variance = rows[i, VARIANCE] + map_variance
        if not variance > 0.0:
            return inverses, False
        inverses[i] = 1.0 / variance
    return inverses, True


@kernel
def middles(rows, weights):
    """Return the means of the map midpoints and of the points' means, ``(map_x, map_y, scan_x, scan_y)``, and n."""
    map_x = 0.0
    map_y = 0.0
    scan_x = 0.0
    scan_y = 0.0
    count = 0
    for i in range(len(rows)):
        if weights[i] > 0.0:
            map_x += rows[i, MAP_X]
            map_y += rows[i, MAP_Y]
            scan_x += rows[i, CENTROID_X]
            scan_y += rows[i, CENTROID_Y]
            count += 1
    return map_x / count, map_y / count, scan_x / count, scan_y / count, count


@kernel
def moved_origins(rows, map_x, map_y, scan_x, scan_y):
    """Return the rows in frames that have been moved to new origins."""
    moved = rows.copy()
    for i in range(len(rows)):
        moved[i, MAP_X] -= map_x
        moved[i, MAP_Y] -= map_y
        moved[i, X] -= scan_x
        moved[i, Y] -= scan_y
        moved[i, CENTROID_X] -= scan_x
        moved[i, CENTROID_Y] -= scan_y
    return moved


@kernel
def relative_angles(rows, theta):
    """Return ``wrap(angle(d_map) - angle(d_scan) - theta)``, (n,) radians."""
    c = math.cos(theta)
    s = math.sin(theta)
    angles = np.empty(len(rows))
    for i in range(len(rows)):
        dx = c * rows[i, DX] - s * rows[i, DY]
        dy = s * rows[i, DX] + c * rows[i, DY]
        across = dx * rows[i, MAP_DY] - dy * rows[i, MAP_DX]
        along = dx * rows[i, MAP_DX] + dy * rows[i, MAP_DY]
        angles[i] = math.atan2(across, along)
    return angles


@kernel
def offset_at(rows, i, px, py, c, s, tx, ty):
    """Return the signed distance of a moved scan point from the map line of pair i."""
    gx = c * px - s * py + tx - rows[i, MAP_X]
    gy = s * px + c * py + ty - rows[i, MAP_Y]
    return rows[i, MAP_DX] * gy - rows[i, MAP_DY] * gx


@kernel
def residuals(rows, used, information, theta, tx, ty):
    """Return offsets at the midpoints and angles, (n,) each, then chi2 and the root mean squares of both.

    `information` are the weights of chi2; the last three are of the pairs that count, whose `used` is over 0.
    """
    c = math.cos(theta)
    s = math.sin(theta)
    angles = relative_angles(rows, theta)
    offsets = np.empty(len(rows))
    chi2 = 0.0
    squared_offsets = 0.0
    squared_angles = 0.0
    count = 0
    for i in range(len(rows)):
        offsets[i] = offset_at(rows, i, rows[i, X], rows[i, Y], c, s, tx, ty)
        if used[i] > 0.0:
            at_mean = offset_at(rows, i, rows[i, CENTROID_X], rows[i, CENTROID_Y], c, s, tx, ty)
            sine = math.sin(angles[i])
            chi2 += information[i] * (at_mean * at_mean + rows[i, SPREAD] * sine * sine)
            squared_offsets += offsets[i] * offsets[i]
            squared_angles += angles[i] * angles[i]
            count += 1
    return offsets, angles, chi2, math.sqrt(squared_offsets / count), math.sqrt(squared_angles / count)
