"""The map as the search wants it: recentred, collinear pieces merged to walls, sorted by direction, in a grid."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, fields, is_dataclass
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from registration import Segments

from ..deadline import Deadline
from ..errors import IndexingEndedError, InvalidMapError
from ..layout import ENDS, Integers, as_records
from ..tables import Grid, MapTables, Pieces, Place, Raster, Sweep, Walls
from ..tuning import WHOLE_GAP
from .grids import directions_near, near_walls, stopping_beams, swept_chains
from .map_points import NO_POINTS, MapPoints
from .merging import blended, both_ways, chains_of, merge, tie
from .tuning import BLENDED_SIGMAS, BLENDED_STEP, LEAST_DIFFERENCE, MAX_EXTENT, MAX_MAP_SIGMA, ONE_LINE, ONE_LINE_SHARE

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class MapIndex:
    """Everything that is computed once per map; immutable, shared between threads.

    Build with :meth:`build`.

    Attributes
    ----------
    segments : Segments
        As sent, in the map frame.
    sigma : float or None
        Standard deviation of the map's lines normal to themselves, metres; None: estimated for each answer.
    origin : (2,)
        Centre of the map, metres in the map frame; the index works relative to it, so that maps far out lose nothing.
    directed : int
        Number of segments as sent; piece i stands for segment ``i % directed``.
    points : MapPoints
        Objects too small for a wall, in the map frame: evidence for beams.
    frame_id : str or None
        Name of the map frame; of several maps together that of the first.
    wall_of_piece : (n,) the wall that each segment is part of
    pieces : Pieces
        Which segments each wall consists of.
    walls : Walls
    ties : (m,) how walls that continue one another are tied: see `tables.Place`
    chains : Walls
        Lines through walls that nearly continue one another, also across doorways: where a segment of a base may lie.
    grid : Grid
        Walls within `REACH` of each cell, whatever their direction: the walls that lie at a point.
    sweep : Sweep
        Which chains of a direction does a sweep meet? The list alone answers this, since reading a chain takes longer
        than all else.
    raster : Raster
        The quickest way to see that a segment cannot lie at a place.
    """

    segments: Segments
    sigma: float | None
    origin: Floats
    directed: int
    points: MapPoints
    frame_id: str | None
    wall_of_piece: Integers
    pieces: Pieces
    walls: Walls
    ties: Floats
    chains: Walls
    grid: Grid
    sweep: Sweep
    raster: Raster

    @classmethod
    def build(
        cls,
        segments: Segments,
        sigma: float | None = None,
        *,
        oriented: bool = True,
        points: MapPoints = NO_POINTS,
        frame_id: str | None = None,
        deadline: Deadline | None = None,
    ) -> MapIndex:
        """Index a map; some 10 microseconds a segment.

        Parameters
        ----------
        segments : Segments
            At least one, within an extent of 100 km.
        sigma : float or None
            Standard deviation of the map's lines normal to themselves, metres, 0 to 10; None: it is not known, and
            each answer estimates it from what its walls leave.
        oriented : bool
            False lists every segment in both directions, for scans whose directions mean nothing.
        points : MapPoints, optional
            Objects too small for a wall, in the map frame: evidence for the beams of a scan. Those more than 40 m
            outside the box around the segments are left out.
        frame_id : str, optional
            Name of the map frame.
        deadline : Deadline, optional
            Looked at every few tenths of a second.

        Raises
        ------
        InvalidMapError
            When the map is empty or too wide, or sigma out of range.
        IndexingEndedError
            When the deadline passes, or is cancelled, first.
        """
        low, high = cls.require(segments, sigma, "map.")
        origin = np.round(0.5 * (low + high))
        either = segments if oriented else both_ways(segments)
        tables = tables_of(either.shifted(-origin), sigma, deadline)
        return cls(either, sigma, origin, len(segments), points.near(low, high), frame_id, *tables).warmed()

    @staticmethod
    def require(segments: Segments, sigma: float | None, path: str) -> tuple[Floats, Floats]:
        """Return the low and the high corner of a map, (2,) metres, that can be indexed.

        Raises
        ------
        InvalidMapError
            As `build`; names of arguments begin with `path`.
        """
        if len(segments) == 0:
            raise InvalidMapError("expected at least one segment, found none", argument=f"{path}segments")
        if sigma is not None and not 0.0 <= sigma <= MAX_MAP_SIGMA:
            raise InvalidMapError(
                f"expected a number from 0 to {MAX_MAP_SIGMA:g} m, found {sigma:g}", argument=f"{path}sigma"
            )
        corners = segments.endpoints.reshape(-1, 2)
        low, high = corners.min(axis=0), corners.max(axis=0)
        extent = float((high - low).max())
        if extent > MAX_EXTENT:
            raise InvalidMapError(
                f"expected an extent of at most {MAX_EXTENT:g} m, found {extent:.4g} m; check the unit",
                argument=f"{path}segments",
            )
        return low, high

    @property
    def oriented(self) -> bool:
        """True if the directions of segments mean anything; otherwise each segment is there in both directions."""
        return len(self.segments) == self.directed

    def warmed(self) -> Self:
        """Compute what the first search would wait for, and return the index."""
        for name in ("crowd", "most_near", "area", "diagonal", "tables", "obstacles"):
            getattr(self, name)
        return self

    @property
    def undirected(self) -> MapIndex:
        """The same map with every segment in both directions; itself where it was built so."""
        return self.undirected_by(None)

    def undirected_by(self, deadline: Deadline | None) -> MapIndex:
        """Return `undirected`, which is kept, if it is there before a deadline.

        Raises
        ------
        IndexingEndedError
            When the deadline passes, or is cancelled, first.
        """
        if len(self.segments) > self.directed:
            return self
        kept = vars(self)
        if "both_ways" not in kept:
            kept["both_ways"] = self._undirected(deadline)
        undirected: MapIndex = kept["both_ways"]
        return undirected

    def _undirected(self, deadline: Deadline | None) -> MapIndex:
        return MapIndex.build(
            self.segments, self.sigma, oriented=False, points=self.points, frame_id=self.frame_id, deadline=deadline
        )

    @cached_property
    def obstacles(self) -> Place:
        """The obstacles of beams: the walls, and behind them two short ones for each point."""
        place = self.tables.place
        return stopping_beams(place, self.points.shifted(-self.origin)) if len(self.points) else place

    @cached_property
    def crowd(self) -> float:
        """Return the mean number of walls on the list of a cell, over all entries of all lists; of points the same."""
        return max(_crowd(self.grid), _crowd(self.obstacles.grid))

    @cached_property
    def most_near(self) -> int:
        """Return the number of walls on the longest list of a cell; on that of walls and points, for as long a way."""
        grid, obstacles = self.grid, self.obstacles.grid
        cells = float(grid.shape["cell"][0] / obstacles.shape["cell"][0])
        longest = [float(np.diff(one.starts).max()) for one in (grid, obstacles)]
        return math.ceil(max(longest[0], cells * longest[1]))

    @cached_property
    def area(self) -> float:
        """Of the map's bounding box with a margin, m^2."""
        cell, columns, rows = self.grid.shape[["cell", "columns", "rows"]][0]
        return float(cell**2 * columns * rows)

    @property
    def across(self) -> float:
        """Return the number of cells of the grid that a ray passes at most."""
        columns, rows = self.grid.shape[["columns", "rows"]][0]
        return float(columns + rows)

    @property
    def least_kept(self) -> int:
        """Return the number of poses that a search keeps at least: 1."""
        return 1

    @cached_property
    def diagonal(self) -> float:
        """Of the box around the map, metres."""
        corners = self.segments.endpoints.reshape(-1, 2)
        return float(np.hypot(*np.ptp(corners, axis=0)))

    @cached_property
    def tables(self) -> MapTables:
        """The arrays that the kernels of the search take."""
        return MapTables(Place(self.walls.rows, self.walls.bin_starts, self.grid, self.ties), self.sweep, self.raster)

    def is_one_wall(self, walls: Integers, wall: int) -> NDArray[np.bool_]:
        """Return which of `walls` (k,) are rather one with another one than walls of their own."""
        ties, tie = self.ties[walls], self.ties[wall]
        near = 2.0 * np.abs(ties - tie) < math.log(2.0)
        return np.asarray((walls == wall) | (near & (ties >= 0.0) & (tie >= 0.0)))

    @property
    def nbytes(self) -> int:
        """Memory held, bytes."""
        held = [getattr(self, field.name) for field in fields(MapIndex)]
        return sum({id(one): int(one.nbytes) for one in _arrays((*held, self.obstacles))}.values())


