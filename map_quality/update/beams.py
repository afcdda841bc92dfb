"""Beams of a scan that end on walls, or pass through them, in chunks along each wall.

A scan is no evidence for the walls that its pose depends on alone.
"""

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


def follow(
    chunks: Chunks, one: Localized, lines: Floats, sigma: float, deadline: Deadline, *, oriented: bool
) -> Followed:
    """Follow the beams of a scan through walls.

    Parameters
    ----------
    chunks : Chunks
    one : Localized
    lines : (k, 3)
        Lines of walls that the scan is no evidence for, as of `critical_lines`.
    sigma : float
        Standard deviation of the walls, metres.
    deadline : Deadline
    oriented : bool
        True if a wall is seen from its left only.
    """
    origins, rays, ranges = beams_in_map(one)
    near = within(chunks.walls, origins.mean(axis=0), float(ranges.max(initial=0.0))) if len(ranges) else NOTHING
    walls, first, counts = chunks.walls.take(near), chunks.first[near], chunks.counts[near]
    is_evidence = ~on_lines(walls, lines)
    met, flags = [NOTHING], [np.zeros((0, 3), dtype=bool)]
    for rows in blocks(len(ranges), len(near), deadline):
        column, along, kinds = _met(walls, one, (origins[rows], rays[rows], ranges[rows]), sigma, oriented=oriented)
        part = (along / walls.lengths[column] * counts[column]).astype(np.intp)
        met.append(first[column] + np.minimum(part, counts[column] - 1))
        flags.append(kinds & is_evidence[column, None])
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


def seen_walls(chunks: Chunks, one: Localized, sigma: float, deadline: Deadline) -> Indices:
    """Return the walls that beams of a scan end on or near, or pass through.

    All where the pose of the scan is not known: it may be anywhere.
    """
    if one.result.pose is None or one.result.covariance is None:
        return np.arange(len(chunks.walls))
    seen = follow(chunks, one, np.zeros((0, 3)), sigma, deadline, oriented=False)
    return np.unique(chunks.walls_of(seen.chunks))


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


def _tolerance(one: Localized, sigma: float, distance: Floats) -> Floats:
    """Return how far a beam may end from a wall and still read it, metres."""
    assert one.result.covariance is not None
    position = float(np.linalg.eigvalsh(one.result.covariance[:2, :2]).max())
    turn = float(one.result.covariance[2, 2])
    noise = float(np.median(one.scan.measured.sigma)) if len(one.scan.measured) else 0.0
    deviation = np.sqrt(noise**2 + sigma**2 + position + turn * distance**2)
    return np.maximum(tuning.LEAST_TOLERANCE, tuning.DEVIATIONS * deviation)


def critical_lines(one: Localized, known: Segments) -> Floats:
    """Return the lines of the wall without which the pose of a scan would move or be free: normal and offset, (k, 3).

    They are of the segments of the map, `known`, that are pieces of this wall; none where the pose depends on no wall.
    """
    diagnostics = one.result.diagnostics
    wall = None if diagnostics is None else diagnostics.critical_wall
    on = known.take(np.array(() if wall is None else wall.map, dtype=np.intp))
    return np.column_stack([on.normals, on.offsets])


def on_lines(walls: Segments, lines: Floats) -> Bools:
    """Return which walls lie on any of some lines, as pieces of one wall do, (n,)."""
    out = np.zeros(len(walls), dtype=bool)
    for line in lines:
        along, off = np.abs(walls.directions @ line[:2]), np.abs(walls.midpoints @ line[:2] - line[2])
        out |= (along < 0.05) & (off < tuning.LEAST_TOLERANCE)
    return out
