"""Beams of a scan that end on walls, or pass through them, in chunks along each wall."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from association import Deadline
from registration import Segments

from . import tuning
from .result import Bools, Floats, Indices
from .scans import Localized, blocks

NOTHING = np.zeros(0, dtype=np.intp)


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
        counts = np.maximum(1, np.round(walls.lengths / tuning.CHUNK)).astype(np.intp)
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

    def part(self, wall: int, begin: int, end: int) -> Floats:
        """Return the ends of a wall's chunks from one to another (exclusive), (4,)."""
        walls, step = self.walls, self.walls.lengths[wall] / self.counts[wall]
        place, along = walls.endpoints[wall, :2], walls.directions[wall]
        return np.concatenate([place + begin * step * along, place + end * step * along])

    def middles(self, wall: int) -> Floats:
        """Return the middles of the chunks of a wall, (k, 2)."""
        count, walls = int(self.counts[wall]), self.walls
        along = (np.arange(count)[:, None] + 0.5) / count * walls.lengths[wall]
        return np.asarray(walls.endpoints[wall, :2] + along * walls.directions[wall])

    def walls_of(self, chunks: Indices) -> Indices:
        """Return the wall of each of some chunks."""
        return np.searchsorted(self.first, chunks, side="right") - 1


@dataclass(frozen=True, slots=True, eq=False)
class Followed:
    """Beams of one scan at chunks of walls.

    Attributes
    ----------
    chunks : (k,)
        That beams meet, in order.
    counts : (k, 3)
        Number of beams that pass through each, that end on it, and that end on another wall or back next to it.
    """

    chunks: Indices
    counts: Indices


def follow(chunks: Chunks, one: Localized, sigma: float, deadline: Deadline, *, oriented: bool) -> Followed:
    """Follow the beams of a scan through walls.

    Parameters
    ----------
    chunks : Chunks
    one : Localized
    sigma : float
        Standard deviation of the walls, metres.
    deadline : Deadline
    oriented : bool
        True if a wall is seen from its left only.
    """
    origins, rays, ranges = beams_in_map(one)
    near = within(chunks.walls, origins.mean(axis=0), float(ranges.max(initial=0.0))) if len(ranges) else NOTHING
    walls, first, counts = chunks.walls.take(near), chunks.first[near], chunks.counts[near]
    met, flags = [NOTHING], [np.zeros((0, 3), dtype=bool)]
    for rows in blocks(len(ranges), len(near), deadline):
        column, along, kinds = _met(walls, one, (origins[rows], rays[rows], ranges[rows]), sigma, oriented=oriented)
        part = (along / walls.lengths[column] * counts[column]).astype(np.intp)
        met.append(first[column] + np.minimum(part, counts[column] - 1))
        flags.append(kinds)
    seen, where = np.unique(np.concatenate(met), return_inverse=True)
    kinds = np.concatenate(flags)
    total = np.stack([np.bincount(where[kinds[:, k]], minlength=len(seen)) for k in range(3)], axis=1)
    some = total.any(axis=1)
    return Followed(seen[some], total[some])


def _met(
    walls: Segments, one: Localized, seen: tuple[Floats, Floats, Floats], sigma: float, *, oriented: bool
) -> tuple[Indices, Floats, Bools]:
    """Return the walls that beams meet, where along them (m), and whether a beam passes, ends on it, or ends near it.

    A beam ends on the wall that is nearest to its end. Flat beams that end on a wall next to a corner also end near the
    other wall of the corner, or where it stood: of that they show nothing.
    """
    origins, rays, ranges = seen
    beams, columns = _crossed(walls, origins, rays)
    normals = walls.normals[columns]
    slant = np.einsum("ij,ij->i", rays[beams], normals)
    ahead = walls.offsets[columns] - np.einsum("ij,ij->i", origins[beams], normals)
    met = (np.abs(slant) >= tuning.LEAST_SLANT) & (ahead * slant > 0.0)
    beams, columns, slant = beams[met], columns[met], slant[met]
    distance = ahead[met] / slant
    gap, tolerance = (ranges[beams] - distance) * np.abs(slant), _tolerance(one, sigma, distance)
    kept = np.flatnonzero(gap >= -tolerance)
    kept = kept[_nearest(beams[kept], distance[kept])]
    beams, columns, slant, distance = beams[kept], columns[kept], slant[kept], distance[kept]
    gap, tolerance = gap[kept], tolerance[kept]
    directions, lengths = walls.directions[columns], walls.lengths[columns]
    across = np.einsum("ij,ij->i", rays[beams], directions)
    off = origins[beams] - walls.endpoints[columns, :2]
    along = np.clip(np.einsum("ij,ij->i", off, directions) + distance * across, 0.0, lengths)
    facing = (slant < 0.0) | (not oriented)
    # The beam has to be behind the wall there, not past its end: else a wall that is a little off would seem gone.
    deep = along + tuning.THROUGH * tolerance / np.abs(slant) * across
    passed = (gap > tuning.THROUGH * tolerance) & (deep >= 0.0) & (deep <= lengths)
    ended = (np.abs(gap) <= tolerance) & facing
    nearest = np.full(len(ranges), np.inf)
    np.minimum.at(nearest, beams[ended], np.abs(gap[ended]))
    ended &= np.abs(gap) <= nearest[beams]
    return columns, along, np.stack([passed, ended, (np.abs(gap) <= tolerance) & ~ended], axis=1)


