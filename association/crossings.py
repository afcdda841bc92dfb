"""The pairs of runs whose lines cross near both, as far as memory and time allow."""

from __future__ import annotations

import numpy as np

from .grids import drawn_out
from .kernels.crossings import block_crossings, crossing_keys, list_crossings
from .layout import CROSSING, Crossings, Walls
from .tuning import (
    CROSSING_REACH,
    CROSSING_SHRINK,
    LEAST_CROSSING_REACH,
    MOST_CROSSING_TESTS,
    MOST_CROSSINGS,
)

PLACE = 2**32 - 1  # the bits of a key that are no order


def crossings_of(runs: Walls) -> Crossings:
    """List them up to `CROSSING_REACH` metres from both, or less far where there are too many; none at worst."""
    reach = CROSSING_REACH
    while reach >= LEAST_CROSSING_REACH:
        grid = drawn_out(runs, reach)
        there = np.diff(grid.starts).astype(np.float64)
        if float((there * there).sum()) <= 2.0 * MOST_CROSSING_TESTS:
            count, rows = list_crossings(runs.rows, grid, reach, MOST_CROSSINGS)
            if count <= MOST_CROSSINGS:
                rows = rows[np.sort(crossing_keys(rows)) & PLACE]
                return Crossings(rows, *block_crossings(rows), reach)
        reach /= CROSSING_SHRINK
    return no_crossings()


def no_crossings() -> Crossings:
    """Return a list of none."""
    none = np.zeros(0, CROSSING)
    return Crossings(none, *block_crossings(none), 0.0)
