"""Drawing faults of a map: short pieces, gaps, overlaps, faces that stand doubled."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from association import Deadline, MapIndex
from registration.layout import Floats, Records, floats

from ..views import in_time
from . import tuning
from .result import Finding, FindingCode

Indices = NDArray[np.intp]
Flags = NDArray[np.bool_]


FAULTS: Mapping[FindingCode, str] = {
    "short_pieces": f"are shorter than {100.0 * tuning.SHORT:g} cm, also together with the segments that they "
    "continue. A search does not profit from them. Omit or join them.",
    "doubled_faces": f"lie less than {100.0 * tuning.DOUBLE:g} cm from a parallel segment that faces the same way, or "
    "faces them. Either one face of a wall is drawn twice, or the inside of a wall is drawn as free space. A scan fits "
    "both segments. Keep one of them.",
    "both_ways": "lie on another segment of the opposite direction: these walls have no thickness. Scans from both "
    "sides fit better if the distance of the two faces is the thickness of the wall.",
    "overlaps": "lie on others that run the same way: they are drawn twice. Remove one of them.",
    "gaps": f"end {{least:g}} to {100.0 * tuning.GREATEST_GAP:g} cm before another segment: rays pass through the "
    "gaps. Extend the segments until they meet.",
}


def drawing_findings(index: MapIndex, near: NearWalls, deadline: Deadline) -> Iterator[Finding]:
    """Yield findings about how the lines of a directed map are drawn; `near` are its walls next to others."""
    least = max(tuning.LEAST_GAP, tuning.GAP_SIGMAS * (index.sigma or 0.0))
    found: dict[FindingCode, set[int]] = {
        "short_pieces": segments_of(index, index.walls.longest < tuning.SHORT),
        "doubled_faces": segments_of(index, near.doubled),
        "both_ways": segments_of(index, near.opposite),
        "overlaps": segments_of(index, near.overlapping) | _lapping(index),
        "gaps": _gaping(index, least, deadline),
    }
    for code, segments in found.items():
        if segments:
            fraction = index.segments.lengths[list(segments)].sum() / index.segments.lengths[: index.directed].sum()
            said = f"{len(segments)} segments, {100.0 * fraction:.2g} % of the length, "
            yield Finding(code, said + FAULTS[code].format(least=100.0 * least), tuple(sorted(segments)))


@dataclass(frozen=True, slots=True)
class NearWalls:
    """Flags of the walls of a map that run next to another one: (walls,) flags each.

    Attributes
    ----------
    opposite : of two that lie on one another and run in opposite ways: a wall without thickness
    doubled : of two that are nearer to each other than two faces of a building, and look one way, or at each other
    overlapping : of two that lie on one another and run the same way
    """

    opposite: Flags
    doubled: Flags
    overlapping: Flags


def find_near_walls(index: MapIndex, deadline: Deadline) -> NearWalls:
    """Compare the walls of a directed map that are near to each other, as many as the deadline allows."""
    walls = index.walls.rows
    near = NearWalls(*(np.zeros(len(walls), dtype=bool) for _ in range(3)))
    for pairs in in_time(near_pairs(index), deadline):
        _compare(walls, pairs, near)
    return near


def near_pairs(index: MapIndex) -> Iterator[Indices]:
    """Yield the pairs of walls that one cell lists, (p, 2), the lower index first, up to `PAIRS_AT_A_TIME` together.

    Those of cells with few walls come first. A pair comes once for each cell that lists both.
    """
    grid, left = index.grid, tuning.MOST_PAIRS
    sizes = np.diff(grid.starts)
    for size in range(2, tuning.MOST_IN_CELL + 1):
        cells = np.flatnonzero(sizes == size if size < tuning.MOST_IN_CELL else sizes >= size)
        first, second = np.triu_indices(size, 1)
        cells = cells[: left // len(first)]
        left -= len(cells) * len(first)
        step = tuning.PAIRS_AT_A_TIME // len(first)
        for begin in range(0, len(cells), step):
            listed = grid.items[grid.starts[cells[begin : begin + step]][:, None] + np.arange(size)]
            yield np.stack([listed[:, first].reshape(-1), listed[:, second].reshape(-1)], axis=1)


def _compare(walls: Records, pairs: Indices, near: NearWalls) -> None:
    """Mark how the second wall of each pair, (p, 2), runs next to the first."""
    one, other = walls["dx"][pairs], walls["dy"][pairs]
    pairs = pairs[np.abs(one[:, 0] * other[:, 1] - other[:, 0] * one[:, 1]) < tuning.PARALLEL]
    a, b = walls[pairs[:, 0]], walls[pairs[:, 1]]
    (a_dx, a_dy, a_offset, a_begin, a_end), (b_dx, b_dy, b_offset, b_begin, b_end) = (
        floats(rows, "dx", "dy", "offset", "begin", "end") for rows in (a, b)
    )
    along = a_dx * b_dx + a_dy * b_dy > 0.0
    places = []
    for at in (b_begin, b_end):
        x, y = b_dx * at - b_dy * b_offset, b_dy * at + b_dx * b_offset
        places.append((a_dx * x + a_dy * y, a_dx * y - a_dy * x - a_offset))
    (s1, o1), (s2, o2) = places
    low, high = np.maximum(a_begin, np.minimum(s1, s2)), np.minimum(a_end, np.maximum(s1, s2))
    slope = (o2 - o1) / np.where(np.abs(s2 - s1) > 1e-9, s2 - s1, 1.0)
    # The length that both run next to each other, and how far the second lies to the left of the first there, metres.
    shared, off = high - low, o1 + slope * (0.5 * (low + high) - s1)
    shorter = np.minimum(a_end - a_begin, b_end - b_begin)
    for_long = (shared > tuning.DOUBLE_LENGTH) & (shared > tuning.DOUBLE_SHARE * shorter)
    on_it, apart = np.abs(off) < tuning.SAME_LINE, np.abs(off)
    near.opposite[pairs[for_long & on_it & ~along]] = True
    # Back to back they are the two faces of one wall, as they should be.
    near.doubled[pairs[for_long & ~on_it & (apart < tuning.DOUBLE) & (along | (off > 0.0))]] = True
    near.overlapping[pairs[along & on_it & (shared > tuning.OVERLAP)]] = True


def _gaping(index: MapIndex, least: float, deadline: Deadline) -> set[int]:
    """Return segments whose ends nearly meet another: at no other end, on no other line, and yet near one.

    Ends are as uncertain as the walls: gaps of at most `least` metres are within the declared error of the map.
    """
    ends = index.segments.shifted(-index.origin).endpoints[: index.directed].reshape(-1, 2)
    _, first, counts = np.unique(ends, axis=0, return_index=True, return_counts=True)
    # A segment whose end is as near as this to its own begin is too short for the test.
    alone = np.sort(first[(counts == 1) & (index.segments.lengths[first // 2] > tuning.GREATEST_GAP)])
    if least >= tuning.GREATEST_GAP or not len(alone) or deadline.passed:
        return set()
    # After the end itself; infinite where there is none.
    distances, _ = scipy.spatial.cKDTree(ends).query(ends[alone], k=2, distance_upper_bound=tuning.GREATEST_GAP)
    nearest = np.asarray(distances)[:, 1]
    loose, found = np.flatnonzero(nearest > least)[: tuning.MOST_ENDS], set[int]()
    for end, gap in in_time(zip(alone[loose].tolist(), nearest[loose].tolist(), strict=True), deadline):
        apart = _distance_to_others(index, ends[end], index.wall_of_piece[end // 2])
        if apart > least + tuning.SAME_LINE and min(apart, gap) <= tuning.GREATEST_GAP:
            found.add(end // 2)
    return found


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


def _lapping(index: MapIndex) -> set[int]:
    """Return the segments of one wall that begin before another of it ends, and those others."""
    wall = index.wall_of_piece[: index.directed]
    rows, ends = index.walls.rows[wall], index.segments.shifted(-index.origin).endpoints[: index.directed]
    directions = np.stack([rows["dx"], rows["dy"]], axis=1)
    begins, stops = (np.einsum("ij,ij->i", ends[:, k : k + 2], directions) for k in (0, 2))
    order = np.lexsort((begins, wall))
    aside = 4.0 * index.diagonal * wall[order]  # walls one after the other, so that none reaches into the next
    begins, stops = begins[order] + aside, stops[order] + aside
    reach = np.maximum.accumulate(stops)
    last = np.maximum.accumulate(np.where(stops >= reach, np.arange(len(order)), 0))  # the piece that reaches so far
    lapping = np.flatnonzero(begins[1:] < reach[:-1] - tuning.OVERLAP)
    return set(order[np.concatenate([last[lapping], lapping + 1])].tolist())


def drawn_sigma(index: MapIndex) -> float | None:
    """Return how far lines may be off by how they were drawn, metres: by the raster that all their ends lie on.

    None where they lie on none that pixels have. Few segments, or a coarser raster, are a drawing in round numbers.
    """
    ends = index.segments.endpoints[: index.directed]
    ends = ends - ends[0, [0, 1, 0, 1]]
    step = next(
        (one for one in tuning.STEPS if np.abs(ends - one * np.round(ends / one)).max() < tuning.ON_STEP), math.inf
    )
    # A caller copies the advice: to a tenth of a millimetre.
    return round(step / math.sqrt(12.0), 4) if len(ends) >= tuning.MANY_ENDS and step <= tuning.LARGEST_PIXEL else None


def segments_of(index: MapIndex, walls: Flags | Indices) -> set[int]:
    """Return the segments, as sent, that some walls consist of; `walls` are flags or indices."""
    chosen = np.zeros(len(index.walls.rows), dtype=bool)
    chosen[walls] = True
    return set((np.flatnonzero(chosen[index.wall_of_piece]) % index.directed).tolist())


def longest_pieces(index: MapIndex) -> Indices:
    """Return the longest segment of each wall, (walls,)."""
    order = np.argsort(index.segments.lengths, kind="stable")
    found = np.empty(len(index.walls.longest), dtype=np.intp)
    found[index.wall_of_piece[order]] = order
    return found
