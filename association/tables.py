"""Inputs of the kernels: arrays that belong together, of the records in `layout`.

A kernel binds those that it needs to names once, outside of its loops. Numba counts references to each array that is
taken out of a tuple.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from registration.layout import Floats, Records

from .layout import HYPOTHESIS, MATCH, SCRATCH, WALL_SUMS, Indices, Integers, record
from .tuning import AT_ONCE


class Walls(NamedTuple):
    """Walls or wall chains, by direction bin and the longest of a bin first.

    Attributes
    ----------
    rows : (m,) of `WALL`
    bin_starts : (bins + 1,) where each bin begins
    longest : (m,) their lengths, metres
    summed : (m + 1,) running sum of `longest`
    """

    rows: Records
    bin_starts: Integers
    longest: Floats
    summed: Floats


class JoinGates(NamedTuple):
    """When two pieces of walls are joined.

    Attributes
    ----------
    cell : float
        Size of the cells in which begins of pieces are listed, metres.
    gap : float
        The largest gap between two pieces along their line, metres.
    lateral : float
        The largest offset from the line of the other, metres.
    least_cosine : float
        Of the angle between them.
    """

    cell: float
    gap: float
    lateral: float
    least_cosine: float


class Grid(NamedTuple):
    """A uniform grid with a list for each cell.

    Attributes
    ----------
    shape : (1,) of `GRID_SHAPE`
    starts, items : cell ``c = row * columns + column`` lists ``items[starts[c]:starts[c + 1]]``
    """

    shape: Records
    starts: Integers
    items: Integers


class Raster(NamedTuple):
    """Which directions the walls near a place have.

    Attributes
    ----------
    shape : (1,) of `GRID_SHAPE`
    bits : (columns * rows,) bit s of a cell is set where a wall or a chain of direction sector s is within `REACH`
    """

    shape: Records
    bits: Integers


class Place(NamedTuple):
    """The walls, and where they are: what lies at a point, and what a ray meets.

    Attributes
    ----------
    walls : (m,) of `WALL`, by direction bin
    bin_starts : (bins + 1,) where each bin begins
    grid : Grid
        Walls within `REACH` of each cell, in ascending order.
    ties : (m,) where in its group of linked walls each is, in minus the log of a correlation: the errors of two are
        correlated by ``exp(-|difference|)``; -1 of one that is tied to none
    """

    walls: Records
    bin_starts: Integers
    grid: Grid
    ties: Floats


class Sweep(NamedTuple):
    """The wall chains, and where they are: where a base may lie.

    Attributes
    ----------
    chains : (m,) of `WALL`, those that lie near one another together
    lengths : (m,) of the chains, metres
    sectors : Grid
        Chains on each cell, ``chain * SECTORS + sector``.
    present : (columns * rows,) bit s of a cell is set where it lists a chain of direction sector s
    """

    chains: Records
    lengths: Floats
    sectors: Grid
    present: Integers


class Pieces(NamedTuple):
    """The map's own segments.

    Attributes
    ----------
    items, starts : wall w consists of segments ``items[starts[w]:starts[w + 1]]``
    ends : (n,) of `ENDS`
    firsts : (m,) of the group of linked walls that each is in, the one that begins first
    """

    items: Integers
    starts: Integers
    ends: Records
    firsts: Integers


class PiecesAlong(NamedTuple):
    """The pieces of a wall, or of linked walls, along a line.

    Attributes
    ----------
    piece, wall : (k,) which they are, wall by wall, and of which wall
    low, high : (k,) abscissae between which each lies, metres
    place : (k,) places in these, by where they begin; ties by place
    farthest : (k,) in that order, the place of the one that reaches farthest of those up to each
    gaps : (k,) in that order, the length that is on none of them between the first and where each begins, metres
    """

    piece: Indices
    wall: Indices
    low: Floats
    high: Floats
    place: Indices
    farthest: Indices
    gaps: Floats


class MapTables(NamedTuple):
    """All that the search reads of a map."""

    place: Place
    sweep: Sweep
    raster: Raster


class Measured(NamedTuple):
    """Scan segments as they were measured: see `registration.MeasuredSegments`; the first two of `POINT`."""

    directions: Records
    midpoints: Records
    lengths: Floats
    centroids: Records
    spreads: Floats
    sigma: Floats
    points: Floats


class Lines(NamedTuple):
    """The lines of a scan, and the segments that they are made of.

    Attributes
    ----------
    rows : (n,) of `SCAN_LINE`
    row_of : (segments,) which row each segment is part of
    least_overlap : float
        Share of a segment's length that has to lie on a wall.
    """

    rows: Records
    row_of: Indices
    least_overlap: float


class Sights(NamedTuple):
    """The lines seen from each view.

    Attributes
    ----------
    places : (v,) of `POINT`, where the sensor of each stood, in the scan frame
    starts : (v + 1,) view v saw ``seen[starts[v]:starts[v + 1]]``; nothing where lines of sight are no evidence
    seen : (k,) of `SIGHTING`
    by_line : (k,) their order by scan line, and there by view
    weights : (v,) weight of each view, so that views from one place count as one
    """

    places: Records
    starts: Integers
    seen: Records
    by_line: Indices
    weights: Floats


class Rays(NamedTuple):
    """Single beams of which something is known.

    Attributes
    ----------
    beams : (m,) of `BEAM`
    reach : float
        Metres; how far a beam without return is known to be free.
    """

    beams: Records
    reach: float


class SeenByViews(NamedTuple):
    """The walls as the views show them.

    Attributes
    ----------
    seen : (k,) of `SIGHTING`
    walls : (k,) of `WALL`, on which each lies
    number : (k,) which of the walls that is, from 0 up
    origins : (v,) of `POINT`, where the views' frames begin, as reported, in the scan frame
    """

    seen: Records
    walls: Records
    number: Indices
    origins: Records


class Question(NamedTuple):
    """The input of a search: the scan, the terms and the rules.

    Attributes
    ----------
    scan : (n,) of `SCAN_LINE`
    terms : (1,) of `TERMS`
    rules : (1,) of `RULES`
    """

    scan: Records
    terms: Records
    rules: Records


class Odds(NamedTuple):
    """A model of the verdict.

    Attributes
    ----------
    curves : (n,) of `CURVE`
    bends : (k,) of `BEND`
    pairs : (m,) of `TWO_FEATURES`
    """

    curves: Records
    bends: Records
    pairs: Records


class KnownWalls(NamedTuple):
    """The walls, and the uncertainty of their positions.

    Attributes
    ----------
    walls : (m,) of `WALL`
    ties : (m,) as of `Place`
    variance : float
        Of a wall's own error, m^2; negative where nothing is known of it.
    """

    walls: Records
    ties: Floats
    variance: float


class Blockers(NamedTuple):
    """The walls that rays pass through.

    Attributes
    ----------
    counts : (m,) of `BLOCKER`, by wall
    touched : (m,) the walls that any ray passes through, as many as there are
    """

    counts: Records
    touched: Integers


class Workspace(NamedTuple):
    """The arrays that the kernels write to while they look at one pose after the other.

    Attributes
    ----------
    matches : (n,) of `MATCH`
    spreads : (n,) angle gates in sectors
    shifts : (n,) where in the raster's cells the bits for the offset gate begin; below 0 where none is looked up
    later : (n,) possible gain of the scan lines after each, of those that are looked up, nats
    possible : (n,) possible gain of each scan line at a pose, nats, -1 where it can lie on no wall
    hypotheses : (k,) of `HYPOTHESIS`, those that are scored together
    near : (n, k) whether each scan line may lie on a wall at each of them
    held : (n,) which wall of each scan line is in the sums, or -1
    shifts_held : (n,) lateral offset from that wall of the line that is in the sums, m
    weights_held : (n,) its weight there
    listed : (n,) walls, for now
    wall_sums : (m,) of `WALL_SUMS`, by wall; all 0 between two poses
    scratch : (1,) of `SCRATCH`
    parallel : (k,) the chi-square of the angles of n pairs up to which they are parallel, by n from 0 on
    """

    matches: Records
    spreads: Floats
    shifts: Integers
    later: Floats
    possible: Floats
    hypotheses: Records
    near: Integers
    held: Integers
    shifts_held: Floats
    weights_held: Floats
    listed: Integers
    wall_sums: Records
    scratch: Records
    parallel: Floats

    @classmethod
    def of(cls, count: int, walls: int, parallel: Floats) -> Workspace:
        """Return one for a scan of `count` lines and a map of that many walls, with `parallel` as above."""
        spreads, later, possible = np.zeros((3, count))
        shifts, held, listed = np.zeros((3, count), np.int64)
        shifts_held, weights_held = np.zeros((2, count))
        held.fill(-1)
        hypotheses, near = np.empty(AT_ONCE, HYPOTHESIS), np.empty((count, AT_ONCE), np.uint8)
        matches, wall_sums, scratch = np.zeros(count, MATCH), np.zeros(walls, WALL_SUMS), record(SCRATCH)
        arrays = matches, spreads, shifts, later, possible, hypotheses, near
        return cls(*arrays, held, shifts_held, weights_held, listed, wall_sums, scratch, parallel)