def _crossed(walls: Segments, origins: Floats, rays: Floats) -> tuple[Indices, Indices]:
    """Return the pairs of a beam and a wall whose lines meet on the wall, before or behind the beam's origin.

    The ends of such a wall lie on different sides of the beam's line.
    """
    left = np.stack([-rays[:, 1], rays[:, 0]], axis=1)
    own = np.einsum("ij,ij->i", left, origins)[:, None]
    begins, ends = left @ walls.endpoints[:, :2].T >= own, left @ walls.endpoints[:, 2:].T >= own
    return np.divmod(np.flatnonzero(begins != ends), len(walls))


def _nearest(beams: Indices, distance: Floats) -> Indices:
    """Return the rows of the nearest walls of each beam, at most `MOST_PASSED`, which bounds the memory."""
    order = np.lexsort((distance, beams))
    sorted_beams = beams[order]
    rank = np.arange(len(order)) - np.searchsorted(sorted_beams, sorted_beams)
    return np.sort(order[rank < tuning.MOST_PASSED])


def beams_in_map(one: Localized) -> tuple[Floats, Floats, Floats]:
    """Return the beams that came back: their origins (m, 2), unit directions (m, 2), and ranges (m,); map frame.

    A beam without return is no evidence: dark and transparent walls return none.
    """
    beams = one.scan.beams
    assert beams is not None
    assert one.scan.viewpoint is not None
    known = np.flatnonzero(np.isfinite(beams.ranges) & (beams.ranges < beams.range_max))
    known = known[:: max(1, math.ceil(len(known) / tuning.MOST_BEAMS))]
    at = np.tile(one.scan.viewpoint, (len(known), 1)) if beams.origins is None else beams.origins[known]
    angles = beams.angles[known] + one.pose.theta
    return one.pose.apply(at), np.stack([np.cos(angles), np.sin(angles)], axis=1), beams.ranges[known]


def within(walls: Segments, place: Floats, reach: float) -> Indices:
    """Return the walls that come nearer than `reach` to a place."""
    off = place - walls.endpoints[:, :2]
    along = np.clip(np.einsum("ij,ij->i", off, walls.directions), 0.0, walls.lengths)
    gaps = off - along[:, None] * walls.directions
    return np.flatnonzero(np.einsum("ij,ij->i", gaps, gaps) <= (reach + 1.0) ** 2)


def lie_on(
    points: Floats,
    direction: Floats,
    walls: Segments,
    deadline: Deadline,
    *,
    near: float,
    past: float = 0.0,
    cosine: float = math.cos(2.0 * tuning.SAME_ANGLE),
) -> Bools:
    """Return which points of a line lie on walls that face about the same way, (k,).

    Parameters
    ----------
    points : (k, 2)
    direction : (2,)
        Of the line, a unit vector.
    walls : Segments
    deadline : Deadline
    near, past : float
        Largest distance from a wall across it, and beyond its ends; metres.
    cosine : float
        Least cosine of the angle between the line and a wall.
    """
    low, high = points.min(axis=0, initial=np.inf) - near, points.max(axis=0, initial=-np.inf) + near
    begins, ends = walls.endpoints[:, :2], walls.endpoints[:, 2:]
    met = ((np.maximum(begins, ends) >= low) & (np.minimum(begins, ends) <= high)).all(axis=1)
    walls = walls.take(np.flatnonzero(met & (walls.directions @ direction >= cosine)))
    out = np.zeros(len(points), dtype=bool)
    for rows in blocks(len(points), len(walls), deadline):
        off = points[rows, None, :] - walls.endpoints[None, :, :2]
        along = np.einsum("kij,ij->ki", off, walls.directions)
        across = np.abs(np.einsum("kij,ij->ki", off, walls.normals))
        out[rows] = ((along >= -past) & (along <= walls.lengths + past) & (across <= near)).any(axis=1)
    return out


def _tolerance(one: Localized, sigma: float, distance: Floats) -> Floats:
    """Return how far a beam may end from a wall and still read it, metres."""
    assert one.result.covariance is not None
    position = float(np.linalg.eigvalsh(one.result.covariance[:2, :2]).max())
    turn = float(one.result.covariance[2, 2])
    noise = float(np.median(one.scan.measured.sigma)) if len(one.scan.measured) else 0.0
    deviation = np.sqrt(noise**2 + sigma**2 + position + turn * distance**2)
    return np.maximum(tuning.LEAST_TOLERANCE, tuning.DEVIATIONS * deviation)


def on_critical_wall(one: Localized, walls: Segments) -> Bools:
    """Return which walls, the first of them those of the map, are pieces of the wall that the pose depends on, (n,).

    Without it the pose would move or be free. All walls on its line are pieces of it.
    """
    out, diagnostics = np.zeros(len(walls), dtype=bool), one.result.diagnostics
    wall = None if diagnostics is None else diagnostics.critical_wall
    for piece in () if wall is None else wall.map:
        normal, offset = walls.normals[piece], walls.offsets[piece]
        along, off = np.abs(walls.directions @ normal), np.abs(walls.midpoints @ normal - offset)
        out |= (along < 0.05) & (off < tuning.LEAST_TOLERANCE)
    return out
