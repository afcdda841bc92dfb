"""Evidence of all scans about walls, and what it shows: chunks that are there, and chunks that are not."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from association import Deadline
from registration import Segments

from ..views import Steps
from . import tuning
from .beams import NOTHING, Chunks, follow, on_critical_wall
from .result import Bools, Indices
from .scans import Localized


@dataclass(frozen=True, slots=True, eq=False)
class Judged:
    """The judgement of each chunk by the evidence: (c,) flags each.

    Attributes
    ----------
    chunks : Chunks
    gone
        It is not there: several visits and poses pass through, and no visit reads it.
    there
        It is there: several visits and poses read it, and no visit passes through.
    open
        Some beams pass through, and nothing reads it: gone if the chunk next to it is.
    read
        Some visit reads it.
    """

    chunks: Chunks
    gone: Bools
    there: Bools
    open: Bools
    read: Bools


@dataclass(frozen=True, slots=True, eq=False)
class WallEvidence:
    """Evidence of scans about chunks of walls: a row for each chunk that a scan is evidence for.

    Attributes
    ----------
    chunks : Chunks
    sights : tuple of (c,) or None
        Chunks that each scan saw something of, those without evidence, too; None where its pose is not known.
    chunk : (r,)
        Ascending.
    visit, place : (r,)
        Number of the visit of the scan, and of the square of 0.5 m that it was taken in.
    counts : (r, 3)
        Beams that pass through the chunk, that end on it, and that end near it, so that it may be there and hidden.
    """

    chunks: Chunks
    sights: tuple[Indices | None, ...]
    chunk: Indices
    visit: Indices
    place: Indices
    counts: Indices

    def judge(self) -> Judged:
        """Decide about each chunk."""
        seen, at = np.unique(self.chunk, return_inverse=True)
        chunk, cells = _by_visit(at, self.visit, self.counts)
        total, read = np.zeros((len(seen), 3), dtype=np.intp), np.zeros(len(seen), dtype=bool)
        np.add.at(total, chunk, cells)
        np.logical_or.at(read, chunk, cells[:, 1] >= tuning.LEAST_BEAMS)
        passed, ended, _ = total.T
        is_open = (passed >= tuning.LEAST_BEAMS) & (ended <= tuning.FEW * (passed + ended))
        rows, near = self._spread(seen, at)
        gone, there = (self._decided(total, rows, near, on=is_on) for is_on in (False, True))
        flags = np.zeros((4, len(self.chunks)), dtype=bool)
        flags[:, seen] = gone, there, is_open, read
        return Judged(self.chunks, *flags)

    def _spread(self, seen: Indices, at: Indices) -> tuple[Indices, Indices]:
        """Return each row for its chunk, and for the chunks of its wall next to it: rows, and positions in `seen`."""
        adjoin = (np.diff(seen) == 1) & (np.diff(self.chunks.walls_of(seen)) == 0)
        behind, ahead = np.append(adjoin, False)[at], np.insert(adjoin, 0, False)[at]
        rows = np.arange(len(at))
        return np.concatenate([rows, rows[behind], rows[ahead]]), np.concatenate([at, at[behind] + 1, at[ahead] - 1])

    def _decided(self, total: Indices, rows: Indices, near: Indices, *, on: bool) -> Bools:
        """Decide about each chunk by its beams and those of the chunks next to it; it has some of its own."""
        size = len(total)
        chunk, cells = _by_visit(near, self.visit[rows], self.counts[rows])
        agree, other = cells[:, int(on)], cells[:, int(not on)]
        against = other if on else other + cells[:, 2]
        both, others = np.bincount(chunk, agree + other, size), np.bincount(chunk, other, size)
        visits = np.bincount(chunk[shows(agree, against)], minlength=size)
        contradicted = np.bincount(chunk[shows(against, agree)], minlength=size) > 0
        sights = self._shown(rows, on=on)
        poses = np.unique(np.stack([near[sights], self.place[rows][sights]]), axis=1)[0]
        enough = are_enough(visits, np.bincount(poses, minlength=size))
        return np.asarray((total[:, int(on)] > 0) & (others <= tuning.FEW * both) & ~contradicted & enough)

    def _shown(self, rows: Indices, *, on: bool) -> Bools:
        """Return which rows read their chunk, or pass through it."""
        through, ended, _ = self.counts[rows].T
        return np.asarray((through + ended > 0) & ((ended > through) == on))

    def seen_by(self, chunks: Indices) -> Bools:
        """Return which scans saw something of some chunks; one whose pose is not known may have."""
        return np.array([seen is None or np.isin(seen, chunks).any() for seen in self.sights], dtype=bool)

    def passed_walls(self) -> Indices:
        """Return the walls with a chunk that most beams of several visits pass through."""
        chunk, cells = _by_visit(self.chunk, self.visit, self.counts)
        passed, visits = np.unique(chunk[shows(cells[:, 0], cells[:, 1])], return_counts=True)
        return np.unique(self.chunks.walls_of(passed[visits >= tuning.LEAST_VISITS]))

    def rows_of(self, chunks: Indices) -> Indices:
        """Return the rows of some chunks."""
        begin, end = (np.searchsorted(self.chunk, chunks, side=side) for side in ("left", "right"))
        count = end - begin
        return np.repeat(end - np.cumsum(count), count) + np.arange(count.sum())

    def is_read(self, rows: Indices) -> bool:
        """Return whether a visit reads any chunk of some rows."""
        _, cells = _by_visit(self.chunk[rows], self.visit[rows], self.counts[rows])
        return bool((cells[:, 1] >= tuning.LEAST_BEAMS).any())

    def places_of(self, rows: Indices, *, on: bool) -> int:
        """Return the number of places from which the chunks of some rows are read, or passed through."""
        return len(np.unique(self.place[rows][self._shown(rows, on=on)]))

    def visits_of(self, rows: Indices, *, on: bool) -> set[int]:
        """Return the visits that show that the chunks of some rows are there, or not there."""
        visits, cells = _by_visit(self.visit[rows], np.zeros_like(rows), self.counts[rows])
        return set(visits[shows(cells[:, int(on)], cells[:, int(not on)])].tolist())


def _by_visit(chunk: Indices, visit: Indices, counts: Indices) -> tuple[Indices, Indices]:
    """Sum the beams of each visit at each chunk; return the chunk of each sum, and the sums (k, 3)."""
    visits = int(visit.max(initial=0)) + 1
    key, where = np.unique(chunk * visits + visit, return_inverse=True)
    sums = np.zeros((len(key), 3), dtype=np.intp)
    np.add.at(sums, where, counts)
    return key // visits, sums


def are_enough(visits: Indices | int, poses: Indices | int) -> Bools:
    """Return where so many visits that agree, and so many places that they saw it from, are enough to be sure.

    Of three visits each may have seen it from the same place.
    """
    return np.asarray(
        (np.asarray(visits) >= tuning.LEAST_VISITS)
        & ((np.asarray(poses) >= tuning.LEAST_POSES) | (np.asarray(visits) >= tuning.ENOUGH_VISITS))
    )


def shows(agree: Indices, against: Indices) -> Bools:
    """Return where the beams of a visit show something: enough of them, and most of all."""
    return np.asarray((agree >= tuning.LEAST_BEAMS) & (agree >= tuning.MOST * (agree + against)))


def gather(
    walls: Segments,
    found: Sequence[Localized],
    chosen: Collection[Localized],
    sigma: float,
    deadline: Deadline,
    *,
    oriented: bool,
) -> Steps[WallEvidence]:
    """Follow the beams of localized scans through walls, one scan at a step, and return the evidence.

    A scan is no evidence for the wall that its pose depends on.

    Parameters
    ----------
    walls : Segments
        Of the map, and those that may be there; metres in the map frame.
    found : sequence of Localized
        All scans.
    chosen : collection of Localized
        Those of them that give evidence.
    sigma : float
        Standard deviation of the walls, metres.
    deadline : Deadline
    oriented : bool
        True if a wall is seen from its left only.
    """
    chunks = Chunks.of(walls)
    places = {place: k for k, place in enumerate(dict.fromkeys(one.place for one in chosen))}
    chunk, counts, of_scan = [NOTHING], [np.zeros((0, 3), dtype=np.intp)], [np.zeros((0, 2), dtype=np.intp)]
    sights: list[Indices | None] = []
    for one in found:
        is_placed = one.result.pose is not None and one.result.covariance is not None
        seen = follow(chunks, one, sigma, deadline, oriented=oriented) if is_placed else None
        sights.append(None if seen is None else seen.chunks)
        if seen is not None and one in chosen:
            own = ~on_critical_wall(one, walls)[chunks.walls_of(seen.chunks)]
            chunk.append(seen.chunks[own])
            counts.append(seen.counts[own])
            of_scan.append(np.tile((one.visit, places[one.place]), (own.sum(), 1)))
        yield
    met = np.concatenate(chunk)
    order = np.argsort(met, kind="stable")
    visit, place = np.concatenate(of_scan)[order].T
    return WallEvidence(chunks, tuple(sights), met[order], visit, place, np.concatenate(counts)[order])
