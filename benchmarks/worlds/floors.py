"""Buildings of several floors: outer walls, stairs, shafts and columns are the same on each, the rooms are not."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from registration import Segments

Floats = NDArray[np.float64]
Box = tuple[float, float, float, float]  # min_x, min_y, max_x, max_y; metres


@dataclass(frozen=True, slots=True)
class FloorKind:
    """A kind of building; lengths in metres.

    Attributes
    ----------
    size : (float, float)
        Of the outer walls.
    corridor : float
        Width of the corridor along the middle.
    module : float
        Partitions stand on multiples of it, as on the axes of a façade.
    rooms : (int, int)
        Width of a room in modules, at least and at most.
    open_fraction : float
        Probability that the wall between two rooms is left out.
    wall : float
        Thickness of a partition.
    column : float
        Side of a column; 0: none.
    """

    size: tuple[float, float]
    corridor: float
    module: float
    rooms: tuple[int, int]
    open_fraction: float
    wall: float
    column: float


FLOOR_KINDS: Mapping[str, FloorKind] = {
    "offices": FloorKind((48.0, 15.0), 1.9, 1.35, (2, 5), 0.1, 0.12, 0.0),
    "wards": FloorKind((54.0, 18.0), 2.6, 1.5, (2, 4), 0.05, 0.15, 0.0),
    "flats": FloorKind((36.0, 14.0), 1.5, 1.0, (3, 7), 0.0, 0.2, 0.0),
    "laboratories": FloorKind((42.0, 19.0), 2.2, 1.8, (2, 6), 0.2, 0.12, 0.4),
    "open plan": FloorKind((40.0, 21.0), 2.4, 2.7, (2, 5), 0.5, 0.1, 0.5),
}
DOOR = 0.95  # m
STAIRS, SHAFT = (2.6, 5.2), (1.6, 1.8)  # m; along and across the corridor


def draw_floors(kind: FloorKind, count: int, rng: np.random.Generator) -> list[Segments]:
    """Draw the floors of one building.

    Parameters
    ----------
    kind : FloorKind
    count : int
        Number of floors, at least 1.
    rng : Generator

    Returns
    -------
    list of Segments
        Free space on the left of each; all in the building's frame.
    """
    width, depth = kind.size
    first, second = sorted(rng.uniform(0.12, 0.88, 2) * width)
    low = 0.5 * (depth - kind.corridor)
    cores = [
        _core(first, low - STAIRS[1], STAIRS, width),
        _core(max(second, first + 2.0 * STAIRS[0]), low - SHAFT[1], SHAFT, width),
        _core(rng.uniform(0.1, 0.9) * width, low + kind.corridor, SHAFT, width),
    ]
    return [_floor(kind, cores, rng) for _ in range(count)]


def _core(x: float, y: float, size: tuple[float, float], width: float) -> Box:
    left = min(max(0.5, x), width - size[0] - 0.5)
    return left, y, left + size[0], y + size[1]


def _floor(kind: FloorKind, cores: list[Box], rng: np.random.Generator) -> Segments:
    width, depth = kind.size
    low, high = 0.5 * (depth - kind.corridor), 0.5 * (depth + kind.corridor)
    rows = [_inside((0.0, 0.0, width, depth)), *(_around(core) for core in cores)]
    for bottom, top, face in ((0.0, low, low), (high, depth, high)):
        places = _partitions(kind, [core for core in cores if core[1] < top and core[3] > bottom], rng)
        half = 0.5 * kind.wall
        closed = [x for x in places[1:-1] if rng.random() >= kind.open_fraction]
        rows += [_around((x - half, bottom, x + half, top)) for x in closed]
        outer = face - kind.wall if face == low else face
        for left, right in pairwise(places):
            rows += _with_door(left, right, (outer, outer + kind.wall), rng)
    if kind.column:
        half = 0.5 * kind.column
        for x in np.arange(4.0 * kind.module, width - 2.0, 4.0 * kind.module):
            rows += [_around((x - half, y - half, x + half, y + half)) for y in (0.25 * depth, 0.75 * depth)]
    return Segments.from_array(np.concatenate(rows))


def _partitions(kind: FloorKind, cores: list[Box], rng: np.random.Generator) -> list[float]:
    """Return where rooms end along the corridor, on the module; none of them within a core."""
    width, places = kind.size[0], [0.0]
    while width - places[-1] > (kind.rooms[1] + 1) * kind.module:
        x = places[-1] + kind.module * int(rng.integers(kind.rooms[0], kind.rooms[1] + 1))
        while any(core[0] - kind.wall <= x <= core[2] + kind.wall for core in cores):
            x += kind.module
        places.append(x)
    return [*[x for x in places if x < width - kind.module], width]


def _with_door(left: float, right: float, faces: tuple[float, float], rng: np.random.Generator) -> list[Floats]:
    """Return the wall between a room and the corridor, with a door somewhere in it."""
    door = left + rng.uniform(0.2, max(0.25, right - left - DOOR - 0.2))
    ends = ((left, door), (door + DOOR, right))
    return [_around((a, faces[0], b, faces[1])) for a, b in ends if b - a > 0.05]


def _around(box: Box) -> Floats:
    """Return the faces of a solid box: free space is outside."""
    x1, y1, x2, y2 = box
    return np.array([[x1, y1, x1, y2], [x1, y2, x2, y2], [x2, y2, x2, y1], [x2, y1, x1, y1]])


def _inside(box: Box) -> Floats:
    """Return the faces of a hollow box: free space is inside."""
    return np.asarray(_around(box)[:, [2, 3, 0, 1]])


def free_places(floor: Segments, kind: FloorKind, count: int, rng: np.random.Generator) -> list[tuple[float, float]]:
    """Draw places with 0.45 m of room around them, half of them in the corridor, (x, y) metres."""
    width, depth = kind.size
    places: list[tuple[float, float]] = []
    while len(places) < count:
        x, y = rng.uniform(0.5, width - 0.5), rng.uniform(0.5, depth - 0.5)
        if len(places) % 2:
            y = 0.5 * depth + rng.uniform(-0.3, 0.3) * kind.corridor
        gaps, inside = _distances(floor, x, y)
        if inside and gaps >= 0.45:
            places.append((x, y))
    return places


def _distances(floor: Segments, x: float, y: float) -> tuple[float, bool]:
    """Return the distance to the nearest wall, and whether its free side is here."""
    p = np.array([x, y])
    along = np.clip(np.einsum("ij,ij->i", p - floor.endpoints[:, :2], floor.directions), 0.0, floor.lengths)
    gaps = np.linalg.norm(floor.endpoints[:, :2] + along[:, None] * floor.directions - p, axis=1)
    nearest = np.flatnonzero(gaps < gaps.min() + 1e-9)
    left = np.einsum("ij,ij->i", p - floor.endpoints[nearest, :2], floor.normals[nearest])
    return float(gaps.min()), bool(math.isfinite(gaps.min()) and left.max() > 0.0 and left.min() >= -1e-9)
