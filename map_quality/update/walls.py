"""Walls of the map that are gone, whole or in part."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from .evidence import WallEvidence, are_enough, shows
from .tuning import (
    FEW_ON_THING,
    LEAST_BEAMS,
    LEAST_CUT,
    LEAST_GONE,
    LEAST_GONE_OF_THING,
    LEAST_PIECE,
    LOOP_GAP,
    THING,
)

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


def find_cuts(evidence: WallEvidence, walls: int) -> list[Cut]:
    """Return which of the first so many walls are gone, whole or in part."""
    gone, read, open_ = evidence.gone, evidence.read, evidence.open
    cuts = []
    whole = _gone_things(evidence, walls)
    for wall in range(walls):
        if wall in whole:
            own = evidence.chunks.of_wall(wall)
            passed = evidence.through[:, own].any(axis=0)
            cuts.append(Cut(wall, own.start + np.flatnonzero(passed), np.zeros((0, 4))))
            continue
        own = evidence.chunks.of_wall(wall)
        if not gone[own].any():
            continue
        cut = _cut(evidence, wall, gone[own], read[own], open_[own])
        if cut is not None:
            cuts.append(cut)
    return cuts


def _gone_things(evidence: WallEvidence, walls: int) -> set[int]:
    """Return the walls of things that are gone: closed loops of walls that beams pass through, and that none reads.

    A thing that beams pass through is not solid, so its other sides are gone, too, whether they were seen or not.
    """
    ends = evidence.chunks.walls.endpoints[:walls]
    corners = np.round(ends.reshape(-1, 2) / LOOP_GAP).astype(np.int64)
    _, corner = np.unique(corners, axis=0, return_inverse=True)
    corner = corner.reshape(-1, 2)
    lengths = evidence.chunks.walls.lengths
    at = np.bincount(corner.ravel())
    joined = coo_array((np.ones(walls), (corner[:, 0], corner[:, 1])), shape=(len(at), len(at)))
    _, label = connected_components(joined, directed=False)
    out: set[int] = set()
    for loop in np.unique(label[corner[:, 0]]):
        mine = np.flatnonzero(label[corner[:, 0]] == loop)
        if len(mine) < 3 or lengths[mine].sum() > THING or (at[np.unique(corner[mine])] != 2).any():
            continue
        chunks = np.concatenate([np.arange(len(evidence.chunks))[evidence.chunks.of_wall(int(k))] for k in mine])
        if _is_gone_whole(evidence, chunks):
            out.update(mine.tolist())
    return out


def _is_gone_whole(evidence: WallEvidence, chunks: Indices) -> bool:
    """Return whether beams of several visits and poses pass through a good part of a thing, and nothing reads it."""
    through, on = evidence.through[:, chunks], evidence.on[:, chunks]
    if on.sum() > FEW_ON_THING * (through.sum() + on.sum()) or shows(on.sum(axis=1), through.sum(axis=1)).any():
        return False
    if (on >= LEAST_BEAMS).any():
        return False
    visits = shows(through.sum(axis=1), on.sum(axis=1)).sum()
    passed = float((through.sum(axis=0) > 0).mean())
    poses = evidence.places_of(chunks, on=False)
    return bool(are_enough(visits, poses) and passed >= LEAST_GONE_OF_THING)


def _cut(evidence: WallEvidence, wall: int, gone: Bools, read: Bools, open_: Bools) -> Cut | None:
    """Return what is gone of a wall; None where that is too little to be sure of."""
    first, length = int(evidence.chunks.first[wall]), float(evidence.chunks.walls.lengths[wall])
    step = length / len(gone)
    if gone.mean() >= LEAST_GONE and not (read & ~gone).any():
        return Cut(wall, first + np.flatnonzero(gone), np.zeros((0, 4)))
    out = np.zeros(len(gone), dtype=bool)
    for begin, end in runs(gone):
        if (end - begin) * step < LEAST_CUT:
            continue
        while begin > 0 and open_[begin - 1]:
            begin -= 1
        while end < len(gone) and open_[end]:
            end += 1
        out[begin:end] = True
    for begin, end in runs(~out):  # what is too short to be a wall, and is not read
        if (end - begin) * step < LEAST_PIECE + 0.5 * step and not read[begin:end].any() and out.any():
            out[begin:end] = True
    if not out.any():
        return None
    place, along = evidence.chunks.walls.endpoints[wall, :2], evidence.chunks.walls.directions[wall]
    left = [np.concatenate([place + begin * step * along, place + end * step * along]) for begin, end in runs(~out)]
    return Cut(wall, first + np.flatnonzero(out & gone), np.array(left).reshape(-1, 4))
