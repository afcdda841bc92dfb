"""Evidence of all scans about walls, and what it shows: chunks that are there, and chunks that are not."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from association import AssociationResult
from registration import Segments

from .beams import Chunks, Followed, follow
from .hanging import hanging_lines
from .scans import Localized
from .tuning import ENOUGH_VISITS, FEW, LEAST_BEAMS, LEAST_POSES, LEAST_VISITS, MOST

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]
Bools = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class WallEvidence:
    """Evidence of all scans about chunks of walls.

    Attributes
    ----------
    chunks : Chunks
    through, on, before : (v, c)
        Beams of each visit that pass through each chunk, that end on it, and that end a little before it, so that it
        may be there and hidden.
    sights : (k, 3)
        Distinct rows of chunk, place, and scan that saw something; `place` numbers the squares of 0.5 m.
    seen_on : (k,)
        True if most beams of that scan at that chunk end on it; else they pass through.
    """

    chunks: Chunks
    through: Indices
    on: Indices
    before: Indices
    sights: Indices
    seen_on: Bools

    @property
    def gone(self) -> Bools:
        """Chunks that are not there: several visits and poses pass through, and no visit reads them, (c,)."""
        return self._decided(self.through, self.on, self.before, on=False)

    @property
    def there(self) -> Bools:
        """Chunks that are there: several visits and poses read them, and no visit passes through, (c,)."""
        return self._decided(self.on, self.through, np.zeros_like(self.on), on=True)

    @property
    def open(self) -> Bools:
        """Chunks that some beams pass through, and that nothing reads: gone if the chunk next to them is, (c,)."""
        through, on = self.through.sum(axis=0), self.on.sum(axis=0)
        hidden = shows(self.on + self.before, self.through).any(axis=0)
        return np.asarray((through >= LEAST_BEAMS) & (on <= FEW * (through + on)) & ~hidden)

    @property
    def read(self) -> Bools:
        """Chunks that some visit reads, (c,)."""
        return np.asarray((self.on >= LEAST_BEAMS).any(axis=0))

    def _decided(self, agree: Indices, against: Indices, hidden: Indices, *, on: bool) -> Bools:
        """Decide about each chunk by its beams and those of the chunks next to it; it has some of its own."""
        own = agree.sum(axis=0) > 0
        near, other, all_other = (self._near(one) for one in (agree, against, against + hidden))
        clear = other.sum(axis=0) <= FEW * (near + other).sum(axis=0)
        visits, no_visits = shows(near, all_other).sum(axis=0), shows(all_other, near).any(axis=0)
        poses = self.poses(on=on)
        return np.asarray(own & clear & ~no_visits & are_enough(visits, poses))

    def _near(self, counts: Indices) -> Indices:
        """Return the sums over each chunk and the chunks of its wall next to it, (v, c)."""
        inner = np.ones(len(self.chunks), dtype=bool)
        inner[self.chunks.first[:-1]] = False  # the first chunk of a wall has none before it
        total = counts.copy()
        total[:, 1:] += counts[:, :-1] * inner[1:]
        total[:, :-1] += counts[:, 1:] * inner[1:]
        return total

    def poses(self, *, on: bool) -> Indices:
        """Return the number of places from which each chunk, or one next to it, is read, or passed through, (c,)."""
        sights = self.sights[self.seen_on == on]
        places = int(sights[:, 1].max(initial=0)) + 1
        chunk, place = np.divmod(np.unique(sights[:, 0] * places + sights[:, 1]), places)
        wall = np.repeat(np.arange(len(self.chunks.walls)), self.chunks.counts)
        spread = [chunk * places + place]
        for step in (-1, 1):
            near = chunk + step
            inside = (near >= 0) & (near < len(self.chunks))
            inside[inside] = wall[near[inside]] == wall[chunk[inside]]
            spread.append(near[inside] * places + place[inside])
        return np.bincount(np.unique(np.concatenate(spread)) // places, minlength=len(self.chunks))

    def places_of(self, chunks: Indices, *, on: bool) -> int:
        """Return the number of places from which any of some chunks is read, or passed through."""
        chosen = np.isin(self.sights[:, 0], chunks) & (self.seen_on == on)
        return len(np.unique(self.sights[chosen, 1]))

    def scans_of(self, chunks: Indices) -> set[int]:
        """Return the numbers of the scans that saw something of some chunks."""
        return set(self.sights[np.isin(self.sights[:, 0], chunks), 2].tolist())

    def visits_of(self, chunks: Indices, *, on: bool) -> Bools:
        """Return which visits show that some chunks are there, or not there, (v,)."""
        own, other = (self.on, self.through) if on else (self.through, self.on)
        mine, others = own[:, chunks].sum(axis=1), other[:, chunks].sum(axis=1)
        return shows(mine, others)


def are_enough(visits: Indices | int, poses: Indices | int) -> Bools:
    """Return where so many visits that agree, and so many places that they saw it from, are enough to be sure.

    Of three visits each may have seen it from the same place.
    """
    return np.asarray(
        (np.asarray(visits) >= LEAST_VISITS)
        & ((np.asarray(poses) >= LEAST_POSES) | (np.asarray(visits) >= ENOUGH_VISITS))
    )


def shows(agree: Indices, against: Indices) -> Bools:
    """Return where the beams of a visit show something: enough of them, and most of all."""
    return np.asarray((agree >= LEAST_BEAMS) & (agree >= MOST * (agree + against)))


@dataclass(frozen=True, slots=True, eq=False)
class Gatherer:
    """Follows the beams of scans through the walls of a map, once for each pose.

    Attributes
    ----------
    known : Segments
        The map, metres in the map frame.
    sigma : float
        Standard deviation of the walls, metres.
    oriented : bool
        True if a wall is seen from its left only.
    kept : dict of int to (AssociationResult, Floats, Followed)
        By the number of a scan: its answer, the lines that it is no evidence for, and its beams at the map.
    """

    known: Segments
    sigma: float
    oriented: bool
    kept: dict[int, tuple[AssociationResult, Floats, Followed]] = field(default_factory=dict)

    def gather(self, new: Segments, found: Sequence[Localized], visits: int) -> Generator[None, None, WallEvidence]:
        """Follow the beams of localized scans, one scan at a step, and return the evidence.

        Parameters
        ----------
        new : Segments
            Walls that may be there; the evidence has them behind those of the map.
        found : sequence of Localized
            Scans that give evidence.
        visits : int
            Number of all visits.
        """
        chunks = Chunks.of(Segments.derived(np.concatenate([self.known.endpoints, new.endpoints])))
        at_map, at_new = Chunks.of(self.known), Chunks.of(new)
        through, on, before = (np.zeros((visits, len(chunks)), dtype=np.intp) for _ in range(3))
        places = {place: k for k, place in enumerate(dict.fromkeys(one.place for one in found))}
        sights, seen_on = [np.zeros((0, 3), dtype=np.intp)], [np.zeros(0, dtype=bool)]
        for one in found:
            lines, seen = self._at_map(at_map, one)
            beyond = follow(at_new, one, lines, self.sigma, oriented=self.oriented)
            seen = seen.and_behind(beyond, len(at_map))
            through[one.visit, seen.chunks] += seen.through
            on[one.visit, seen.chunks] += seen.on
            before[one.visit, seen.chunks] += seen.before
            told = seen.through + seen.on > 0
            row = seen.chunks[told]
            sights.append(np.stack([row, np.full_like(row, places[one.place]), np.full_like(row, one.number)], axis=1))
            seen_on.append(seen.on[told] > seen.through[told])
            yield
        return WallEvidence(chunks, through, on, before, np.concatenate(sights), np.concatenate(seen_on))

    def _at_map(self, chunks: Chunks, one: Localized) -> tuple[Floats, Followed]:
        """Return the lines that a scan is no evidence for, and its beams at the map."""
        kept = self.kept.get(one.number)
        if kept is None or kept[0] is not one.result:
            lines = hanging_lines(one, self.sigma)
            kept = one.result, lines, follow(chunks, one, lines, self.sigma, oriented=self.oriented)
            self.kept[one.number] = kept
        return kept[1], kept[2]
