"""Units of length that are taken for others: the factors between them, and which are likely."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from registration.layout import Floats
from registration.limits import MAX_LENGTH, MIN_LENGTH

from .context import SearchContext
from .scan.extents import inner_extent
from .tuning import (
    EXCEEDING,
    GREATEST_EXTENT,
    GREATEST_SAME_GATES,
    LEAST_EXTENT,
    MOST_FOR_UNITS,
    USUAL_EXTENT,
    USUAL_PART,
)

# Factor on a scan if the map's lengths are of one unit and are taken for another, which is the greater one; and the
# reverse.
TAKEN_FOR: Mapping[float, tuple[str, str]] = {
    10.0: ("decimetres", "metres"),
    100.0: ("centimetres", "metres"),
    1000.0: ("millimetres", "metres"),
    1.0 / 0.0254: ("inches", "metres"),
    1.0 / 0.3048: ("feet", "metres"),
    25.4: ("millimetres", "inches"),
    304.8: ("millimetres", "feet"),
    2.54: ("centimetres", "inches"),
    30.48: ("centimetres", "feet"),
    12.0: ("inches", "feet"),
}
UNITS = (*TAKEN_FOR, *(1.0 / factor for factor in TAKEN_FOR))
# The factor from each unit to metres.
UNIT_NAMES: Mapping[float, str] = {
    0.001: "millimetres",
    0.01: "centimetres",
    0.1: "decimetres",
    1000.0: "kilometres",
    0.3048: "feet",
    0.0254: "inches",
}
SAME_UNIT = 0.003  # of a factor; nearer to one of units it is that


def unit_mistake(factor: float) -> str | None:
    """Return which unit of a map was taken for which other, such as ``millimetres taken for inches``.

    Parameters
    ----------
    factor : float
        Lengths of the map, in units of those of a scan.
    """
    for known, (unit, other) in TAKEN_FOR.items():
        if abs(factor / known - 1.0) < SAME_UNIT:
            return f"{unit} taken for {other}"
        if abs(factor * known - 1.0) < SAME_UNIT:
            return f"{other} taken for {unit}"
    return None


def likely_map_units(context: SearchContext) -> list[float]:
    """Return the factors by which the map's unit may be wrong where the scan is as large as scans are.

    Scan lines are parts of walls: in the same unit their usual length is a quarter of that of walls to all of it.
    """
    index, scan = context.index, context.scan.measured.segments
    extent = inner_extent(scan)
    if not LEAST_EXTENT <= extent <= GREATEST_EXTENT or index.directed > MOST_FOR_UNITS:
        return []
    # In a map that is too small all lines are near one another, and are merged to walls that are none.
    seen, walls, pieces = _usual(scan.lengths), _usual(index.walls.longest), _usual(index.segments.lengths)
    off = {factor: factor * seen / (walls if factor > 1.0 else pieces) for factor in UNITS}
    likely = [
        factor
        for factor in UNITS
        if abs(math.log(factor)) > math.log(GREATEST_SAME_GATES)
        and USUAL_PART[0] <= off[factor] <= USUAL_PART[1]
        and extent * factor <= EXCEEDING * index.diagonal
        and float(index.segments.lengths.min()) / factor >= MIN_LENGTH
        and float(index.segments.lengths.max()) / factor <= MAX_LENGTH
    ]
    return sorted(likely, key=lambda factor: abs(math.log(off[factor])))


def _usual(lengths: Floats) -> float:
    """Return the length such that half of all length is in longer lines, metres."""
    ordered = np.sort(lengths)
    return float(ordered[np.searchsorted(np.cumsum(ordered), 0.5 * ordered.sum())])


def likely_units(context: SearchContext) -> list[float]:
    """Return the factors that make the scan as large as what lasers see on such a map, the usual size first."""
    segments = context.scan.measured.segments
    extent = inner_extent(segments)
    if extent <= 0.0:
        return []
    shortest, longest = float(segments.lengths.min()), float(segments.lengths.max())
    likely = [
        factor
        for factor in UNITS
        if LEAST_EXTENT <= extent * factor <= EXCEEDING * context.index.diagonal
        and shortest * factor >= MIN_LENGTH
        and longest * factor <= MAX_LENGTH
    ]
    return sorted(likely, key=lambda factor: abs(math.log(extent * factor / USUAL_EXTENT)))
