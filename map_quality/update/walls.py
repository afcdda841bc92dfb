"""Walls of the map that are gone, whole or in part."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from association import Deadline

from . import tuning
from .beams import Chunks
from .evidence import Judged, WallEvidence, are_enough
from .scans import go_on

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]
Bools = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class Cut:
    """A wall of the map of which something is gone.

    Attributes
    ----------
    wall : int
        Index of the map segment.
    chunks : (k,)
        Its chunks that are gone.
    left : (p, 4)
        Its pieces that remain, metres; none if all of it is gone.
    """

    wall: int
    chunks: Indices
    left: Floats


def runs(chosen: Bools) -> list[tuple[int, int]]:
    """Return begin and end (exclusive) of each run of true values."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], chosen.astype(np.int8), [0]])))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def find_cuts(evidence: WallEvidence, judged: Judged, walls: int, deadline: Deadline) -> list[Cut]:
    """Return which of the first so many walls are gone, whole or in part."""
    chunks = evidence.chunks
    cuts = {cut.wall: cut for cut in _gone_things(evidence, walls, deadline)}
    for wall in np.unique(chunks.walls_of(judged.seen[judged.gone])).tolist():
        if wall < walls and wall not in cuts:
            go_on(deadline)
            gone, _, open_, read = judged.of_wall(wall)
            cut = _cut(chunks, wall, gone, read, open_)
            if cut is not None:
                cuts[wall] = cut
    return [cuts[wall] for wall in sorted(cuts)]


def _gone_things(evidence: WallEvidence, walls: int, deadline: Deadline) -> Iterator[Cut]:
    """Yield the walls of things that are gone: closed loops of walls that beams pass through, and that none reads.

    A thing that beams pass through is not solid, so its other sides are gone, too, whether they were seen or not.
    """
    chunks = evidence.chunks
    corners = np.round(chunks.walls.endpoints[:walls].reshape(-1, 2) / tuning.LOOP_GAP).astype(np.int64)
    _, corner = np.unique(corners, axis=0, return_inverse=True)
    corner = corner.reshape(-1, 2)
    at = np.bincount(corner.ravel())
    joined = coo_array((np.ones(walls), (corner[:, 0], corner[:, 1])), shape=(len(at), len(at)))
    _, label = connected_components(joined, directed=False)
    loop_of = label[corner[:, 0]]
    order = np.argsort(loop_of, kind="stable")
    passed = chunks.walls_of(evidence.chunk[evidence.counts[:, 0] > 0])
    for loop in np.unique(loop_of[passed[passed < walls]]):
        go_on(deadline)
        mine = order[np.searchsorted(loop_of, loop, sorter=order) : np.searchsorted(loop_of, loop, "right", order)]
        if len(mine) < 3 or chunks.walls.lengths[mine].sum() > tuning.THING or (at[np.unique(corner[mine])] != 2).any():
            continue
        own = [np.arange(chunks.first[wall], chunks.first[wall + 1]) for wall in mine]
        if _is_gone_whole(evidence, np.concatenate(own)):
            for wall, part in zip(mine.tolist(), own, strict=True):
                rows = evidence.rows_of(part)
                gone = np.unique(evidence.chunk[rows][evidence.counts[rows, 0] > 0])
                yield Cut(wall, gone, np.zeros((0, 4)))


def _is_gone_whole(evidence: WallEvidence, chunks: Indices) -> bool:
    """Return whether beams of several visits and poses pass through a good part of a thing, and nothing reads it."""
    rows = evidence.rows_of(chunks)
    through, on, _ = evidence.counts[rows].sum(axis=0)
    if on > tuning.FEW_ON_THING * (through + on) or evidence.visits_of(rows, on=True) or evidence.is_read(rows):
        return False
    passed = len(np.unique(evidence.chunk[rows][evidence.counts[rows, 0] > 0])) / len(chunks)
    visits, poses = evidence.visits_of(rows, on=False), evidence.places_of(rows, on=False)
    return bool(are_enough(len(visits), poses) and passed >= tuning.LEAST_GONE_OF_THING)


def _cut(chunks: Chunks, wall: int, gone: Bools, read: Bools, open_: Bools) -> Cut | None:
    """Return what is gone of a wall; None where that is too little to be sure of."""
    first, length = int(chunks.first[wall]), float(chunks.walls.lengths[wall])
    step = length / len(gone)
    if gone.mean() >= tuning.LEAST_GONE and not (read & ~gone).any():
        return Cut(wall, first + np.flatnonzero(gone), np.zeros((0, 4)))
    out = np.zeros(len(gone), dtype=bool)
    for begin, end in runs(gone):
        if (end - begin) * step < tuning.LEAST_CUT:
            continue
        while begin > 0 and open_[begin - 1]:
            begin -= 1
        while end < len(gone) and open_[end]:
            end += 1
        out[begin:end] = True
    for begin, end in runs(~out):  # what is too short to be a wall, and is not read
        if (end - begin) * step < tuning.LEAST_PIECE + 0.5 * step and not read[begin:end].any() and out.any():
            out[begin:end] = True
    if not out.any():
        return None
    left = [chunks.part(wall, begin, end) for begin, end in runs(~out)]
    return Cut(wall, first + np.flatnonzero(out & gone), np.array(left).reshape(-1, 4))
