"""A map with some changes, and with sharper walls."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from registration import Segments

from .result import Change, Sharpened

Floats = NDArray[np.float64]


def apply(known: Segments, changes: Sequence[Change]) -> Segments:
    """Return the segments of a map with some changes.

    Segments that no change names keep their order. The first new segment of a change takes the place of its first old
    one; others are appended.
    """
    kept: list[Floats | None] = list(known.endpoints)
    appended: list[Floats] = []
    for one in changes:
        new = list(one.new)
        for old in one.segments:
            kept[old] = None
        if one.segments and new and one.code in ("shortened", "extended"):
            kept[one.segments[0]] = new.pop(0)
        appended += new
    ends = [*(one for one in kept if one is not None), *appended]
    return Segments.derived(np.array(ends).reshape(-1, 4))


def kept_indices(count: int, changes: Sequence[Change]) -> NDArray[np.intp]:
    """Return which old segment each segment of the map with some changes is, -1 for those that changes made."""
    kept = list(range(count))
    made = 0
    for one in changes:
        in_place = bool(one.segments) and len(one.new) > 0 and one.code in ("shortened", "extended")
        for old in one.segments:
            kept[old] = -2
        if in_place:
            kept[one.segments[0]] = -1
        made += len(one.new) - in_place
    return np.array([*(k for k in kept if k != -2), *[-1] * made], dtype=np.intp)


def with_ends(known: Segments, sharpened: Sharpened) -> Segments:
    """Return a map with its sharpened walls."""
    ends = known.endpoints.copy()
    ends[sharpened.segments] = sharpened.ends
    return Segments.derived(ends)


def sharper_sigma(known: Segments, sigma: float | None, sharpened: Sharpened) -> float | None:
    """Return the standard deviation of all lines of the new map: the root mean square by length, metres."""
    if sigma is None or not len(sharpened.segments):
        return sigma
    each = np.full(len(known), sigma)
    each[sharpened.segments] = sharpened.sigma
    return float(np.sqrt(known.lengths @ each**2 / known.lengths.sum()))
