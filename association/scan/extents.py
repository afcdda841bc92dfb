"""Measure the extents of scans, and which way their segments face."""

from __future__ import annotations

import numpy as np

from registration import Segments
from registration.layout import Floats

from .scan import Scan
from .tuning import EXTENT_ANGLES, OUTERMOST_SHARE

_ANGLES = np.arange(EXTENT_ANGLES) * (np.pi / EXTENT_ANGLES)
DIRECTIONS = np.stack([np.cos(_ANGLES), np.sin(_ANGLES)], axis=1)  # in which extents are looked for


def inner_extent(segments: Segments) -> float:
    """Return how wide segments lie apart in the direction in which that is most, without their outermost parts, metres.

    Of their length a fraction of `OUTERMOST_SHARE` at either end does not count: some beams leave through a window.
    """
    if not len(segments):
        return 0.0
    along = DIRECTIONS @ segments.endpoints.reshape(-1, 2).T
    order = np.argsort(along, axis=1)
    fractions = np.cumsum(np.repeat(segments.lengths, 2)[order], axis=1) / (2.0 * segments.lengths.sum())
    low = np.argmax(fractions >= OUTERMOST_SHARE, axis=1)
    high = np.argmax(fractions >= 1.0 - OUTERMOST_SHARE, axis=1)
    rows = np.arange(EXTENT_ANGLES)
    return float((along[rows, order[rows, high]] - along[rows, order[rows, low]]).max())


def whole_extent(scan: Scan) -> float:
    """Return the diagonal of the box around all that a scan shows, with the sensors and the ends of beams, metres."""
    points = [scan.measured.segments.endpoints.reshape(-1, 2)]
    if scan.viewpoint is not None:
        points.append(np.array([scan.viewpoint]))
    if scan.views is not None:
        points.append(scan.views.viewpoints[~np.isnan(scan.views.viewpoints[:, 0])])
    if scan.beams is not None:
        back = np.flatnonzero(np.isfinite(scan.beams.ranges))
        angles, ranges = scan.beams.angles[back], scan.beams.ranges[back]
        begins = np.array(scan.viewpoint or (0.0, 0.0)) if scan.beams.origins is None else scan.beams.origins[back]
        points.append(begins + ranges[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1))
    every = np.concatenate(points)
    return float(np.hypot(*np.ptp(every, axis=0))) if len(every) else 0.0


def facing_away(rows: Floats, places: Floats, least: float) -> int:
    """Count the segments, (n, 4), that have the place they were seen from on their right, by over `least` metres.

    `places` (n, 2), or (1, 2) where all were seen from there; nan where the place is unknown.
    """
    dx, dy = (rows[:, 2:] - rows[:, :2]).T
    x, y = (places - 0.5 * (rows[:, :2] + rows[:, 2:])).T
    return int(np.count_nonzero(dx * y - dy * x < -least * np.sqrt(dx * dx + dy * dy)))
