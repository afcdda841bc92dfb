"""What each cell of a grid is: free, occupied or not known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from registration import RigidTransform

from ..report import Notes
from .tuning import BELIEVED, DARKER_SHARE, DARKEST_UNKNOWN, LEVELS, SPIKE_RATIO, SPIKE_SHARE

FREE, OCCUPIED, UNKNOWN = 0, 1, -1

Cells = NDArray[np.int8]
Counts = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Grid:
    """A grid as its file has it.

    Attributes
    ----------
    occupancy : (rows, columns) float32
        0 free to 1 occupied, nan where the file says that nothing is known; row 0 is the lowest, y points up.
    resolution : float
        Edge of a cell, metres.
    origin : RigidTransform
        map_from_grid: where the lower left corner of cell (0, 0) lies, and how the grid is turned.
    occupied_above, free_below : float
        Thresholds of the file, occupancy.
    """

    occupancy: NDArray[np.float32]
    resolution: float
    origin: RigidTransform
    occupied_above: float = 0.65
    free_below: float = 0.196


def classify(grid: Grid, notes: Notes) -> Cells:
    """Tell free, occupied and unknown cells apart.

    The thresholds of the file are believed where they agree with the picture. Where they leave most of the dark cells
    out, the picture decides: a level that many cells have exactly, between light and dark, is what is not known, and
    Otsu's threshold parts the rest.

    Parameters
    ----------
    grid : Grid
    notes : Notes
        Takes what was assumed.

    Returns
    -------
    (rows, columns) int8
        0 free, 1 occupied, -1 unknown.
    """
    told = ~np.isnan(grid.occupancy)
    levels = np.full(grid.occupancy.shape, -1, dtype=np.int16)
    levels[told] = np.rint(np.clip(grid.occupancy[told], 0.0, 1.0) * (LEVELS - 1)).astype(np.int16)
    counts = np.bincount(levels[told].ravel(), minlength=LEVELS)
    unknown_level = find_unknown_level(counts)
    known = counts.copy()
    if unknown_level is not None:
        known[unknown_level] = 0
    parted = otsu(known)
    dark = int(known[parted + 1 :].sum())
    occupied = told & (grid.occupancy > grid.occupied_above)
    if int(occupied.sum()) >= BELIEVED * dark:
        free = told & (grid.occupancy < grid.free_below)
    else:
        occupied = levels > parted
        free = (levels >= 0) & ~occupied
        if unknown_level is not None:
            occupied &= levels != unknown_level
            free &= levels != unknown_level
        above = (parted + 0.5) / (LEVELS - 1)
        notes.add_assumed(
            "thresholds",
            f"the file's thresholds leave most dark cells out; occupied is taken above {above:.3f} instead",
            dark,
        )
    cells = np.full(grid.occupancy.shape, UNKNOWN, dtype=np.int8)
    cells[free] = FREE
    cells[occupied] = OCCUPIED
    return cells


def find_unknown_level(counts: Counts) -> int | None:
    """Find the level of the cells of which nothing is known.

    Parameters
    ----------
    counts : (256,)
        Cells of each level of occupancy, light first.

    Returns
    -------
    int or None
        None where no level between light and dark stands out.
    """
    total = int(counts.sum())
    beside = np.maximum(np.r_[0, counts[:-1]], np.r_[counts[1:], 0])
    stands_out = (counts > SPIKE_SHARE * total) & (counts > SPIKE_RATIO * beside)
    spikes = np.flatnonzero(stands_out)
    if len(spikes) < 2:
        return None
    free = int(counts[spikes[0]])
    darker = total - np.cumsum(counts)
    fit = [k for k in spikes[1:] if k <= DARKEST_UNKNOWN * (LEVELS - 1) and darker[k] >= DARKER_SHARE * free]
    return int(max(fit, key=lambda k: counts[k])) if fit else None


def otsu(counts: Counts) -> int:
    """Return the last level of the lighter of two classes, so that the variance between them is greatest.

    Otsu, A threshold selection method from gray-level histograms, 1979.

    Parameters
    ----------
    counts : (n,)
        Cells of each level.
    """
    weights = np.cumsum(counts).astype(np.float64)
    moments = np.cumsum(counts * np.arange(len(counts), dtype=np.float64))
    lighter, darker = weights, weights[-1] - weights
    both = lighter * darker
    between = np.zeros(len(counts))
    inner = both > 0.0
    between[inner] = (moments[-1] * lighter[inner] / weights[-1] - moments[inner]) ** 2 / both[inner]
    # Levels that no cell has make a plateau: its middle is farthest from either class.
    best = np.flatnonzero(between >= between.max() * (1.0 - 1e-12))
    return int((best[0] + best[-1]) // 2)
