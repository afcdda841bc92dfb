"""Drafts of changes, and walls of the map that are gone, whole or in part."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np
import scipy

from association import Deadline
from registration import Segments

from . import tuning
from .beams import NOTHING
from .evidence import Judged, WallEvidence, are_enough
from .result import Bools, ChangeCode, Floats, Indices
from .scans import go_on

NO_WALLS, NO_SIGMA = np.zeros((0, 4)), np.zeros(0)


@dataclass(frozen=True, slots=True, eq=False)
class Draft:
    """A change before its evidence is counted.

    Attributes
    ----------
    code : ChangeCode
    segments : tuple of int
        Of the map, that it replaces.
    new : (k, 4)
    sigma : (k,)
    gone, there : (c,)
        Chunks that it says are not there, and are there.
    door : bool
        True if a part of it may be the leaf of a door.
    rest_read : bool
        True if a visit reads what it leaves of a wall.
    """

    code: ChangeCode
    segments: tuple[int, ...]
    new: Floats = field(default_factory=lambda: NO_WALLS)
    sigma: Floats = field(default_factory=lambda: NO_SIGMA)
    gone: Indices = field(default_factory=lambda: NOTHING)
    there: Indices = field(default_factory=lambda: NOTHING)
    door: bool = False
    rest_read: bool = False

    def seen_by(self, evidence: WallEvidence) -> Bools:
        """Return which scans saw something of the walls that it takes away, or brings, (n,)."""
        old = [np.arange(*evidence.chunks.first[wall : wall + 2]) for wall in self.segments]
        return evidence.seen_by(np.concatenate([self.there, *old]))

    def with_also(self, other: Draft, code: ChangeCode | None = None) -> Draft:
        """Return one change that does both."""
        return Draft(
            code or self.code,
            tuple(dict.fromkeys((*self.segments, *other.segments))),
            np.concatenate([self.new, other.new]),
            np.concatenate([self.sigma, other.sigma]),
            np.concatenate([self.gone, other.gone]),
            np.concatenate([self.there, other.there]),
            self.door or other.door,
        )


def runs(chosen: Bools) -> list[tuple[int, int]]:
    """Return begin and end (exclusive) of each run of true values."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], chosen.astype(np.int8), [0]])))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def find_cuts(
    evidence: WallEvidence, judged: Judged, known: Segments, sigma: float, deadline: Deadline
) -> tuple[list[Draft], list[Draft]]:
    """Return the walls of the map that are gone, whole or in part, and those that may have moved.

    Returns
    -------
    a draft for each wall that is gone, removed or shortened
    a draft for each that beams pass here and there, so that it is gone if a new one like it is near
    """
    chunks, passed = evidence.chunks, dict[int, Draft]()
    cuts = {cut.segments[0]: cut for cut in _gone_things(evidence, known, deadline)}
    for wall in np.unique(chunks.walls_of(np.flatnonzero(judged.gone))).tolist():
        if wall < len(known) and wall not in cuts:
            go_on(deadline)
            own = np.arange(chunks.first[wall], chunks.first[wall + 1])
            if _is_gone_whole(evidence, own, tuning.LEAST_GONE):
                passed[wall] = Draft("removed", (wall,), gone=own)
            cut = _cut(judged, wall, sigma)
            if cut is not None:
                cuts[wall] = cut
    cuts |= _between(judged, known, cuts, sigma)
    passed |= _between(judged, known, cuts | passed, sigma)
    return [cuts[wall] for wall in sorted(cuts)], [passed[wall] for wall in sorted(passed)]


def _between(judged: Judged, known: Segments, cuts: Mapping[int, Draft], sigma: float) -> dict[int, Draft]:
    """Return the removal of other walls no longer than a stub that nothing reads, with removed walls at both ends."""
    removed = [wall for wall, cut in cuts.items() if cut.code == "removed"]
    ends = scipy.spatial.cKDTree(known.endpoints[removed].reshape(-1, 2))
    gaps = np.asarray(ends.query(known.endpoints.reshape(-1, 2))[0]).reshape(-1, 2)
    between = (gaps <= tuning.LOOP_GAP + corner_error(sigma)).all(axis=1) & (known.lengths < tuning.LONGEST_STUB)
    between[list(cuts)] = False
    found = np.flatnonzero(between).tolist()
    return {k: Draft("removed", (k,)) for k in found if not judged.read[judged.chunks.of_wall(k)].any()}