def _arrays(held: Any) -> Iterator[NDArray[Any]]:
    """Yield the arrays in a value, in its parts if it is a tuple or a dataclass, and in theirs."""
    if isinstance(held, np.ndarray):
        yield held
    parts = held if isinstance(held, tuple) else ()
    for part in [getattr(held, field.name) for field in fields(held)] if is_dataclass(held) else parts:
        yield from _arrays(part)


def tables_of(
    local: Segments, sigma: float | None, deadline: Deadline | None
) -> tuple[Integers, Pieces, Walls, Floats, Walls, Grid, Sweep, Raster]:
    """Compute the tables of an index from segments about the origin, in the order of the fields of `MapIndex`.

    Raises
    ------
    IndexingEndedError
        When the deadline passes, or is cancelled, first.
    """
    one_line = ONE_LINE if sigma is None else min(ONE_LINE, max(LEAST_DIFFERENCE, ONE_LINE_SHARE * sigma))
    walls, wall_of_piece = merge(local, WHOLE_GAP, one_line, deadline)
    blends = BLENDED_STEP if sigma is None else min(BLENDED_STEP, BLENDED_SIGMAS * sigma)
    if blends > one_line:
        walls, wall_of_piece = blended(local, walls, wall_of_piece.astype(np.intp), blends, deadline)
    chains = chains_of(walls, deadline)
    ties, firsts = tie(walls, deadline)
    order = np.argsort(wall_of_piece, kind="stable").astype(np.int32)
    starts = np.searchsorted(wall_of_piece[order], np.arange(len(walls.rows) + 1))
    pieces = Pieces(order, starts, as_records(ENDS, local.endpoints), firsts)
    _require_time(deadline)
    sweep = swept_chains(chains)
    _require_time(deadline)
    raster = directions_near(walls, chains)
    return wall_of_piece, pieces, walls, ties, chains, near_walls(walls), sweep, raster


def _crowd(grid: Grid) -> float:
    counts = np.diff(grid.starts).astype(np.float64)
    return float((counts * counts).sum() / max(1.0, counts.sum()))


def _require_time(deadline: Deadline | None) -> None:
    if deadline is not None and deadline.passed:
        raise IndexingEndedError
