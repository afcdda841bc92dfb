"""Grids over the walls of a map, their memory bounded whatever its extent."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from registration.layout import Records

from .kernels.walls import direction_raster, grid_cells
from .layout import ENDS, GRID_SHAPE, as_records, record
from .tables import Grid, Raster, Walls
from .tuning import (
    CELL,
    CELL_GROWTH,
    MAX_CELLS,
    MAX_ENTRIES,
    MAX_SWEEP_CELLS,
    MERGE_LATERAL,
    NARROW_REACH,
    RASTER_CELL,
    REACH,
    SECTORS,
    SWEEP_CELL,
    SWEEP_REACH,
)
from .walls import ends_of

Floats = NDArray[np.float64]


def near_walls(walls: Walls) -> Grid:
    """List in each cell the walls within `REACH` of it."""
    return _grid(ends_of(walls), CELL, REACH, MAX_CELLS)


def swept_runs(runs: Walls) -> Grid:
    """List in each cell the runs on it, ``run * SECTORS + sector`` with the sector of its direction."""
    swept = _grid(ends_of(runs), SWEEP_CELL, SWEEP_REACH, MAX_SWEEP_CELLS)
    return swept._replace(items=swept.items * np.int32(SECTORS) + _sectors(runs)[swept.items])


def directions_near(walls: Walls, runs: Walls) -> Raster:
    """Set in each cell the sectors of the walls and runs near it: runs also have directions over their doorways."""
    # The line of a run may pass its walls by as much as they were merged with.
    both = np.vstack([ends_of(walls), ends_of(runs)])
    shape = _shape(both, RASTER_CELL, REACH + MERGE_LATERAL, MAX_CELLS)
    sectors, ends = np.concatenate([_sectors(walls), _sectors(runs)]), as_records(ENDS, both)
    bits = np.zeros(int(shape["columns"][0] * shape["rows"][0]), dtype=np.uint32)
    direction_raster(ends, REACH + MERGE_LATERAL, shape, sectors, bits)
    direction_raster(ends, NARROW_REACH + MERGE_LATERAL, shape, sectors + SECTORS, bits)
    return Raster(shape, bits)


def _sectors(walls: Walls) -> NDArray[np.int32]:
    """Return the sector of each direction, of `SECTORS`."""
    return np.floor((walls.rows["angle"] + np.pi) * (SECTORS / math.tau) + 0.5).astype(np.int32) % np.int32(SECTORS)


def _grid(ends: Floats, size: float, reach: float, most: int) -> Grid:
    """Lay a grid of at most about `most` cells of `size` metres over what is within `reach` metres of the walls."""
    shape = _shape(ends, size, reach, most)
    return Grid(shape, *grid_cells(as_records(ENDS, ends), reach, shape))


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
