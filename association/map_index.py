"""The map as the search wants it: recentred, collinear pieces merged to walls, sorted by direction, in a grid."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from registration import Segments

from ._map_kernels import collinear_groups, direction_raster, grid_cells
from ._match_kernels import REACH, SECTORS
from .errors import InvalidMapError

Floats = NDArray[np.float64]

MAX_EXTENT = 1e5  # m
MERGE_GAP = 0.3  # m; a doorway is wider, the joint between two pieces of one wall is not
RUN_GAP = 1.5  # m; a scan segment may bridge a doorway
MERGE_LATERAL = 0.03  # m
MERGE_ANGLE = math.radians(2.0)
DIRECTION_BINS = 90
CELL = 1.0  # m
SWEEP_CELL = 2.0  # m
SWEEP_REACH = 0.02  # m; rounding
RASTER_CELL = 0.5  # m
MAX_CELLS = 4_000_000
MAX_SWEEP_CELLS = 1_000_000
MAX_ENTRIES = 10_000_000  # of all lists of a grid together, about


class Walls(NamedTuple):
    """The walls in the index's own frame (see `MapIndex.origin`), by direction bin and the longest of a bin first.

    Attributes
    ----------
    rows : (m, 8) direction x and y, offset along the left normal, abscissae of begin and end along the direction
        (metres), angle (radians in (-pi, pi]), the walls before and after it on its run or -1; see `_match_kernels`
    bin_starts : (DIRECTION_BINS + 1,) where each bin begins
    longest : (m,) their lengths, metres
    summed : (m + 1,) running sum of `longest`
    """

    rows: Floats
    bin_starts: NDArray[np.int64]
    longest: Floats
    summed: Floats


class Grid(NamedTuple):
    """A uniform grid over the walls.

    Attributes
    ----------
    shape : (5,) x0, y0, cell size (metres), columns, rows
    starts, items : cell ``c = row * columns + column`` lists ``items[starts[c]:starts[c + 1]]``
    """

    shape: Floats
    starts: NDArray[np.int32]
    items: NDArray[np.int32]


class Raster(NamedTuple):
    """Which directions the walls near a place have: the quickest way to see that a segment cannot lie there.

    Attributes
    ----------
    shape : (5,) as of `Grid`
    bits : (rows * columns,) bit s of a cell is set where a wall or a run, over its doorways, of direction sector s
        comes within `REACH` of it
    """

    shape: Floats
    bits: NDArray[np.uint16]


@dataclass(frozen=True)
class MapIndex:
    """What is computed once per map; immutable, shared between threads.

    Build with :meth:`build`.

    Attributes
    ----------
    segments : Segments
        As sent, in the map frame.
    sigma : float
        Standard deviation of the map's lines normal to themselves, metres.
    origin : (2,)
        Centre of the map, metres in the map frame; the index works relative to it, so that maps far out lose nothing.
    endpoints : (n, 4)
        Of the segments, relative to `origin`.
    directed : int
        Number of segments as sent; piece i stands for segment ``i % directed``.
    wall_of_piece : (n,) the wall that each segment is part of
    pieces, piece_starts : wall w consists of segments ``pieces[piece_starts[w]:piece_starts[w + 1]]``
    walls : Walls
    runs : Walls
        The walls joined across doorways: where a scan segment may lie that bridges one.
    grid : Grid
        Walls within `REACH` of each cell, whatever their direction: what lies at a point?
    sectors : Grid
        Runs on each cell, ``run * SECTORS + sector`` with the sector of its direction: which runs of that direction
        does a sweep meet? Told from the list alone, since a look at a run costs more than all else.
    raster : Raster
    """

    segments: Segments
    sigma: float
    origin: Floats
    endpoints: Floats
    directed: int
    wall_of_piece: NDArray[np.int32]
    pieces: NDArray[np.int32]
    piece_starts: NDArray[np.int64]
    walls: Walls
    runs: Walls
    grid: Grid
    sectors: Grid
    raster: Raster

    @classmethod
    def build(cls, segments: Segments, sigma: float = 0.0, *, oriented: bool = True) -> MapIndex:
        """Index a map; some 10 microseconds a segment.

        Parameters
        ----------
        segments : Segments
            At least one, within an extent of 100 km.
        sigma : float
            Standard deviation of the map's lines normal to themselves, metres, 0 to 10.
        oriented : bool
            False lists every segment in both directions, for scans whose directions mean nothing.

        Raises
        ------
        InvalidMapError
            When the map is empty or too wide, or sigma out of range.
        """
        if len(segments) == 0:
            raise InvalidMapError("a map has at least one segment", argument="map.segments")
        if not 0.0 <= sigma <= 10.0:
            raise InvalidMapError("expected a number from 0 to 10", argument="map.sigma")
        corners = segments.endpoints.reshape(-1, 2)
        low, high = corners.min(axis=0), corners.max(axis=0)
        if (high - low).max() > MAX_EXTENT:
            raise InvalidMapError(f"its extent is beyond {MAX_EXTENT:g} m", argument="map.segments")
        origin = np.round(0.5 * (low + high))
        return cls._of(segments if oriented else _both_ways(segments), sigma, origin, len(segments))

    @classmethod
    def _of(cls, segments: Segments, sigma: float, origin: Floats, directed: int) -> MapIndex:
        local = segments.shifted(-origin)
        walls, wall_of_piece = _merge(local, MERGE_GAP)
        runs, run_of_wall = _merge(Segments.from_array(_ends(walls)), RUN_GAP)
        _link(walls, run_of_wall)
        order = np.argsort(wall_of_piece, kind="stable").astype(np.int32)
        starts = np.searchsorted(wall_of_piece[order], np.arange(len(walls.rows) + 1))
        grids = _grids(walls, runs)
        return cls(
            segments, sigma, origin, local.endpoints, directed, wall_of_piece, order, starts, walls, runs, *grids
        )

    @cached_property
    def undirected(self) -> MapIndex:
        """The same map with every segment in both directions; itself where it was built so."""
        if len(self.segments) > self.directed:
            return self
        return MapIndex._of(_both_ways(self.segments), self.sigma, self.origin, self.directed)

    @cached_property
    def sorted_lengths(self) -> tuple[Floats, Floats]:
        """The walls' lengths in ascending order, and for each place the sum from there on; metres."""
        lengths = np.sort(self.walls.longest)
        return lengths, np.concatenate([np.cumsum(lengths[::-1])[::-1], [0.0]])

    @cached_property
    def crowd(self) -> float:
        """How many walls are on the list of a cell, seen from the walls: the mean over all entries of all lists."""
        counts = np.diff(self.grid.starts).astype(np.float64)
        return float((counts * counts).sum() / max(1.0, counts.sum()))

    @cached_property
    def agreeing_share(self) -> float:
        """The chance that two points of walls have the same direction, up to a neighbouring bin."""
        shares = np.add.reduceat(
            np.append(self.walls.longest, 0.0), np.minimum(self.walls.bin_starts[:-1], len(self.walls.rows))
        )
        shares = np.where(np.diff(self.walls.bin_starts) > 0, shares, 0.0) / self.walls.summed[-1]
        return float((shares * (shares + np.roll(shares, 1) + np.roll(shares, -1))).sum())

    @property
    def area(self) -> float:
        """Of the map's bounding box with a margin, m^2."""
        return float(self.grid.shape[2] ** 2 * self.grid.shape[3] * self.grid.shape[4])

    @property
    def nbytes(self) -> int:
        """Memory held, bytes."""
        tables: list[tuple[NDArray[Any], ...]] = [self.walls, self.runs, self.grid, self.sectors, self.raster]
        arrays: list[NDArray[Any]] = [self.endpoints, self.wall_of_piece, self.pieces, self.piece_starts]
        arrays += [array for table in tables for array in table]
        lines = [getattr(self.segments, field.name) for field in fields(Segments)]
        return sum(a.nbytes for a in arrays + lines)


