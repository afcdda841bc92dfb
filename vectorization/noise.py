"""Noise of ranges and points, estimated from the scan itself."""

from __future__ import annotations

import math

import numpy as np

from registration.layout import Floats, Records

from . import tuning
from .kernels.rays import misfits_and_quantum, select


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
    inside = np.lib.stride_tricks.sliding_window_view(places, tuning.WINDOW, axis=0)
    x, y = (inside - inside.mean(axis=2, keepdims=True)).transpose(1, 0, 2)
    xx, xy, yy = (x * x).sum(axis=1), (x * y).sum(axis=1), (y * y).sum(axis=1)
    squares = np.maximum(0.0, 0.5 * (xx + yy - np.hypot(xx - yy, 2.0 * xy))) / (tuning.WINDOW - 2)
    k = windows // 2
    select(squares, k)
    return max(math.sqrt(squares[k] / tuning.MEDIAN_CHI) or tuning.UNKNOWN_SIGMA, tuning.LEAST_SIGMA)
