"""Twin of the kernel that describes a scan."""

from __future__ import annotations

import math

import numpy as np

from association.layout import SCAN_SEGMENT
from association.tuning import (
    GAIN,
    GAIN_LENGTH,
    GAIN_PER_METRE,
    LEAST_SPREAD,
    LEAST_VARIANCE,
    MODEL_ANGLE,
    MODEL_OFFSET,
)
from registration import MeasuredSegments
from registration.layout import Record, Records


def describe_segments(measured: MeasuredSegments, variances: Record) -> tuple[list[int], Records]:
    """Take one segment at a time, the longest first; return their order and what is known of them."""
    segments = measured.segments
    order = sorted(range(len(segments)), key=lambda i: (-segments.lengths[i], i))
    rows = np.zeros(len(order), SCAN_SEGMENT)
    for row, i in zip(rows, order, strict=True):
        row["dx"], row["dy"] = segments.directions[i]
        row["x"], row["y"] = segments.midpoints[i]
        row["length"] = segments.lengths[i]
        row["angle"] = math.atan2(segments.directions[i][1], segments.directions[i][0])
        row["centroid_x"], row["centroid_y"] = measured.centroids[i]
        row["spread"] = measured.spreads[i]
        mean = measured.sigma[i] ** 2 / measured.points[i]  # variance of the mean of the points
        row["offset_variance"] = max(variances["least_offset"], mean + variances["map"] + MODEL_OFFSET**2)
        angle = (mean + variances["common"]) / max(LEAST_SPREAD, measured.spreads[i]) + MODEL_ANGLE**2
        row["angle_variance"] = max(variances["least_angle"], angle)
        row["weight"] = 1.0 / row["offset_variance"]
        row["gain"] = GAIN + GAIN_PER_METRE * min(segments.lengths[i], GAIN_LENGTH)
        row["plain_variance"] = max(LEAST_VARIANCE, mean + variances["map"])
    for k, row in enumerate(rows):
        row["later_gain"] = rows["gain"][k + 1 :].sum()
    return order, rows
