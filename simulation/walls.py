"""Which segments are pieces of one wall."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from registration import Segments

Indices = NDArray[np.int64]

ANGLE = 1e-6  # rad; pieces of one wall differ less in direction,
OFFSET = 1e-5  # m; in their lines,
GAP = 1.5  # m; and lie no farther apart: a doorway may be between them


def wall_of_segment(segments: Segments) -> Indices:
    """Return for each segment the number of its wall, ``(n,)`` from 0 up; pieces of a wall share one line."""
    if len(segments) == 0:
        return np.zeros(0, dtype=np.int64)
    angles = np.arctan2(segments.directions[:, 1], segments.directions[:, 0])
    heading = np.round(angles / ANGLE) % round(math.tau / ANGLE)
    line = np.round(segments.offsets / OFFSET)
    begin = np.einsum("ij,ij->i", segments.endpoints[:, :2], segments.directions)
    order = np.lexsort([begin, line, heading])
    ends = begin + segments.lengths
    walls, count, reach = np.zeros(len(segments), dtype=np.int64), -1, -math.inf
    for k, here in enumerate(order):
        before = order[k - 1]
        along = k > 0 and heading[here] == heading[before] and line[here] == line[before]
        if not along or begin[here] > reach + GAP:
            count, reach = count + 1, -math.inf
        reach = max(reach, float(ends[here]))
        walls[here] = count
    return walls
