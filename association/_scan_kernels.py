"""Compiled rows of a scan; see `scan_rows` for what they mean, and `_match_kernels` for their columns."""

import math

import numpy as np

from registration.compiling import kernel

from ._match_kernels import SCAN_COLUMNS

# What no sigma that is sent accounts for: maps drawn or built with some slack, walls that are not quite straight.
MODEL_OFFSET = 0.02  # m
MODEL_ANGLE = math.radians(0.6)

# What finding a segment on a wall is worth against its being clutter, nats: a share of its own, and one by length.
GAIN = 6.0
GAIN_PER_METRE = 2.0
GAIN_LENGTH = 4.0  # m; beyond it a segment tells no more

LEAST_SPREAD = 1e-6  # m^2
LEAST_VARIANCE = 1e-8  # m^2


@kernel
def fill_rows(
    directions, midpoints, lengths, centroids, spreads, sigma, points, order, map_var, common_var, offset_var, angle_var
):
    """Return the rows of the segments in `order`, (n, 16).

    `map_var` is the variance of the map's lines and `common_var` that of what shifts neighbouring points together, m^2;
    `offset_var` and `angle_var` are what a row's variances are at least.
    """
    n = len(order)
    rows = np.zeros((n, SCAN_COLUMNS))
    later = 0.0
    for k in range(n - 1, -1, -1):
        i = order[k]
        line_var = sigma[i] * sigma[i] / points[i]
        rows[k, 0] = directions[i, 0]
        rows[k, 1] = directions[i, 1]
        rows[k, 2] = midpoints[i, 0]
        rows[k, 3] = midpoints[i, 1]
        rows[k, 4] = lengths[i]
        rows[k, 5] = math.atan2(directions[i, 1], directions[i, 0])
        rows[k, 6] = centroids[i, 0]
        rows[k, 7] = centroids[i, 1]
        rows[k, 8] = spreads[i]
        rows[k, 9] = max(offset_var, line_var + map_var + MODEL_OFFSET**2)
        rows[k, 10] = max(angle_var, (line_var + common_var) / max(spreads[i], LEAST_SPREAD) + MODEL_ANGLE**2)
        rows[k, 11] = 1.0 / rows[k, 9]
        rows[k, 12] = GAIN + GAIN_PER_METRE * min(lengths[i], GAIN_LENGTH)
        rows[k, 13] = later
        rows[k, 14] = max(LEAST_VARIANCE, line_var + map_var)
        later += rows[k, 12]
    return rows
