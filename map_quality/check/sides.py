"""Consistency of a map's directions: free space lies on the left of every segment that a ray meets.

A ray that leaves a wall on its left goes through free space, and should meet the next one on its left, too. If it meets
a back, one of the two is drawn the wrong way round. To the right of a wall is its material: a ray there should meet
nothing, or the back of the wall's other face.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from association import Deadline, MapIndex
from registration import RigidTransform, Segments
from registration.layout import Floats
from simulation import Scanner, scan

from ..views import in_time
from . import tuning
from .pieces import Flags, Indices, longest_pieces, segments_of
from .result import Finding

FAN = Scanner(tuning.RAYS_FROM_A_PLACE, *tuning.FAN, range_max=tuning.FOLLOWED, sigma=0.0)


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


def look_from_walls(index: MapIndex, both_ways: Flags, deadline: Deadline) -> Sides:
    """Follow rays from both sides of the longest walls of a directed map, as many as the deadline allows.

    Of walls that are drawn `both_ways`, (walls,) flags, none is right or wrong. No rays start from them, and a hit on
    one is no evidence.
    """
    lengths, segments = index.walls.longest, index.segments.shifted(-index.origin)
    most = min(tuning.MOST_LOOKED_FROM, tuning.WALLS_TIMES_SEGMENTS // len(segments))
    longest = np.argsort(-lengths, kind="stable")[:most]
    chosen = longest[(lengths[longest] >= tuning.SHORTEST_LOOKED_FROM) & ~both_ways[longest]]
    corners = segments.endpoints.reshape(-1, 2)
    lowest, highest = corners.min(axis=0), corners.max(axis=0)
    counts, room, lost = np.zeros((len(chosen), 2, 2)), np.full((len(chosen), 2), np.inf), np.zeros(len(chosen), bool)
    done = 0
    for piece in in_time(longest_pieces(index)[chosen].tolist(), deadline):
        near = _around(segments, piece)
        walls = segments.take(near)
        for side, pose in _places(segments, piece):
            met = scan(walls, pose, FAN)
            told = met.hits >= 0
            told[told] = ~both_ways[index.wall_of_piece[near[met.hits[told]]]]
            told &= met.true_ranges > tuning.TOO_NEAR
            counts[done, side] += (told & met.facing).sum(), (told & ~met.facing).sum()
            room[done, side] = met.true_ranges.min(where=told, initial=room[done, side])
            if side == 0:
                angles = FAN.angles[met.hits < 0] + pose.theta
                stops = tuning.FOLLOWED * np.column_stack([np.cos(angles), np.sin(angles)]) + [pose.x, pose.y]
                lost[done] |= ((stops >= lowest) & (stops <= highest)).all(axis=1).any()
        done += 1
    return Sides(chosen[:done], lengths[chosen[:done]], counts[:done], room[:done], lost[:done])


def _around(segments: Segments, piece: int) -> Indices:
    """Return the segments that rays from a segment may meet."""
    ends = segments.endpoints
    low, high = np.minimum(ends[:, :2], ends[:, 2:]), np.maximum(ends[:, :2], ends[:, 2:])
    near = (high >= low[piece] - tuning.FOLLOWED) & (low <= high[piece] + tuning.FOLLOWED)
    return np.flatnonzero(near.all(axis=1))


def _places(segments: Segments, piece: int) -> Iterator[tuple[int, RigidTransform]]:
    """Yield places a little to the left (0) and to the right (1) of a segment, that look away from it."""
    begin, normal = segments.endpoints[piece, :2], segments.normals[piece]
    for side, away in enumerate((normal, -normal)):
        for share in tuning.PLACES_ON_A_WALL:
            x, y = begin + share * segments.lengths[piece] * segments.directions[piece] + tuning.OFF_THE_WALL * away
            yield side, RigidTransform(float(x), float(y), math.atan2(away[1], away[0]))


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
            tuple(sorted(segments_of(index, sides.walls[sides.against.any(axis=1)]))),
        )
    elif wrong.any():
        found = segments_of(index, sides.walls[wrong])
        yield Finding(
            "mixed_directions",
            f"{len(found)} segments seem to have begin and end exchanged: most rays from their left meet the right "
            "side of other segments. Free space must lie on the left. Exchange their ends.",
            tuple(sorted(found)),
        )