def corner_error(sigma: float) -> float:
    """Return how far apart the ends of two walls may be that meet at a corner, metres."""
    return tuning.DEVIATIONS * math.hypot(sigma, sigma)


def _corners(walls: Segments) -> Indices:
    """Return the number of the corner at both ends of each wall, (n, 2)."""
    rounded = np.round(walls.endpoints.reshape(-1, 2) / tuning.LOOP_GAP).astype(np.int64)
    return np.unique(rounded, axis=0, return_inverse=True)[1].reshape(-1, 2)


def _gone_things(evidence: WallEvidence, known: Segments, deadline: Deadline) -> Iterator[Draft]:
    """Yield the walls of things that are gone: closed loops of walls that beams pass through, and that none reads.

    A thing that beams pass through is not solid, so its other sides are gone, too, whether they were seen or not.
    """
    chunks = evidence.chunks
    corner = _corners(known)
    at = np.bincount(corner.ravel())
    joined = scipy.sparse.coo_array((np.ones(len(known)), (corner[:, 0], corner[:, 1])), shape=(len(at), len(at)))
    loop_of = scipy.sparse.csgraph.connected_components(joined, directed=False)[1][corner[:, 0]]
    order = np.argsort(loop_of, kind="stable")
    passed = chunks.walls_of(evidence.chunk[evidence.counts[:, 0] > 0])
    for loop in np.unique(loop_of[passed[passed < len(known)]]):
        go_on(deadline)
        mine = order[np.searchsorted(loop_of, loop, sorter=order) : np.searchsorted(loop_of, loop, "right", order)]
        if len(mine) < 3 or chunks.walls.lengths[mine].sum() > tuning.THING or (at[np.unique(corner[mine])] != 2).any():
            continue
        own = [np.arange(chunks.first[wall], chunks.first[wall + 1]) for wall in mine]
        if _is_gone_whole(evidence, np.concatenate(own), tuning.LEAST_GONE_OF_THING):
            for wall, part in zip(mine.tolist(), own, strict=True):
                rows = evidence.rows_of(part)
                gone = np.unique(evidence.chunk[rows][evidence.counts[rows, 0] > 0])
                yield Draft("removed", (wall,), gone=gone)


def _is_gone_whole(evidence: WallEvidence, chunks: Indices, least: float) -> bool:
    """Return whether beams of several visits and poses pass through this fraction of chunks, and nothing reads them."""
    rows = evidence.rows_of(chunks)
    through, on, _ = evidence.counts[rows].sum(axis=0)
    if on > tuning.FEW_ON_THING * (through + on) or evidence.visits_of(rows, on=True) or evidence.is_read(rows):
        return False
    passed = len(np.unique(evidence.chunk[rows][evidence.counts[rows, 0] > 0])) / len(chunks)
    visits, poses = evidence.visits_of(rows, on=False), evidence.places_of(rows, on=False)
    return bool(are_enough(len(visits), poses) and passed >= least)


def _cut(judged: Judged, wall: int, sigma: float) -> Draft | None:
    """Return what is gone of a wall; None where that is too little to be sure of."""
    own = judged.chunks.of_wall(wall)
    first, gone, read, open_ = own.start, judged.gone[own], judged.read[own], judged.open[own]
    step = float(judged.chunks.walls.lengths[wall]) / len(gone)
    if gone.mean() >= tuning.LEAST_GONE and not (read & ~gone).any():
        return Draft("removed", (wall,), gone=first + np.flatnonzero(gone))
    out = np.zeros(len(gone), dtype=bool)
    for begin, end in runs(gone):
        if (end - begin) * step < tuning.LEAST_CUT:
            continue
        while begin > 0 and open_[begin - 1]:
            begin -= 1
        while end < len(gone) and open_[end]:
            end += 1
        out[begin:end] = True
    if not out.any():
        return None
    for begin, end in runs(~out):  # too short to be a wall; at a corner, beams that end on the next wall read it
        if (end - begin) * step < tuning.LONGEST_STUB:
            out[begin:end] = True
    left = np.array([judged.chunks.part(wall, begin, end) for begin, end in runs(~out)]).reshape(-1, 4)
    code: ChangeCode = "shortened" if len(left) else "removed"
    sigmas, rest_read = np.full(len(left), sigma), bool((read & ~out).any())
    return Draft(code, (wall,), left, sigmas, first + np.flatnonzero(out & gone), rest_read=rest_read)
