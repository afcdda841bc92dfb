"""How a map is drawn: short pieces, gaps, overlaps, faces that stand doubled."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from registration.layout import Floats

from ..map_index import MapIndex
from ..tables import Grid
from .looking import segments_of
from .result import Finding
from .tuning import (
    DOUBLE,
    DOUBLE_LENGTH,
    DOUBLE_SHARE,
    GREATEST_GAP,
    LARGEST_PIXEL,
    LEAST_GAP,
    MANY_ENDS,
    MOST_ENDS,
    MOST_IN_CELL,
    MOST_PAIRS,
    ON_STEP,
    OVERLAP,
    PARALLEL,
    SAME_LINE,
    SHORT,
    STEPS,
)

Indices = NDArray[np.intp]
Flags = NDArray[np.bool_]


def drawing_findings(index: MapIndex, pairs: Beside) -> Iterator[Finding]:
    """Tell what is doubtful in how the lines of a directed map were drawn; `pairs` are its walls beside each other."""
    yield from _short(index)
    yield from _doubled(index, pairs)
    yield from _overlapping(index, pairs)
    yield from _gaping(index)


def near_pairs(grid: Grid, count: int) -> Indices:
    """Return the pairs of walls that one cell lists, (p, 2), the lower index first, each once."""
    sizes = np.diff(grid.starts)
    keys = [np.zeros(0, dtype=np.int64)]
    held = 0
    for size in range(2, MOST_IN_CELL + 1):
        cells = np.flatnonzero(sizes == size if size < MOST_IN_CELL else sizes >= size)
        first, second = np.triu_indices(size, 1)
        cells = cells[: max(0, (MOST_PAIRS - held) // len(first))]
        if len(cells):
            listed = grid.items[grid.starts[cells][:, None] + np.arange(size)].astype(np.int64)
            keys.append(np.unique(listed[:, first] * count + listed[:, second]))
            held += len(keys[-1])
    every = np.unique(np.concatenate(keys))
    return np.stack([every // count, every % count], axis=1)


class Beside:
    """How the second wall of each of the `pairs`, (p, 2), runs beside the first: (p,) each, metres.

    `shared` is the length that they run beside each other, `off` how far the second lies to the left of the first
    there, `along` whether both run the same way; of pairs that are not parallel `shared` is 0.
    """

    def __init__(self, pairs: Indices, shared: Floats, off: Floats, along: Flags, shorter: Floats) -> None:
        self.pairs, self.shared, self.off, self.along, self.shorter = pairs, shared, off, along, shorter

    @property
    def for_long(self) -> Flags:
        """Whether they run beside each other over a good part of the shorter one."""
        return (self.shared > DOUBLE_LENGTH) & (self.shared > DOUBLE_SHARE * self.shorter)

    @property
    def opposite(self) -> Flags:
        """Whether they lie on one another and run in opposite ways."""
        return self.for_long & (np.abs(self.off) < SAME_LINE) & ~self.along

    def both_ways(self, count: int) -> Flags:
        """Tell of each of `count` walls whether another lies on it that runs the other way: it has no thickness."""
        found = np.zeros(count, dtype=bool)
        found[self.pairs[self.opposite]] = True
        return found


def beside(index: MapIndex) -> Beside:
    """Compare the walls of a directed map that are near to each other."""
    walls = index.walls.rows
    pairs = near_pairs(index.grid, len(walls))
    a, b = walls[pairs[:, 0]], walls[pairs[:, 1]]
    parallel = np.abs(a["dx"] * b["dy"] - a["dy"] * b["dx"]) < PARALLEL
    along = a["dx"] * b["dx"] + a["dy"] * b["dy"] > 0.0
    places = []
    for name in ("begin", "end"):
        x = b["dx"] * b[name] - b["dy"] * b["offset"]
        y = b["dy"] * b[name] + b["dx"] * b["offset"]
        places.append((a["dx"] * x + a["dy"] * y, a["dx"] * y - a["dy"] * x - a["offset"]))
    (s1, o1), (s2, o2) = places
    low, high = np.maximum(a["begin"], np.minimum(s1, s2)), np.minimum(a["end"], np.maximum(s1, s2))
    middle = 0.5 * (low + high)
    slope = (o2 - o1) / np.where(np.abs(s2 - s1) > 1e-9, s2 - s1, 1.0)
    shorter = np.minimum(a["end"] - a["begin"], b["end"] - b["begin"])
    return Beside(pairs, np.where(parallel, high - low, 0.0), o1 + slope * (middle - s1), along, shorter)


def _short(index: MapIndex) -> Iterator[Finding]:
    lengths = index.walls.longest
    short = lengths < SHORT
    if short.any():
        share = lengths[short].sum() / lengths.sum()
        found = segments_of(index, short)
        yield Finding(
            "short_pieces",
            f"{len(found)} segments, {100.0 * share:.2g} % of the length, are shorter than {100.0 * SHORT:g} cm even "
            "where they continue one another: they tell a search nothing. Leave them out, or join them.",
            found,
        )


def _doubled(index: MapIndex, sides: Beside) -> Iterator[Finding]:
    apart = np.abs(sides.off)
    near = sides.for_long & (apart >= SAME_LINE) & (apart < DOUBLE)
    # Back to back they are the two faces of one wall, as they should be.
    doubled = near & (sides.along | (sides.off > 0.0))
    if doubled.any():
        found = segments_of(index, np.unique(sides.pairs[doubled]))
        yield Finding(
            "doubled_faces",
            f"{len(found)} segments run beside another that looks the same way, or at it, less than {100.0 * DOUBLE:g} "
            "cm apart: a wall of which one face is drawn twice, or whose free space is drawn inside of it. What a scan "
            "sees of it may be laid on either.",
            found,
        )
    if sides.opposite.any():
        found = segments_of(index, np.unique(sides.pairs[sides.opposite]))
        yield Finding(
            "both_ways",
            f"{len(found)} segments lie on another that runs the other way: walls without thickness. Two faces drawn "
            "apart, by as much as the wall is thick, fit what is seen from either side.",
            found,
        )


def _overlapping(index: MapIndex, sides: Beside) -> Iterator[Finding]:
    on_it = sides.along & (np.abs(sides.off) < SAME_LINE) & (sides.shared > OVERLAP)
    found = set(segments_of(index, np.unique(sides.pairs[on_it])))
    found |= {piece for one, other, room in _neighbours(index) if room < -OVERLAP for piece in (one, other)}
    if found:
        yield Finding(
            "overlaps",
            f"{len(found)} segments lie on others that run the same way: drawn twice.",
            tuple(sorted(found)),
        )


def _gaping(index: MapIndex) -> Iterator[Finding]:
    """Tell where an end nearly meets another segment: at no other end, on no other line, and yet near one."""
    ends = index.segments.shifted(-index.origin).endpoints[: index.directed].reshape(-1, 2)
    _, place, there = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
    # What is as near as this to its own begin is too short to tell.
    alone = (there[place.reshape(-1)] == 1) & np.repeat(index.segments.lengths[: index.directed] > GREATEST_GAP, 2)
    if not alone.any():
        return
    from scipy.spatial import cKDTree  # takes a tenth of a second to load, and only this needs it

    loose = np.flatnonzero(alone)
    nearest = np.asarray(cKDTree(ends).query(ends[loose], k=2)[0])[:, 1]  # after the end itself
    free = nearest > LEAST_GAP
    found = set()
    for end, gap in zip(loose[free][:MOST_ENDS], nearest[free][:MOST_ENDS], strict=True):
        apart = _distance_to_others(index, ends[end], index.wall_of_piece[end // 2])
        if apart > LEAST_GAP + SAME_LINE and min(apart, gap) <= GREATEST_GAP:
            found.add(int(end) // 2)
    if found:
        yield Finding(
            "gaps",
            f"{len(found)} segments end {100.0 * LEAST_GAP:g} to {100.0 * GREATEST_GAP:g} cm before another begins or "
            "passes: walls that do not meet. Rays go between them.",
            tuple(sorted(found)),
        )


def _distance_to_others(index: MapIndex, end: Floats, own: int) -> float:
    """Return how far a place is from the nearest wall but its own, metres, as far as its cell lists them.

    The line of several pieces is a little off each of them: what touches it may seem to be that far away.
    """
    shape, grid = index.grid.shape[0], index.grid
    column, row = (int((end[k] - shape[name]) / shape["cell"]) for k, name in enumerate(("x0", "y0")))
    cell = row * int(shape["columns"]) + column
    listed = grid.items[grid.starts[cell] : grid.starts[cell + 1]]
    walls = index.walls.rows[listed[listed != own]]
    along = np.clip(walls["dx"] * end[0] + walls["dy"] * end[1], walls["begin"], walls["end"])
    x = walls["dx"] * along - walls["dy"] * walls["offset"] - end[0]
    y = walls["dy"] * along + walls["dx"] * walls["offset"] - end[1]
    return float(np.hypot(x, y).min(initial=np.inf))


def _neighbours(index: MapIndex) -> list[tuple[int, int, float]]:
    """List the pieces of one wall that follow one another, and the room between them, metres; negative on overlaps."""
    starts, order = index.pieces.starts, index.pieces.items
    ends = index.segments.shifted(-index.origin).endpoints
    found: list[tuple[int, int, float]] = []
    for wall in np.flatnonzero(np.diff(starts) > 1):
        row, pieces = index.walls.rows[wall], order[starts[wall] : starts[wall + 1]]
        d = np.array([row["dx"], row["dy"]])
        begins, stops = ends[pieces, :2] @ d, ends[pieces, 2:] @ d
        by = np.argsort(begins, kind="stable")
        reach, last = stops[by[0]], by[0]
        for k in by[1:]:
            found.append((int(pieces[last]), int(pieces[k]), float(begins[k] - reach)))
            if stops[k] > reach:
                reach, last = stops[k], k
    return found


def drawn_sigma(index: MapIndex) -> float | None:
    """Return how far lines may be off by how they were drawn, metres: by the raster that all their ends lie on.

    None where they lie on none that pixels have. Few segments, or a coarser raster, are a drawing in round numbers.
    """
    ends = index.segments.endpoints[: index.directed]
    ends = ends - ends[0, [0, 1, 0, 1]]
    step = next((one for one in STEPS if np.abs(ends - one * np.round(ends / one)).max() < ON_STEP), math.inf)
    # A caller copies what is advised: to a tenth of a millimetre.
    return round(step / math.sqrt(12.0), 4) if len(ends) >= MANY_ENDS and step <= LARGEST_PIXEL else None
