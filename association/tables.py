"""Inputs of the kernels: arrays that belong together, of the records in `layout`.

A kernel binds those that it needs to names once, outside of its loops. Numba counts references to each array that is
taken out of a tuple.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from registration.layout import Floats, Records

from .layout import HELD, SCRATCH, WALL_SUMS, Flags, Integers, record


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


class MapTables(NamedTuple):
    """All that the search reads of a map."""

    place: Place
    sweep: Sweep
    raster: Raster


class Question(NamedTuple):
    """The input of a search: the scan lines, (n,) of `SCAN_LINE`, and the terms, (1,) of `TERMS`."""

    scan: Records
    terms: Records


class ScoreRules(NamedTuple):
    """Which poses are refined.

    Attributes
    ----------
    rule : (1,) of `RULE`
    packed : whether poses that are kept are to come first
    """

    rule: Records
    packed: bool


class ScoreWork(NamedTuple):
    """The arrays that `score_poses` writes to.

    Attributes
    ----------
    held : (n,) of `HELD`
    wall_sums : (m,) of `WALL_SUMS`, those of no pair between two calls
    listed : (n,) walls
    scratch : (1,) of `SCRATCH`
    parallel : (n + 1,) chi-square of their angles up to which so many lines are parallel
    """

    held: Records
    wall_sums: Records
    listed: Integers
    scratch: Records
    parallel: Floats

    @classmethod
    def of(cls, lines: int, walls: int, parallel: Floats) -> ScoreWork:
        """Return the arrays for a scan of so many lines on a map of so many walls."""
        held, wall_sums = np.zeros(lines, HELD), np.zeros(walls, WALL_SUMS)
        return cls(held, wall_sums, np.zeros(lines, np.int64), record(SCRATCH), parallel)


class Model(NamedTuple):
    """The estimator's model of a consensus set.

    Attributes
    ----------
    seen : (n,) of `OBSERVATION`
    ties, own : (m,)
        As of `Observations`.
    sensor : (2,)
        The sensor's place in the scan frame, metres.
    places : (v, 2)
        Of the views, metres.
    root, began : (3 v, u), (u,)
        As `root` and `found` of `Views`.
    active : (k,)
        The unknowns that are solved for.
    information : (k, k)
        On these, before anything is seen.
    """

    seen: Records
    ties: Floats
    own: Floats
    sensor: Floats
    places: Floats
    root: Floats
    began: Floats
    active: Integers
    information: Floats


class Drawing(NamedTuple):
    """The bases of a scan that were not drawn yet, and sampled consensus sets of the stopping rule.

    Attributes
    ----------
    merits, telling : (m, m), costs : (m,)
        As of `rank_bases`.
    left : (m,) what each line may still gain in a set without a base that was drawn, nats
    gains : (n,) of the lines, nats
    state : (1,) of `DRAWING_STATE`
    orders : (samples, m) uint8, random orders of the lines; no samples where bases are drawn at random
    ranks : (m, samples) uint8, the place of each line in them
    found : (samples,) uint8, the place at which an order has a base that was drawn, m where it has none
    sizes, reached : (samples,) how many lines each set has so far, and what they gain, nats
    open_ones : (samples + 1,) the samples that are not decided, and last their number
    """

    merits: Floats
    telling: Flags
    costs: Floats
    left: Floats
    gains: Floats
    state: Records
    orders: Integers
    ranks: Integers
    found: Integers
    sizes: Integers
    reached: Floats
    open_ones: Integers
