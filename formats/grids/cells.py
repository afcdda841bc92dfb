"""Classify each cell of a grid as free, occupied or unknown."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from registration import RigidTransform

from ..line_map import GridPicture
from ..report import Notes
from . import tuning
from .unknown import Counts, Flags, UnknownLevels, find_unknown_levels, free_end, given_levels

FREE, OCCUPIED, UNKNOWN = 0, 1, -1
UNKNOWN_GREY = 205  # as map_saver writes it

Cells = NDArray[np.int8]


@dataclass(frozen=True, slots=True)
class Grid:
    """A grid as its file has it.

    Attributes
    ----------
    occupancy : (rows, columns) float32
        0 free to 1 occupied, nan for unknown cells of the file; row 0 is the lowest, y points up.
    resolution : float
        Edge of a cell, metres.
    origin : RigidTransform
        map_from_grid: where the lower left corner of cell (0, 0) lies, and how the grid is turned.
    occupied_above, free_below : float
        Thresholds of the file, occupancy.
    shades : tuple of int
        Levels of occupancy, 0 to 255, that tools write for unknown cells.
    unknown : tuple of int or None
        Levels of occupancy that the caller says stand for unknown cells; empty: none does; None: found.
    greys : tuple of int
        Grey value of the picture at levels 0 and 255; empty where the grid is no picture.
    """

    occupancy: NDArray[np.float32]
    resolution: float
    origin: RigidTransform
    occupied_above: float = 0.65
    free_below: float = 0.196
    shades: tuple[int, ...] = ()
    unknown: tuple[int, ...] | None = None
    greys: tuple[int, ...] = ()

    def named(self, level: int) -> str:
        """Return what a report calls a level of occupancy."""
        if not self.greys:
            return f"occupancy {level / (tuning.LEVELS - 1):.2f}"
        return f"grey value {abs(self.greys[0] - level)}"


def picture_of(grid: Grid) -> GridPicture:
    """Return a grid as a picture."""
    levels = np.where(
        np.isnan(grid.occupancy), np.float32(1.0 - UNKNOWN_GREY / 255.0), np.clip(grid.occupancy, 0.0, 1.0)
    )
    pixels = np.rint(255.0 * (1.0 - levels[::-1])).astype(np.uint8)
    return GridPicture(pixels, grid.origin, grid.resolution)


def classify(grid: Grid, notes: Notes) -> Cells:
    """Tell free, occupied and unknown cells apart.

    Unknown cells are found first, from the levels of the picture: no threshold makes them free or occupied. The others
    follow the thresholds of the file where these agree with the picture. If the thresholds leave most of the dark or
    of the light cells out, Otsu's threshold parts them.

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
    levels[told] = np.rint(np.clip(grid.occupancy[told], 0.0, 1.0) * (tuning.LEVELS - 1)).astype(np.int16)
    counts = np.bincount(levels[told].ravel(), minlength=tuning.LEVELS)
    found = _unknown_levels(grid, counts)
    known = np.where(found.taken, 0, counts)
    parted = otsu(known)
    kept = told & ~found.taken[levels]  # where levels is -1, told is False
    free, occupied = _by_thresholds(grid, kept, levels, found, counts)
    dark, light = int(known[parted + 1 :].sum()), int(known[: parted + 1].sum())
    few_occupied = int(occupied.sum()) < tuning.BELIEVED * dark
    # Of a gradient few cells may be free; of one light level all are.
    few_free = int(free.sum()) < tuning.BELIEVED * light < int(known[: parted + 1].max(initial=0))
    if grid.unknown != () and (few_occupied or few_free):
        occupied, free = kept & (levels > parted), kept & (levels <= parted)
        above = (parted + 0.5) / (tuning.LEVELS - 1)
        notes.add_assumed(
            "thresholds",
            f"the thresholds of the file exclude most {'dark' if few_occupied else 'light'} cells; cells are "
            f"occupied above an occupancy of {above:.3f} instead",
            dark if few_occupied else light,
        )
    _note_unknown(grid, found, counts, parted, notes)
    cells = np.full(grid.occupancy.shape, UNKNOWN, dtype=np.int8)
    cells[free] = FREE
    cells[occupied] = OCCUPIED
    return _edges_decided(cells, kept, grid)


def _unknown_levels(grid: Grid, counts: Counts) -> UnknownLevels:
    if grid.unknown is not None:
        return given_levels(grid.unknown)
    first, last = np.ceil(grid.free_below * (tuning.LEVELS - 1)), np.floor(grid.occupied_above * (tuning.LEVELS - 1))
    return find_unknown_levels(counts, grid.shades, (int(first), int(last)))


def _by_thresholds(
    grid: Grid, kept: Flags, levels: NDArray[np.int16], found: UnknownLevels, counts: Counts
) -> tuple[Flags, Flags]:
    """Return the free and the occupied cells by the file's thresholds; free ones are lighter than all unknown ones."""
    free, occupied = kept & (grid.occupancy < grid.free_below), kept & (grid.occupancy > grid.occupied_above)
    if grid.unknown is None and found.spikes:
        lightest = min(found.spikes)
        free &= levels < free_end(counts, lightest)
        occupied &= levels > lightest
    if grid.unknown == ():  # no cell is unknown: what lies between the thresholds is one or the other
        middle = 0.5 * (grid.free_below + grid.occupied_above)
        occupied |= kept & (grid.occupancy > middle)
        free |= kept & ~occupied
    return free & ~occupied, occupied


def _note_unknown(grid: Grid, found: UnknownLevels, counts: Counts, parted: int, notes: Notes) -> None:
    """Note which levels are taken as unknown against the thresholds of the file, and which might be and are not."""
    option = "set the option unknown to none, or to the grey value of unknown cells, if this is wrong"
    for spike in found.spikes if grid.unknown is None else ():
        occupancy = spike / (tuning.LEVELS - 1)
        kind = "free" if occupancy < grid.free_below else "occupied" if occupancy > grid.occupied_above else None
        if kind is not None:
            notes.add_assumed(
                "unknown_grey",
                f"cells of {grid.named(spike)} are unknown, although the thresholds of the file make them {kind}; "
                f"{option}",
                int(counts[spike]),
            )
    for level in found.refused:
        kind = "occupied" if level > parted else "free"
        notes.add_assumed(
            "unknown_grey",
            f"cells of {grid.named(level)} are the only ones that are {kind}, but many tools write this value for "
            f"unknown cells; {option}",
            int(counts[level]),
        )


def _edges_decided(cells: Cells, kept: Flags, grid: Grid) -> Cells:
    """Decide the cells between a free and an occupied one that are neither: pictures that were resized have such edges.

    Left unknown they would part the walls from the free cells.
    """
    between = kept & (cells == UNKNOWN)
    if not between.any():
        return cells
    edge = between.copy()
    beside = np.ones((3, 3), dtype=np.bool_)
    for kind in (FREE, OCCUPIED):  # through other such cells, not through a wall
        own = cells == kind
        edge &= scipy.ndimage.binary_dilation(own, beside, tuning.EDGE_REACH, mask=between | own)
    middle = np.float32(0.5 * (grid.free_below + grid.occupied_above))
    decided = np.where(grid.occupancy > middle, OCCUPIED, FREE)
    return np.where(edge, decided, cells).astype(np.int8)


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
