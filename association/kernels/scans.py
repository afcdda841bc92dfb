"""Compiled records of a scan; see `association.scan_segments` for what they mean."""

import math

import numpy as np

from registration.compiling import kernel
from registration.layout import Records

from ..layout import SCAN_SEGMENT, Integers, Measured
from ..tuning import (
    GAIN,
    GAIN_LENGTH,
    GAIN_PER_METRE,
    LEAST_SPREAD,
    LEAST_VARIANCE,
    MODEL_ANGLE,
    MODEL_OFFSET,
)


@kernel
def describe_segments(measured: Measured, order: Integers, variances: Records) -> Records:
    """Return the segments of `measured` in `order`, (n,) of `SCAN_SEGMENT`; `variances` (1,) of `VARIANCES`."""
    directions = measured.directions
    midpoints = measured.midpoints
    lengths = measured.lengths
    centroids = measured.centroids
    spreads = measured.spreads
    sigma = measured.sigma
    points = measured.points
    given = variances[0]
    n = len(order)
    out = np.zeros(n, dtype=SCAN_SEGMENT)
    later = 0.0
    for k in range(n - 1, -1, -1):
        i = order[k]
        line_var = sigma[i] * sigma[i] / points[i]
        one = out[k]
        one.dx = directions[i].x
        one.dy = directions[i].y
        one.x = midpoints[i].x
        one.y = midpoints[i].y
        one.length = lengths[i]
        one.angle = math.atan2(directions[i].y, directions[i].x)
        one.centroid_x = centroids[i].x
        one.centroid_y = centroids[i].y
        one.spread = spreads[i]
        one.offset_variance = max(given.least_offset, line_var + given.map + MODEL_OFFSET**2)
        one.angle_variance = max(
            given.least_angle, (line_var + given.common) / max(spreads[i], LEAST_SPREAD) + MODEL_ANGLE**2
        )
        one.weight = 1.0 / one.offset_variance
        one.gain = GAIN + GAIN_PER_METRE * min(lengths[i], GAIN_LENGTH)
        one.later_gain = later
        one.plain_variance = max(LEAST_VARIANCE, line_var + given.map)
        later += one.gain
    return out
