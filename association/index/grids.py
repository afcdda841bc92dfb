"""Grids over the walls of a map, their memory bounded whatever its extent."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from registration.layout import Records, floats

from ..layout import ENDS, GRID_SHAPE, WALL, Integers, as_records, record
from ..tables import Grid, Place, Raster, Sweep, Walls
from ..tuning import APART_STEP, REACH, SECTORS
from .kernels.walls import grid_cells
from .map_points import MapPoints
from .merging import ends_of, ends_of_rows
from .tuning import (
    CELL,
    CELL_GROWTH,
    MAX_CELLS,
    MAX_ENTRIES,
    MAX_SWEEP_CELLS,
    NEIGHBOURHOOD,
    RASTER_CELL,
    SWEEP_CELL,
    SWEEP_REACH,
)

Floats = NDArray[np.float64]


def near_walls(walls: Walls) -> Grid:
    """List in each cell the walls within `REACH` of it."""
    grid, _ = _grid(ends_of(walls), walls.rows, CELL, REACH, MAX_CELLS)
    return grid


def stopping_beams(place: Place, points: MapPoints) -> Place:
    """Return the walls with points of the index frame behind them, as two short walls each, for beams to end at."""
    arms = points.arms()
    rows = np.zeros(len(arms), WALL)
    across, along = slice(0, len(points)), slice(len(points), None)
    for name, values, half in (("dx", across, 0), ("dy", along, 1)):
        rows[name][values] = 1.0
        rows["begin"][values], rows["end"][values] = arms[values, half], arms[values, half + 2]
    rows["offset"][across], rows["offset"][along] = arms[across, 1], -arms[along, 0]
    rows["angle"][along] = 0.5 * math.pi
    rows["before"] = rows["after"] = -1
    walls = np.concatenate([place.walls, rows])
    grid, _ = _grid(ends_of_rows(walls), walls, RASTER_CELL, SWEEP_REACH, MAX_CELLS)
    return Place(walls, place.bin_starts, grid, np.append(place.ties, np.full(len(rows), -1.0)))


def swept_chains(chains: Walls) -> Sweep:
    """Return the chains, those that are near one another together, and which of them lie on each cell."""
    corners = ends_of(chains)
    squares = np.round(0.5 * (corners[:, :2] + corners[:, 2:]) / NEIGHBOURHOOD)
    order = np.lexsort((squares[:, 0], squares[:, 1]))
    rows = chains.rows[order]
    swept, present = _grid(corners[order], rows, SWEEP_CELL, SWEEP_REACH, MAX_SWEEP_CELLS)
    swept = swept._replace(items=swept.items * np.int32(SECTORS) + _sectors(rows)[swept.items])
    begins, ends = floats(rows, "begin", "end")
    return Sweep(rows, ends - begins, swept, present)


def directions_near(walls: Walls, chains: Walls) -> Raster:
    """Set in each cell the sectors of the walls and chains near it: chains also have directions over their doorways."""
    # The line of a chain may pass its walls by as much as they were joined with.
    rows = np.concatenate([walls.rows, chains.rows])
    ends, sectors = ends_of_rows(rows), _sectors(rows)
    shape = _shape(ends, RASTER_CELL, REACH + APART_STEP, MAX_CELLS)
    _, _, bits = grid_cells(as_records(ENDS, ends), sectors, REACH + APART_STEP, shape, False)
    return Raster(shape, bits)


def _sectors(walls: Records) -> NDArray[np.int32]:
    """Return the sector of the direction of each wall, of `SECTORS`."""
    return np.floor((walls["angle"] + np.pi) * (SECTORS / math.tau) + 0.5).astype(np.int32) % np.int32(SECTORS)


def _grid(ends: Floats, walls: Records, size: float, reach: float, most: int) -> tuple[Grid, Integers]:
    """Lay a grid of at most about `most` cells of `size` metres over what is within `reach` metres of the walls.

    Returns it, and the sectors of the walls that each cell lists, as bits.
    """
    shape = _shape(ends, size, reach, most)
    starts, items, bits = grid_cells(as_records(ENDS, ends), _sectors(walls), reach, shape, True)
    return Grid(shape, starts, items), bits


def _shape(ends: Floats, size: float, reach: float, most: int) -> Records:
    """Return corner, size and number of cells of `size` metres, (1,) of `GRID_SHAPE`.

    Or larger ones, where there would be more than `most`, or many long walls would be listed too often.
    """
    corners = ends.reshape(-1, 2)
    low = corners.min(axis=0) - reach - size
    extent = corners.max(axis=0) + reach + size - low
    cell = max(size, math.sqrt(extent[0] * extent[1] / most), extent.max() / most)
    spans = np.abs(ends[:, 2:] - ends[:, :2]).sum(axis=1)
    while float((spans / cell + 1.0).sum()) * (1.0 + 2.0 * reach / cell) > MAX_ENTRIES:
        cell *= CELL_GROWTH
    columns, rows = (math.ceil(e / cell) for e in extent)
    return record(GRID_SHAPE, x0=low[0], y0=low[1], cell=cell, columns=columns, rows=rows)