def _both_ways(segments: Segments) -> Segments:
    return Segments.from_array(np.concatenate([segments.endpoints, segments.endpoints[:, [2, 3, 0, 1]]]))


def _merge(local: Segments, gap: float) -> tuple[Walls, NDArray[np.int32]]:
    """Put one line through each group of collinear pieces up to `gap` apart; a group that is not straight stays apart.

    Returns the lines, and the one that each piece is part of.
    """
    labels = collinear_groups(local.endpoints, local.directions, gap, MERGE_LATERAL, math.cos(MERGE_ANGLE))
    _, wall, counts = np.unique(labels, return_inverse=True, return_counts=True)
    m = len(counts)

    def line(wall: NDArray[np.intp], m: int) -> tuple[Floats, Floats, Floats]:
        d = np.zeros((m, 2))
        np.add.at(d, wall, local.directions * local.lengths[:, None])
        d /= np.linalg.norm(d, axis=1)[:, None]
        normals = np.stack([-d[:, 1], d[:, 0]], axis=1)
        weight = np.bincount(wall, local.lengths, m)
        offsets = np.bincount(wall, local.lengths * np.einsum("ij,ij->i", normals[wall], local.midpoints), m) / weight
        return d, normals, offsets

    d, normals, offsets = line(wall, m)
    lateral = np.maximum(
        np.abs(np.einsum("ij,ij->i", normals[wall], local.endpoints[:, :2]) - offsets[wall]),
        np.abs(np.einsum("ij,ij->i", normals[wall], local.endpoints[:, 2:]) - offsets[wall]),
    )
    crooked = np.zeros(m, dtype=bool)
    np.logical_or.at(crooked, wall, lateral > MERGE_LATERAL)
    if crooked.any():
        alone = crooked[wall]
        labels = np.where(alone, np.arange(len(labels)) + len(labels), labels)
        _, wall = np.unique(labels, return_inverse=True)
        m = int(wall.max()) + 1
        d, normals, offsets = line(wall, m)
    along_begin = np.einsum("ij,ij->i", d[wall], local.endpoints[:, :2])
    along_end = np.einsum("ij,ij->i", d[wall], local.endpoints[:, 2:])
    begins, ends = np.full(m, np.inf), np.full(m, -np.inf)
    np.minimum.at(begins, wall, along_begin)
    np.maximum.at(ends, wall, along_end)
    angles = np.arctan2(d[:, 1], d[:, 0])
    bins = direction_bin(angles)
    order = np.lexsort((np.arange(m), begins - ends, bins))
    starts = np.searchsorted(bins[order], np.arange(DIRECTION_BINS + 1))
    rows = np.column_stack([d, offsets, begins, ends, angles, np.full((m, 2), -1.0)])[order]
    longest = (ends - begins)[order]
    summed = np.concatenate([[0.0], np.cumsum(longest)])
    place = np.empty(m, dtype=np.int32)
    place[order] = np.arange(m)
    return Walls(np.ascontiguousarray(rows), starts, longest, summed), place[wall]


