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

from .pieces import Flags, Indices, longest_pieces, segments_of
from .result import Finding
from .tuning import (
    CONTRADICTED,
    DOUBLE,
    FOLLOWED,
    MEANINGLESS,
    MOST,
    MOST_LOOKED_FROM,
    NEAR_FOLLOWED,
    OFF_THE_WALL,
    PLACES_ON_A_WALL,
    RAYS_TIMES_SEGMENTS,
    SHORTEST_LOOKED_FROM,
    TOO_NEAR,
    TURNS,
    WALLS_TIMES_SEGMENTS,
)


@dataclass(frozen=True, slots=True)
class Sides:
    """Hits of the rays from walls.

    Attributes
    ----------
    walls : (k,) indices of the walls that were looked from
    lengths : (k,) metres
    left, right : (k, 2) how many rays met a front, and how many a back, on either side
    room : (k, 2) distance of the nearest wall on the left, and on the right, metres; inf where there is none
    lost : (k,) True where a ray on the left ended within the map without a hit: its hit is not known
    """

    walls: Indices
    lengths: Floats
    left: Floats
    right: Floats
    room: Floats
    lost: Flags

    @property
    def meaningless(self) -> bool:
        """Return whether rays meet fronts and backs about as often, on whatever side of a wall they start."""
        return self.contradiction >= MEANINGLESS and not self.reversed

    @property
    def contradiction(self) -> float:
        """The fraction of rays that meet what they should not, by length and the mean of both sides, 0 to 1."""
        shares = []
        for counts, against in ((self.left, 1), (self.right, 0)):
            met = float((counts.sum(axis=1) * self.lengths).sum())
            shares.append(float((counts[:, against] * self.lengths).sum()) / met if met > 0.0 else 0.0)
        return 0.5 * sum(shares)

    @property
    def reversed(self) -> bool:
        """Return whether the whole map is the wrong way round: free space is outside it, or no wider than a wall."""
        outside = (self.left.sum(axis=1) == 0.0) & (self.right.sum(axis=1) > 0.0) & ~self.lost
        within = (self.room[:, 0] < DOUBLE) & (self.room[:, 1] > 2.0 * DOUBLE)
        return self.share((self.against_left & self.against_right) | outside | within) >= MOST

    @property
    def against_left(self) -> Flags:
        """The walls for which most rays from the side that should be free meet backs, (k,) flags."""
        found: Flags = self.left[:, 1] > CONTRADICTED * self.left.sum(axis=1)
        return found

    @property
    def against_right(self) -> Flags:
        """The walls for which most rays from the side that should not be free meet fronts, (k,) flags."""
        found: Flags = self.right[:, 0] > CONTRADICTED * self.right.sum(axis=1)
        return found

    def share(self, which: Flags) -> float:
        """Return how much of the length some of the walls have, 0 to 1."""
        return float(self.lengths[which].sum() / self.lengths.sum()) if len(self.lengths) else 0.0


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
        for limit in (*NEAR_FOLLOWED, FOLLOWED):
            left = np.flatnonzero(np.isinf(found.reach))
            near = (high >= origins.min(axis=0) - limit) & (low <= origins.max(axis=0) + limit)
            around = np.flatnonzero(near.all(axis=1))
            if not 0 < len(left) * len(around) <= RAYS_TIMES_SEGMENTS:
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
    longest = np.argsort(-lengths, kind="stable")[: min(MOST_LOOKED_FROM, WALLS_TIMES_SEGMENTS // len(segments))]
    chosen = longest[(lengths[longest] >= SHORTEST_LOOKED_FROM) & ~both_ways[longest]]
    ends, left_and_right = segments.endpoints, np.array([1.0, -1.0])[:, None, None, None]
    low, high = np.minimum(ends[:, :2], ends[:, 2:]), np.maximum(ends[:, :2], ends[:, 2:])
    lowest, highest = low.min(axis=0), high.max(axis=0)
    along_normal, along_wall, places = np.cos(TURNS)[:, None], np.sin(TURNS)[:, None], np.array(PLACES_ON_A_WALL)
    counts, room, lost = np.zeros((len(chosen), 2, 2)), np.full((len(chosen), 2), np.inf), np.zeros(len(chosen), bool)
    done = 0
    for k, piece in enumerate(longest_pieces(index)[chosen].tolist()):
        if deadline.passed:
            break
        normal, direction = segments.normals[piece], segments.directions[piece]
        starts = ends[piece, :2] + places[:, None] * segments.lengths[piece] * direction
        origins = np.zeros((2, len(places), len(TURNS), 2)) + starts[:, None] + OFF_THE_WALL * left_and_right * normal
        rays = np.zeros_like(origins) + left_and_right * (along_normal * normal + along_wall * direction)
        hits = _Hits.of(ends, low, high, origins.reshape(-1, 2), rays.reshape(-1, 2))
        told = (hits.reach > TOO_NEAR) & np.isfinite(hits.reach) & ~both_ways[index.wall_of_piece[hits.segments]]
        counts[k] = np.stack([told & hits.fronts, told & ~hits.fronts], axis=1).reshape(2, -1, 2).sum(axis=1)
        room[k] = np.where(told, hits.reach, np.inf).reshape(2, -1).min(axis=1)
        stops = (origins + FOLLOWED * rays)[0].reshape(-1, 2)[np.isinf(hits.reach[: len(places) * len(TURNS)])]
        lost[k] = ((stops >= lowest) & (stops <= highest)).all(axis=1).any()
        done = k + 1
    return Sides(chosen[:done], lengths[chosen[:done]], counts[:done, 0], counts[:done, 1], room[:done], lost[:done])


def direction_findings(index: MapIndex, sides: Sides) -> Iterator[Finding]:
    """List the findings about the directions of segments."""
    wrong = sides.against_left & sides.against_right
    if sides.reversed:
        yield Finding(
            "reversed",
            "Free space seems to lie on the right of the segments, or outside of the drawing; expected on their left. "
            "Exchange begin and end of every segment.",
        )
    elif sides.meaningless:
        either = sides.against_left | sides.against_right
        yield Finding(
            "mixed_directions",
            f"Directions contradict one another: {100.0 * sides.contradiction:.0f} % of the rays between segments "
            "start on a left side and end on a right side, or the reverse. If the lines are centre lines of walls, or "
            'have no directions, set "oriented": false.',
            segments_of(index, sides.walls[either]),
        )
    elif wrong.any():
        found = segments_of(index, sides.walls[wrong])
        yield Finding(
            "mixed_directions",
            f"{len(found)} segments seem to have begin and end exchanged: most rays from their left meet the right "
            "side of other segments. Free space must lie on the left. Exchange their ends.",
            found,
        )
