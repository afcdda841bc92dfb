"""Grids over the walls of a map, their memory bounded whatever its extent."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from registration.layout import Records

from ..layout import BAND, CROSSING, CROSSING_SHAPE, ENDS, GRID_SHAPE, WALL, Integers, as_records, record
from ..tables import Crossings, Grid, Place, Raster, Sweep, Walls
from ..tuning import APART_STEP, NARROW_REACH, REACH, SECTORS
from .kernels.crossings import find_crossings, list_crossings, sample_crossings
from .kernels.walls import grid_cells
from .map_points import MapPoints
from .merging import ends_of, ends_of_rows
from .tuning import (
    CELL,
    CELL_GROWTH,
    CROSSING_BAND,
    CROSSING_REACHES,
    CROSSING_SAMPLE,
    CROSSING_SAMPLE_LOOKS,
    CROSSINGS_A_CHAIN,
    FEW_CHAINS,
    MAX_CELLS,
    MAX_ENTRIES,
    MAX_SWEEP_CELLS,
    MOST_BANDS,
    MOST_CROSSINGS,
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
    ends = ends_of(chains)
    squares = np.round(0.5 * (ends[:, :2] + ends[:, 2:]) / NEIGHBOURHOOD)
    order = np.lexsort((squares[:, 0], squares[:, 1]))
    rows = chains.rows[order]
    swept, present = _grid(ends[order], rows, SWEEP_CELL, SWEEP_REACH, MAX_SWEEP_CELLS)
    swept = swept._replace(items=swept.items * np.int32(SECTORS) + _sectors(rows)[swept.items])
    return Sweep(rows, rows["end"] - rows["begin"], swept, present)


def crossing_chains(chains: Records) -> Crossings:
    """List the pairs of chains (m,) that cross, up to as far from there as their number allows, or none."""
    ends, counted = ends_of_rows(chains), max(len(chains), FEW_CHAINS)
    most = [min(a_run * counted, at_most) for a_run, at_most in zip(CROSSINGS_A_CHAIN, MOST_CROSSINGS, strict=True)]
    boxed = boxes_in_bands(ends)
    # No farther than from one end of the map to the other: the fewer lists there are the sooner one is found.
    across = float(np.hypot(*np.ptp(ends.reshape(-1, 2), axis=0)))
    reaches = np.array([reach for reach in CROSSING_REACHES if reach <= across] or CROSSING_REACHES[-1:])
    every = max(1, len(chains) // CROSSING_SAMPLE)
    counts = sample_crossings(chains, *boxed, reaches, every, CROSSING_SAMPLE_LOOKS)
    allowed = (counts <= most).all(axis=1)
    for reach, count in zip(reaches[allowed].tolist(), counts[allowed, 0].tolist(), strict=True):
        found = np.empty(int(1.2 * count) + FEW_CHAINS, CROSSING)
        number, looks = find_crossings(chains, *boxed, reach, 2 * most[2], found)
        if number > 2 * most[0] or looks > 2 * most[2]:
            continue  # the sample was not like the rest
        if number > len(found):
            found = np.empty(number, CROSSING)
            find_crossings(chains, *boxed, reach, 2 * most[2], found)
        return listed(chains, found[:number], reach)
    return listed(chains, np.zeros(0, CROSSING), -1.0)


def boxes_in_bands(ends: Floats, height: float = CROSSING_BAND) -> tuple[Records, NDArray[np.int32], Records]:
    """Return the boxes around chains (m, 4), by bands of y and there by their left sides, their order, and the bands.

    (m,) of `ENDS`, (m,) and (b,) of `BAND`, each some `height` metres or more.
    """
    boxes = np.hstack([np.minimum(ends[:, :2], ends[:, 2:]), np.maximum(ends[:, :2], ends[:, 2:])])
    bottom, extent = boxes[:, 1].min(initial=np.inf), np.ptp(boxes[:, 1]) if len(boxes) else 0.0
    band_of = np.floor((boxes[:, 1] - bottom) / max(height, extent / MOST_BANDS))
    order = np.lexsort((boxes[:, 0], band_of))
    boxes, band_of = boxes[order], band_of[order]
    begins = np.flatnonzero(np.diff(band_of, prepend=-1.0))
    bands = np.zeros(len(begins), BAND)
    if len(begins):
        bands["begin"], bands["end"] = begins, np.append(begins[1:], len(boxes))
        bands["low"] = np.minimum.reduceat(boxes[:, 1], begins)
        bands["high"] = np.maximum.reduceat(boxes[:, 3], begins)
    return as_records(ENDS, boxes), order.astype(np.int32), bands


def listed(chains: Records, found: Records, reach: float) -> Crossings:
    """List crossings (k,) of `CROSSING`, all those of the chains that there are up to `reach` metres."""
    shape = record(CROSSING_SHAPE, reach=reach, columns=max(0, math.ceil(2.0 * reach / SWEEP_CELL)))
    return Crossings(shape, *list_crossings(chains, found, shape))


def directions_near(walls: Walls, chains: Walls) -> Raster:
    """Set in each cell the sectors of the walls and chains near it: chains also have directions over their doorways."""
    # The line of a chain may pass its walls by as much as they were joined with.
    rows = np.concatenate([walls.rows, chains.rows])
    ends, sectors = ends_of_rows(rows), _sectors(rows)
    shape = _shape(ends, RASTER_CELL, REACH + APART_STEP, MAX_CELLS)
    _, _, wide = grid_cells(as_records(ENDS, ends), sectors, REACH + APART_STEP, shape, False)
    _, _, narrow = grid_cells(as_records(ENDS, ends), sectors, NARROW_REACH + APART_STEP, shape, False)
    return Raster(shape, wide.astype(np.uint32) | narrow.astype(np.uint32) << np.uint32(SECTORS))


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
