"""Evidence of beams about walls, in chunks along each wall: beams that end on it, and beams that pass through it."""

from __future__ import annotations

import math
from collections.abc import Generator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from registration import JointSums, RigidTransform, Segments

from .scans import Localized
from .tuning import (
    CHUNK,
    DEVIATIONS,
    FEW,
    HANGING,
    HIDDEN,
    LEAST_BEAMS,
    LEAST_POSES,
    LEAST_SLANT,
    LEAST_TOLERANCE,
    LEAST_VISITS,
    MOST,
    MOST_BEAMS,
    THROUGH,
)

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]
Bools = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Chunks:
    """Walls cut into pieces of about 0.2 m.

    Attributes
    ----------
    walls : Segments
        In the map frame.
    first : (n + 1,)
        The first chunk of each wall; chunks of a wall follow one another from its begin.
    """

    walls: Segments
    first: Indices

    @classmethod
    def of(cls, walls: Segments) -> Chunks:
        """Cut walls into chunks of equal length."""
        counts = np.maximum(1, np.round(walls.lengths / CHUNK)).astype(np.intp)
        return cls(walls, np.concatenate([[0], np.cumsum(counts)]).astype(np.intp))

    def __len__(self) -> int:
        return int(self.first[-1])

    @property
    def counts(self) -> Indices:
        """Number of chunks of each wall, (n,)."""
        return np.diff(self.first)

    def of_wall(self, wall: int) -> slice:
        """Return the chunks of a wall."""
        return slice(int(self.first[wall]), int(self.first[wall + 1]))


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
        return np.asarray(own & clear & ~no_visits & (visits >= LEAST_VISITS) & (poses >= LEAST_POSES))

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
        rows = np.unique(self.sights[self.seen_on == on][:, :2], axis=0)
        wall = np.repeat(np.arange(len(self.chunks.walls)), self.chunks.counts)
        spread = [rows]
        for step in (-1, 1):
            moved = rows + np.array([step, 0])
            moved = moved[(moved[:, 0] >= 0) & (moved[:, 0] < len(self.chunks))]
            spread.append(moved[wall[moved[:, 0]] == wall[moved[:, 0] - step]])
        return np.bincount(np.unique(np.concatenate(spread), axis=0)[:, 0], minlength=len(self.chunks))

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


def shows(agree: Indices, against: Indices) -> Bools:
    """Return where the beams of a visit show something: enough of them, and most of all."""
    return np.asarray((agree >= LEAST_BEAMS) & (agree >= MOST * (agree + against)))


def gather(
    walls: Segments, found: Sequence[Localized], visits: int, sigma: float, *, oriented: bool
) -> Generator[None, None, WallEvidence]:
    """Follow the beams of localized scans through walls, one scan at a step, and return the evidence.

    Parameters
    ----------
    walls : Segments
        Of the map, and others that may be there; metres in the map frame.
    found : sequence of Localized
        Scans that give evidence.
    visits : int
        Number of all visits.
    sigma : float
        Standard deviation of the walls, metres.
    oriented : bool
        True if a wall is seen from its left only.
    """
    chunks = Chunks.of(walls)
    through, on, before = (np.zeros((visits, len(chunks)), dtype=np.intp) for _ in range(3))
    places = {place: k for k, place in enumerate(dict.fromkeys(one.place for one in found))}
    sights, seen_on = [], []
    for one in found:
        of_scan = _follow(chunks, one, sigma, oriented=oriented)
        through[one.visit] += of_scan[0]
        on[one.visit] += of_scan[1]
        before[one.visit] += of_scan[2]
        seen = np.flatnonzero(of_scan[0] + of_scan[1])
        sights.append(np.stack([seen, np.full_like(seen, places[one.place]), np.full_like(seen, one.number)], axis=1))
        seen_on.append(of_scan[1][seen] > of_scan[0][seen])
        yield
    rows = np.concatenate(sights) if sights else np.zeros((0, 3), dtype=np.intp)
    return WallEvidence(
        chunks, through, on, before, rows, np.concatenate(seen_on) if seen_on else np.zeros(0, dtype=bool)
    )


