"""How large scans are."""

from __future__ import annotations

import numpy as np

from registration import Segments

from .tuning import EXTENT_ANGLES, OUTERMOST_SHARE


def diagonal(segments: Segments) -> float:
    """Return the diagonal of the box around segments, metres; 0 without any."""
    if not len(segments):
        return 0.0
    low, high = segments.endpoints.min(axis=0).tolist(), segments.endpoints.max(axis=0).tolist()
    return float(np.hypot(max(high[0::2]) - min(low[0::2]), max(high[1::2]) - min(low[1::2])))


def inner_extent(segments: Segments) -> float:
    """Return how wide segments lie apart in the direction in which that is most, metres.

    Of their length a share of `OUTERMOST_SHARE` at either end does not count: some beams leave through a window.
    """
    if not len(segments):
        return 0.0
    angles = np.arange(EXTENT_ANGLES) * (np.pi / EXTENT_ANGLES)
    along = segments.endpoints.reshape(-1, 2) @ np.stack([np.cos(angles), np.sin(angles)])
    order = np.argsort(along, axis=0)
    shares = np.cumsum(np.repeat(segments.lengths, 2)[order], axis=0) / (2.0 * segments.lengths.sum())
    low = np.argmax(shares >= OUTERMOST_SHARE, axis=0)
    high = np.argmax(shares >= 1.0 - OUTERMOST_SHARE, axis=0)
    columns = np.arange(EXTENT_ANGLES)
    return float((along[order[high, columns], columns] - along[order[low, columns], columns]).max())
