"""Queries for the comparison: what is seen near a place of a drawn map, cut, noisy and among clutter; and floor plans.

A drawn query is a local map and no view from one place, so that lines of sight prove nothing: the segments nearest to a
place, some left out, others cut, every end moved by noise, and segments that are on no map in any direction among them.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from registration import RigidTransform, Segments
from simulation import OfficePlan, offices

from ..collection import LEVELS, SIGMA
from ..queries import floor_plans

Floats = NDArray[np.float64]

SIZES = (50, 200, 1000)
MAPS = 6  # different ones in a cell
SHORTEST = 0.3  # m; what is left of a segment is in the scan from this length on
LEFT_OUT = 0.3  # of the segments about a place
GUESS = (0.5, 10.0)  # m and degrees that a first guess is off
PLANS = {50: OfficePlan(rooms=3, corridors=1), 200: OfficePlan(rooms=4, corridors=3),
         1000: OfficePlan(rooms=12, corridors=5)}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Level:
    """The difficulty: a drawn query is.

    Attributes
    ----------
    name : str
    counts : (int, int)
        Least and greatest number of segments that are on the map, or of all when `whole`.
    outliers : float
        Share of the scan's segments that are on no map.
    sigma : float
        Metres; of every coordinate of every end.
    cut : (float, float) or None
        Least and greatest share of its length to which each segment is cut.
    whole : bool
        The unit of `counts`.
    """

    name: str
    counts: tuple[int, int]
    outliers: float
    sigma: float
    cut: tuple[float, float] | None
    whole: bool = False


DRAWN_LEVELS = (
    Level("standard", (20, 40), 0.3, 0.02, None, whole=True),
    Level("hard", (12, 20), 0.5, 0.03, (0.3, 0.8)),
    Level("extreme", (8, 12), 0.75, 0.03, (0.3, 0.8)),
)


@dataclass(frozen=True, slots=True)
class PeerQuery:
    """A scan and where it was taken.

    Attributes
    ----------
    map : Floats
        ``(n, 4)`` end points.
    scan : Floats
        ``(m, 4)`` end points in the scan's frame.
    on_map : NDArray
        ``(m,)`` the map segment that each is a part of, -1 for clutter; empty if unknown.
    pose, guess : RigidTransform
        The truth, and half a metre and ten degrees next to it.
    sigma : float
        Metres.
    one_place : bool
        True if it was seen from the origin of its frame; else its segments end where two points of that sigma lie.
    """

    map: Floats
    scan: Floats
    on_map: NDArray[np.int64]
    pose: RigidTransform
    guess: RigidTransform
    sigma: float
    one_place: bool


@dataclass(frozen=True, slots=True)
class Cell:
    """Queries of one kind, size and level."""

    kind: str
    size: int | None
    level: str
    queries: tuple[PeerQuery, ...]

    @property
    def name(self) -> str:
        """Its name in the tables."""
        return f"{self.kind}, {self.level}" if self.size is None else f"{self.kind}, {self.size:,}, {self.level}"


def polygons(size: int, rng: np.random.Generator) -> Floats:
    """Draw free-standing polygons of 3 to 8 sides and `size` sides in all; free space is outside of them."""
    side = math.sqrt(3.0 * size)
    placed: list[tuple[Floats, float]] = []
    pieces: list[Floats] = []
    left = size
    while left > 0:
        corners = left if left <= 8 else int(rng.integers(3, min(8, left - 3) + 1))
        radius = rng.uniform(0.7, 2.0)
        for _ in range(100):
            middle = rng.uniform(0.0, side, 2)
            if all(np.hypot(*(middle - m)) > radius + r + 0.3 for m, r in placed):
                break
        else:
            side *= 1.05
            continue
        angles = (np.arange(corners) + rng.uniform(-0.3, 0.3, corners)) * math.tau / corners + rng.uniform(0, math.tau)
        away = radius * rng.uniform(0.6, 1.0, corners)
        ring = middle + away[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        ring = ring[::-1]  # clockwise: outside is on the left
        pieces.append(np.hstack([ring, np.roll(ring, -1, axis=0)]))
        placed.append((middle, radius))
        left -= corners
    return np.vstack(pieces)


def office_floor(size: int, rng: np.random.Generator) -> Floats:
    """Draw an office floor of about `size` segments."""
    return offices(rng, PLANS[size]).segments.endpoints.copy()


KINDS: dict[str, Callable[[int, np.random.Generator], Floats]] = {"polygons": polygons, "offices": office_floor}


def draw_query(segments: Floats, level: Level, rng: np.random.Generator) -> PeerQuery:
    """Draw what is seen near a place; the place is next to a segment drawn from the map."""
    wanted = int(rng.integers(level.counts[0], level.counts[1] + 1))
    inliers = round(wanted * (1.0 - level.outliers)) if level.whole else wanted
    outliers = round(inliers * level.outliers / (1.0 - level.outliers))
    place = segments[rng.integers(len(segments))].reshape(2, 2).mean(axis=0) + rng.uniform(-1.0, 1.0, 2)
    parts, walls = _parts(segments, place, (inliers, level.cut), rng)
    reach = np.abs(parts.reshape(-1, 2) - place).max()
    lengths = rng.choice(np.hypot(*(parts[:, 2:] - parts[:, :2]).T), outliers)
    turns = rng.uniform(-math.pi, math.pi, outliers)
    middles = place + rng.uniform(-reach, reach, (outliers, 2))
    half = 0.5 * lengths[:, None] * np.stack([np.cos(turns), np.sin(turns)], axis=1)
    seen = np.vstack([parts, np.hstack([middles - half, middles + half])])
    pose = RigidTransform(float(place[0]), float(place[1]), rng.uniform(-math.pi, math.pi))
    scan = pose.inverse().apply(seen.reshape(-1, 2)).reshape(-1, 4) + rng.normal(0.0, level.sigma, seen.shape)
    order = rng.permutation(len(scan))
    on_map = np.concatenate([walls, np.full(outliers, -1)])[order]
    return PeerQuery(segments, scan[order], on_map, pose, beside(pose, rng), level.sigma, one_place=False)


def _parts(
    segments: Floats, place: Floats, amount: tuple[int, tuple[float, float] | None], rng: np.random.Generator
) -> tuple[Floats, NDArray[np.int64]]:
    """Return parts of the nearest segments, a few of these left out, and which segments they are of."""
    count, cut = amount
    lengths = np.hypot(*(segments[:, 2:] - segments[:, :2]).T)
    share = rng.uniform(*cut, len(segments)) if cut else np.ones(len(segments))
    start = rng.uniform(0.0, 1.0 - share)
    away = np.hypot(*(segments.reshape(-1, 2, 2).mean(axis=1) - place).T)
    near = np.argsort(away, kind="stable")
    near = near[(share * lengths)[near] >= SHORTEST]
    near = np.sort(rng.permutation(near[: math.ceil(count / (1.0 - LEFT_OUT))])[:count])
    begin, along = segments[near, :2], segments[near, 2:] - segments[near, :2]
    first, last = start[near, None], (start + share)[near, None]
    return np.hstack([begin + first * along, begin + last * along]), near


def beside(pose: RigidTransform, rng: np.random.Generator) -> RigidTransform:
    """Return a first guess: off by half a metre in any direction and ten degrees in either."""
    way, side = rng.uniform(-math.pi, math.pi), rng.choice([-1.0, 1.0])
    return RigidTransform(
        pose.x + GUESS[0] * math.cos(way), pose.y + GUESS[0] * math.sin(way), pose.theta + side * math.radians(GUESS[1])
    )


def drawn_cell(kind: str, size: int, level: Level, count: int, seed: int) -> Cell:
    """Draw the queries of a cell, on a few maps in turn."""
    rng = np.random.default_rng([seed, list(KINDS).index(kind), size, DRAWN_LEVELS.index(level)])
    maps = [KINDS[kind](size, rng) for _ in range(min(MAPS, count))]
    return Cell(kind, size, level.name, tuple(draw_query(maps[k % len(maps)], level, rng) for k in range(count)))


def plan_cells(count: int, seed: int) -> list[Cell]:
    """Return the floor plans' three levels of clutter with `count` queries each."""
    rng = np.random.default_rng(seed)
    collection = floor_plans(max(1, 300 // count))
    cells = []
    for level in LEVELS:
        chosen = [q for q in collection.queries if q.level == level][:count]
        found = tuple(
            PeerQuery(collection.maps[q.map].endpoints, q.segments.endpoints, np.zeros(0, np.int64), q.pose,
                      beside(q.pose, rng), SIGMA, one_place=True)
            for q in chosen
        )  # fmt: skip
        cells.append(Cell(collection.name, None, level, found))
    return cells


def all_cells(count: int, seed: int) -> list[Cell]:
    """Return every cell of the comparison with `count` queries each."""
    drawn = [drawn_cell(k, s, level, count, seed) for k in KINDS for s in SIZES for level in DRAWN_LEVELS]
    return [*drawn, *plan_cells(count, seed)]


def segments_of(endpoints: Floats) -> Segments:
    """Return validated segments of end points."""
    return Segments.from_array(endpoints)