def _link(walls: Walls, run: NDArray[np.int32]) -> None:
    """Name in each wall's row its neighbours on its run, (m,)."""
    order = np.lexsort((walls.rows[:, 3], run))
    before, after = order[:-1], order[1:]
    same = run[before] == run[after]
    walls.rows[after[same], 6] = before[same]
    walls.rows[before[same], 7] = after[same]


def direction_bin(angles: Floats) -> NDArray[np.intp]:
    """Return the direction bin of each angle, radians in (-pi, pi]."""
    return np.minimum(((angles + np.pi) * (DIRECTION_BINS / math.tau)).astype(np.intp), DIRECTION_BINS - 1)


def _grids(walls: Walls, runs: Walls) -> tuple[Grid, Grid, Raster]:
    ends, sector, run_ends, run_sector = _ends(walls), _sectors(walls), _ends(runs), _sectors(runs)
    near, swept = _grid(ends, CELL, REACH, MAX_CELLS), _grid(run_ends, SWEEP_CELL, SWEEP_REACH, MAX_SWEEP_CELLS)
    swept = swept._replace(items=swept.items * np.int32(SECTORS) + run_sector[swept.items])
    # The line of a run may pass its walls by as much as they were merged with.
    both, reach = np.vstack([ends, run_ends]), REACH + MERGE_LATERAL
    shape = _shape(both, RASTER_CELL, reach, MAX_CELLS)
    bits = direction_raster(both, reach, shape, np.concatenate([sector, run_sector]))
    return near, swept, Raster(shape, bits)


def _ends(walls: Walls) -> Floats:
    """Return (m, 4) begin and end, metres in the index frame."""
    dx, dy, offset, begin, end = walls.rows.T[:5]
    a = np.column_stack([dx * begin - dy * offset, dy * begin + dx * offset])
    b = np.column_stack([dx * end - dy * offset, dy * end + dx * offset])
    return np.hstack([a, b])


def _sectors(walls: Walls) -> NDArray[np.int32]:
    """Return the sector of each direction, of `SECTORS`."""
    return np.floor((walls.rows[:, 5] + np.pi) * (SECTORS / math.tau) + 0.5).astype(np.int32) % np.int32(SECTORS)


def _grid(ends: Floats, size: float, reach: float, most: int) -> Grid:
    """Lay a grid of at most about `most` cells of `size` metres over what is within `reach` metres of the walls."""
    shape = _shape(ends, size, reach, most)
    return Grid(shape, *grid_cells(ends, reach, shape))


def _shape(ends: Floats, size: float, reach: float, most: int) -> Floats:
    """Return x0, y0, cell size, columns and rows of cells of `size` metres.

    Or larger ones, where there would be more than `most`, or many long walls would be listed too often.
    """
    corners = ends.reshape(-1, 2)
    low = corners.min(axis=0) - reach - size
    extent = corners.max(axis=0) + reach + size - low
    cell = max(size, math.sqrt(extent[0] * extent[1] / most), extent.max() / most)
    spans = np.abs(ends[:, 2:] - ends[:, :2]).sum(axis=1)
    while float((spans / cell + 1.0).sum()) * (1.0 + 2.0 * reach / cell) > MAX_ENTRIES:
        cell *= 1.25
    columns, rows = (math.ceil(e / cell) for e in extent)
    return np.array([low[0], low[1], cell, columns, rows])
