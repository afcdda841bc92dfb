"""A map with some changes, and with sharper walls."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from registration import InvalidArgumentError, Segments

from .result import NOT_SHARPENED, Replacement, Sharpened

Floats = NDArray[np.float64]


def apply_changes(
    known: Segments, sigma: float | None, changes: Sequence[Replacement], sharpened: Sharpened = NOT_SHARPENED
) -> tuple[Segments, float | None]:
    """Return a map with the changes that were accepted, and the standard deviation of its lines.

    Parameters
    ----------
    known : Segments
        The old map, metres.
    sigma : float or None
        Standard deviation of its lines, metres; None: not declared.
    changes : sequence of Replacement
        Those of a proposal that were accepted.
    sharpened : Sharpened, optional
        Of the same proposal.

    Raises
    ------
    InvalidArgumentError
        When a change or a sharpened wall names a segment that the old map does not have, two changes name the same
        one, or no segment is left.
    """
    named: set[int] = set()
    for number, one in enumerate(changes):
        unknown = [k for k in one.segments if not 0 <= k < len(known)]
        if unknown:
            told = f"found segment {unknown[0]}, expected indices of the {len(known)} segments of the old map"
            raise InvalidArgumentError(told, argument="changes", index=number)
        if named & set(one.segments) or len(set(one.segments)) < len(one.segments):
            told = "found a segment that was named before, expected each segment once; accept one of the changes"
            raise InvalidArgumentError(told, argument="changes", index=number)
        named.update(one.segments)
    if len(sharpened.segments) and int(sharpened.segments.max()) >= len(known):
        told = f"found segment {int(sharpened.segments.max())}, expected indices below {len(known)}"
        raise InvalidArgumentError(told, argument="sharpened.segments")
    new, _ = apply(with_ends(known, sharpened), changes)
    if not len(new):
        told = "found no segment that is left, expected at least one; refuse a change"
        raise InvalidArgumentError(told, argument="changes")
    return new, sharper_sigma(known, sigma, sharpened)


def apply(known: Segments, changes: Sequence[Replacement]) -> tuple[Segments, NDArray[np.intp]]:
    """Return the segments of a map with some changes, and which old segment each of them is, -1 for new ones.

    Segments that no change names keep their order. The first new segment of a change takes the place of its first old
    one; others are appended.
    """
    kept = {k: (ends, k) for k, ends in enumerate(known.endpoints)}
    appended: list[tuple[Floats, int]] = []
    for one in changes:
        new = [(ends, -1) for ends in one.new]
        for old in one.segments:
            kept.pop(old, None)
        if one.segments and new and one.code in ("shortened", "extended"):
            kept[one.segments[0]] = new.pop(0)
        appended += new
    found = [*(kept[k] for k in sorted(kept)), *appended]
    ends = np.array([ends for ends, _ in found]).reshape(-1, 4)
    return Segments.derived(ends), np.array([k for _, k in found], dtype=np.intp)


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
