"""Consistency of a map's directions: free space lies on the left of every segment that a ray meets.

A ray that leaves a wall on its left goes through free space, and should meet the next one on its left, too. If it meets
a back, one of the two is drawn the wrong way round. To the right of a wall is its material: a ray there should meet
nothing, or the back of the wall's other face.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from association import Deadline, MapIndex
from registration.layout import Floats

from . import tuning
from .pieces import Flags, Indices, longest_pieces, segments_of
from .result import Finding


@dataclass(frozen=True, slots=True)
class Sides:
    """Hits of the rays from walls.

    Attributes
    ----------
    walls : (k,) indices of the walls that were looked from
    lengths : (k,) metres
    hits : (k, 2, 2) from the left and from the right side, how many rays met a front, and how many a back
    room : (k, 2) distance of the nearest wall on the left, and on the right, metres; inf where there is none
    lost : (k,) True where a ray on the left ended within the map without a hit: its hit is not known
    """

    walls: Indices
    lengths: Floats
    hits: Floats
    room: Floats
    lost: Flags

    @property
    def wrong(self) -> Floats:
        """The number of rays that met the wrong side: backs from the left side, fronts from the right side; (k, 2)."""
        return np.stack([self.hits[:, 0, 1], self.hits[:, 1, 0]], axis=1)

    @property
    def against(self) -> Flags:
        """True where most rays from the left, and from the right side of a wall, met the wrong side; (k, 2)."""
        return np.asarray(self.wrong > tuning.CONTRADICTED * self.hits.sum(axis=2))

    @property
    def meaningless(self) -> bool:
        """Return whether rays meet fronts and backs about as often, on whatever side of a wall they start."""
        return self.contradiction >= tuning.MEANINGLESS and not self.reversed

    @property
    def contradiction(self) -> float:
        """The fraction of rays that meet what they should not, by length and the mean of both sides, 0 to 1."""
        met, wrong = self.lengths @ self.hits.sum(axis=2), self.lengths @ self.wrong
        return float(np.mean(np.divide(wrong, met, out=np.zeros(2), where=met > 0.0)))

    @property
    def reversed(self) -> bool:
        """Return whether the whole map is the wrong way round: free space is outside it, or no wider than a wall."""
        met = self.hits.sum(axis=2) > 0.0
        outside = ~met[:, 0] & met[:, 1] & ~self.lost
        within = (self.room[:, 0] < tuning.DOUBLE) & (self.room[:, 1] > 2.0 * tuning.DOUBLE)
        which = self.against.all(axis=1) | outside | within
        return bool(self.lengths[which].sum() >= tuning.MOST * self.lengths.sum() > 0.0)


@dataclass(frozen=True, slots=True)
class _Hits:
    """The first segments that rays meet: distances (r,), inf where there is none, indices, and if on their left."""

    reach: Floats
    segments: Indices
    fronts: Flags

    @classmethod
    def of(cls, ends: Floats, low: Floats, high: Floats, origins: Floats, rays: Floats) -> _Hits:
        """Follow rays from origins, both (r, 2), through segments, (n, 4) with corners (n, 2), up to `FOLLOWED`.

        If too many segments are near, rays meet none.
        """
        found = cls(np.full(len(rays), np.inf), np.zeros(len(rays), dtype=np.intp), np.zeros(len(rays), dtype=bool))
        for limit in (*tuning.NEAR_FOLLOWED, tuning.FOLLOWED):
            left = np.flatnonzero(np.isinf(found.reach))
            near = (high >= origins.min(axis=0) - limit) & (low <= origins.max(axis=0) + limit)
            around = np.flatnonzero(near.all(axis=1))
            if not 0 < len(left) * len(around) <= tuning.RAYS_TIMES_SEGMENTS:
                continue
            bx, by = (ends[around, k] - origins[left, k, None] for k in (0, 1))
            dx, dy = (ends[around, k + 2] - ends[around, k] for k in (0, 1))
            rx, ry = rays[left, 0, None], rays[left, 1, None]
            with np.errstate(divide="ignore", invalid="ignore"):
                slant = rx * dy - ry * dx
                reach, along = (bx * dy - by * dx) / slant, (bx * ry - by * rx) / slant
                reach = np.where((reach > 0.0) & (reach <= limit) & (along >= 0.0) & (along <= 1.0), reach, np.inf)
            first = reach.argmin(axis=1)
            row = np.arange(len(left))
            found.reach[left], found.segments[left] = reach[row, first], around[first]
            found.fronts[left] = slant[row, first] > 0.0
        return found


def look_from_walls(index: MapIndex, both_ways: Flags, deadline: Deadline) -> Sides:
    """Follow rays from both sides of the longest walls of a directed map, as many as the deadline allows.

    Of walls that are drawn `both_ways`, (walls,) flags, none is right or wrong. No rays start from them, and a hit on
    one is no evidence.
    """
    lengths, segments = index.walls.longest, index.segments.shifted(-index.origin)
    most = min(tuning.MOST_LOOKED_FROM, tuning.WALLS_TIMES_SEGMENTS // len(segments))
    longest = np.argsort(-lengths, kind="stable")[:most]
    chosen = longest[(lengths[longest] >= tuning.SHORTEST_LOOKED_FROM) & ~both_ways[longest]]
    ends, both = segments.endpoints, np.array([1.0, -1.0])[:, None, None, None]
    low, high = np.minimum(ends[:, :2], ends[:, 2:]), np.maximum(ends[:, :2], ends[:, 2:])
    lowest, highest = low.min(axis=0), high.max(axis=0)
    turns, places = np.array(tuning.TURNS)[:, None], np.array(tuning.PLACES_ON_A_WALL)[:, None]
    counts, room, lost = np.zeros((len(chosen), 2, 2)), np.full((len(chosen), 2), np.inf), np.zeros(len(chosen), bool)
    done = 0
    for k, piece in enumerate(longest_pieces(index)[chosen].tolist()):
        if deadline.passed:
            break
        normal, direction = segments.normals[piece], segments.directions[piece]
        starts = ends[piece, :2] + places * segments.lengths[piece] * direction
        rays = both * (np.cos(turns) * normal + np.sin(turns) * direction) + np.zeros((2, len(places), 1, 1))
        origins = starts[:, None] + tuning.OFF_THE_WALL * both * normal + np.zeros_like(rays)
        met = _Hits.of(ends, low, high, origins.reshape(-1, 2), rays.reshape(-1, 2))
        told = (met.reach > tuning.TOO_NEAR) & np.isfinite(met.reach) & ~both_ways[index.wall_of_piece[met.segments]]
        counts[k] = np.stack([told & met.fronts, told & ~met.fronts], axis=1).reshape(2, -1, 2).sum(axis=1)
        room[k] = np.where(told, met.reach, np.inf).reshape(2, -1).min(axis=1)
        stops = (origins + tuning.FOLLOWED * rays)[0][np.isinf(met.reach).reshape(rays.shape[:3])[0]]
        lost[k] = ((stops >= lowest) & (stops <= highest)).all(axis=1).any()
        done = k + 1
    return Sides(chosen[:done], lengths[chosen[:done]], counts[:done], room[:done], lost[:done])


def direction_findings(index: MapIndex, sides: Sides) -> Iterator[Finding]:
    """List the findings about the directions of segments."""
    wrong = sides.against.all(axis=1)
    if sides.reversed:
        yield Finding(
            "reversed",
            "Free space seems to lie on the right of the segments, or outside of the drawing; expected on their left. "
            "Exchange begin and end of every segment.",
        )
    elif sides.meaningless:
        yield Finding(
            "mixed_directions",
            f"Directions contradict one another: {100.0 * sides.contradiction:.0f} % of the rays between segments "
            "start on a left side and end on a right side, or the reverse. If the lines are centre lines of walls, or "
            'have no directions, set "oriented": false.',
            segments_of(index, sides.walls[sides.against.any(axis=1)]),
        )
    elif wrong.any():
        found = segments_of(index, sides.walls[wrong])
        yield Finding(
            "mixed_directions",
            f"{len(found)} segments seem to have begin and end exchanged: most rays from their left meet the right "
            "side of other segments. Free space must lie on the left. Exchange their ends.",
            found,
        )
