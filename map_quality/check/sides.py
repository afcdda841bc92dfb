"""Consistency of a map's directions: free space lies on the left of every segment that a ray meets.

A ray that leaves a wall on its left goes through free space, and should meet the next one on its left, too. If it meets
a back, one of the two is drawn the wrong way round. To the right of a wall is its material: a ray there should meet
nothing, or the back of the wall's other face.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from association import Deadline, MapIndex
from association.consensus.kernels.sight import first_hit
from association.layout import RAY, Flags
from registration.layout import Floats, Records

from .pieces import segments_of
from .result import Finding
from .tuning import (
    CONTRADICTED,
    DOUBLE,
    FOLLOWED,
    MEANINGLESS,
    MOST,
    MOST_LOOKED_FROM,
    OFF_THE_WALL,
    PLACES_ON_A_WALL,
    SHORTEST_LOOKED_FROM,
    TOO_NEAR,
    TURNS,
)


@dataclass(frozen=True, slots=True)
class Looker:
    """Follows single rays from places in the index frame, by the grid of the search: some 5 microseconds each.

    `simulation.scan` takes time for every segment of the map, whatever a ray meets; this needs 24 rays from each wall.
    """

    index: MapIndex
    _ray: Records = field(default_factory=lambda: np.zeros(1, RAY), repr=False)

    def first(self, x: float, y: float, angle: float, limit: float) -> tuple[float, int]:
        """Return how far away the first wall is along an angle, metres, and which; ``(limit, -1)`` where none is."""
        ray, place = self._ray[0], self.index.tables.place
        ray["x"], ray["y"], ray["limit"] = x, y, limit
        ray["dx"], ray["dy"] = math.cos(angle), math.sin(angle)
        reach, wall = first_hit(ray, place.walls, place.grid.starts, place.grid.items, place.grid.shape[0])
        return float(reach), int(wall)

    def is_within(self, x: float, y: float) -> bool:
        """Return whether a place lies in the box around the walls, as far as cells list them."""
        shape = self.index.tables.place.grid.shape[0]
        right, top = shape["columns"] * shape["cell"], shape["rows"] * shape["cell"]
        return bool(0.0 <= x - shape["x0"] <= right and 0.0 <= y - shape["y0"] <= top)

    def is_front(self, wall: int, angle: float) -> bool:
        """Return whether a ray along an angle meets a wall on its left, where free space is."""
        row = self.index.walls.rows[wall]
        return bool(row["dx"] * math.sin(angle) < row["dy"] * math.cos(angle))


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

    walls: np.ndarray[tuple[int], np.dtype[np.intp]]
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
    def against_left(self) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """The walls for which most rays from the side that should be free meet backs, (k,) flags."""
        found: np.ndarray[tuple[int], np.dtype[np.bool_]] = self.left[:, 1] > CONTRADICTED * self.left.sum(axis=1)
        return found

    @property
    def against_right(self) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """The walls for which most rays from the side that should not be free meet fronts, (k,) flags."""
        found: np.ndarray[tuple[int], np.dtype[np.bool_]] = self.right[:, 0] > CONTRADICTED * self.right.sum(axis=1)
        return found

    def share(self, which: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> float:
        """Return how much of the length some of the walls have, 0 to 1."""
        return float(self.lengths[which].sum() / self.lengths.sum()) if len(self.lengths) else 0.0


def look_from_walls(index: MapIndex, both_ways: Flags, deadline: Deadline) -> Sides:
    """Follow rays from both sides of the longest walls of a directed map, as many as the deadline allows.

    Of walls that are drawn `both_ways`, (walls,) flags, none is right or wrong. No rays start from them, and a hit on
    one is no evidence.
    """
    lengths = index.walls.longest
    longest = np.argsort(-lengths, kind="stable")[:MOST_LOOKED_FROM]
    chosen = longest[(lengths[longest] >= SHORTEST_LOOKED_FROM) & ~both_ways[longest]]
    left, right, room = np.zeros((len(chosen), 2)), np.zeros((len(chosen), 2)), np.full((len(chosen), 2), np.inf)
    lost = np.zeros(len(chosen), bool)
    looker, done = Looker(index), 0
    for k, wall in enumerate(chosen):
        if deadline.passed:
            break
        lost[k] = _look(looker, int(wall), both_ways, (left[k], right[k]), room[k])
        done = k + 1
    return Sides(chosen[:done], lengths[chosen[:done]], left[:done], right[:done], room[:done], lost[:done])


def _look(looker: Looker, wall: int, both_ways: Flags, counts: tuple[Floats, Floats], room: Floats) -> bool:
    """Count fronts and backs that rays from a wall meet on its left and on its right, and note how near they are.

    Returns whether a ray on the left met nothing as far as it was followed, and was still within the map.
    """
    lost = False
    row = looker.index.walls.rows[wall]
    normal = float(row["angle"]) + 0.5 * math.pi
    nx, ny = -float(row["dy"]), float(row["dx"])
    for share in PLACES_ON_A_WALL:
        along = float(row["begin"]) + share * float(row["end"] - row["begin"])
        x = float(row["dx"]) * along - float(row["dy"]) * float(row["offset"])
        y = float(row["dy"]) * along + float(row["dx"]) * float(row["offset"])
        for side, sign in enumerate((1.0, -1.0)):
            px, py = x + sign * OFF_THE_WALL * nx, y + sign * OFF_THE_WALL * ny
            for turn in TURNS:
                angle = normal + turn + (0.0 if sign > 0.0 else math.pi)
                reach, met = looker.first(px, py, angle, FOLLOWED)
                if met >= 0 and reach > TOO_NEAR and not both_ways[met]:
                    counts[side][0 if looker.is_front(met, angle) else 1] += 1.0
                    room[side] = min(room[side], reach)
                elif met < 0 and sign > 0.0:
                    lost = lost or looker.is_within(px + reach * math.cos(angle), py + reach * math.sin(angle))
    return lost


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