def _follow(chunks: Chunks, one: Localized, sigma: float, *, oriented: bool) -> tuple[Indices, Indices, Indices]:
    """Return the beams of a scan through each chunk, on each, and a little before each, (c,)."""
    origins, rays, ranges = beams_in_map(one)
    near = _within(chunks.walls, origins.mean(axis=0), float(ranges.max(initial=0.0)))
    near = near[~hanging_walls(chunks.walls.take(near), one, sigma)]
    if not len(near) or not len(ranges):
        nothing = np.zeros(len(chunks), dtype=np.intp)
        return nothing, nothing, nothing
    walls = chunks.walls.take(near)
    slant, across = rays @ walls.normals.T, rays @ walls.directions.T
    to_line = walls.offsets[None, :] - origins @ walls.normals.T
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = to_line / slant
        along = (
            origins @ walls.directions.T
            + distance * across
            - np.einsum("ij,ij->i", walls.endpoints[:, :2], walls.directions)[None, :]
        )
        behind = (ranges[:, None] - distance) * np.abs(slant)
        met = (np.abs(slant) >= LEAST_SLANT) & (distance > 0.0) & (along >= 0.0) & (along < walls.lengths[None, :])
    beams, columns = np.nonzero(met)
    gap, slanted, far = behind[beams, columns], slant[beams, columns], distance[beams, columns]
    tolerance = _tolerance(one, sigma, far)
    share = along[beams, columns] / walls.lengths[columns]
    counts = chunks.counts[near[columns]]
    chunk = chunks.first[near[columns]] + np.minimum((share * counts).astype(np.intp), counts - 1)
    facing = (slanted < 0.0) | (not oriented)
    # The beam has to be behind the wall there, not past its end: else a wall that is a little off would seem gone.
    deep = along[beams, columns] + THROUGH * tolerance / np.abs(slanted) * across[beams, columns]
    within = (deep >= 0.0) & (deep <= walls.lengths[columns])
    passed, ended = (gap > THROUGH * tolerance) & within, (np.abs(gap) <= tolerance) & facing
    hidden = (gap >= -HIDDEN) & (gap <= tolerance) & ~ended
    passed_of, on_of, before_of = (np.bincount(chunk[one], minlength=len(chunks)) for one in (passed, ended, hidden))
    return passed_of, on_of, before_of


def beams_in_map(one: Localized) -> tuple[Floats, Floats, Floats]:
    """Return the beams that came back: their origins (m, 2), unit directions (m, 2), and ranges (m,); map frame.

    A beam without return is no evidence: dark and transparent walls return none.
    """
    beams = one.scan.beams
    assert beams is not None
    assert one.scan.viewpoint is not None
    known = np.flatnonzero(np.isfinite(beams.ranges) & (beams.ranges < beams.range_max))
    known = known[:: max(1, math.ceil(len(known) / MOST_BEAMS))]
    at = np.tile(one.scan.viewpoint, (len(known), 1)) if beams.origins is None else beams.origins[known]
    angles = beams.angles[known] + one.pose.theta
    return one.pose.apply(at), np.stack([np.cos(angles), np.sin(angles)], axis=1), beams.ranges[known]


def _within(walls: Segments, place: Floats, reach: float) -> Indices:
    """Return the walls that come nearer than `reach` to a place."""
    off = place - walls.endpoints[:, :2]
    along = np.clip(np.einsum("ij,ij->i", off, walls.directions), 0.0, walls.lengths)
    gaps = off - along[:, None] * walls.directions
    return np.flatnonzero(np.einsum("ij,ij->i", gaps, gaps) <= (reach + 1.0) ** 2)


def _tolerance(one: Localized, sigma: float, distance: Floats) -> Floats:
    """Return how far a beam may end from a wall and still read it, metres."""
    assert one.result.covariance is not None
    position = float(np.linalg.eigvalsh(one.result.covariance[:2, :2]).max())
    turn = float(one.result.covariance[2, 2])
    noise = float(np.median(one.scan.measured.sigma)) if len(one.scan.measured) else 0.0
    deviation = np.sqrt(noise**2 + sigma**2 + position + turn * distance**2)
    return np.maximum(LEAST_TOLERANCE, DEVIATIONS * deviation)


def hanging_walls(walls: Segments, one: Localized, sigma: float) -> Bools:
    """Return the walls without which the pose of a scan would not be known along their normal, (n,).

    The sums of the other correspondences are what remains when those of a wall are taken out.
    """
    pairs = one.pairs
    weights = 1.0 / (pairs.variances + sigma**2)
    local = pairs.about((one.pose.x, one.pose.y), (0.0, 0.0))
    total, hanging = JointSums.of_set(local, weights), np.zeros(len(walls), dtype=bool)
    left = np.ones(len(pairs), dtype=bool)
    while left.any():
        first = int(np.argmax(left))
        normal, offset = pairs.map_normals[first], pairs.map_offsets[first]
        mine = _on_line(pairs.map_directions, pairs.map_midpoints, normal, offset)
        mine[first] = True
        left &= ~mine
        rest = total - JointSums.of_set(local.take(mine), weights[mine])
        if rest.count < 2 or _deviation(rest, one.pose, normal) > HANGING:
            hanging |= _on_line(walls.directions, walls.midpoints, normal, offset)
    return hanging


def _on_line(directions: Floats, midpoints: Floats, normal: Floats, offset: float) -> Bools:
    """Return which segments lie on a line, as pieces of one wall do."""
    return np.asarray((np.abs(directions @ normal) < 0.05) & (np.abs(midpoints @ normal - offset) < LEAST_TOLERANCE))


def _deviation(sums: JointSums, pose: RigidTransform, normal: Floats) -> float:
    """Return the standard deviation of a pose along a direction by some sums, metres; inf where it is free."""
    information = sums.information(pose.theta)
    values, vectors = np.linalg.eigh(information)
    along = vectors.T @ np.array([normal[0], normal[1], 0.0])
    free = values <= 1e-9 * max(1.0, float(values.max()))
    if np.any(np.abs(along[free]) > 1e-3):
        return math.inf
    return float(np.sqrt(np.sum(along[~free] ** 2 / values[~free])))
