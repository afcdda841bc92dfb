"""Maps within the limits that are made to be slow, and by how much a search of them overruns its deadline.

``python -m benchmarks adversarial``
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping

import numpy as np

from association import AssociationOptions, Deadline, MapIndex, Scan, associate
from registration import Beams, MeasuredSegments, Segments

from .collection import SIGMA
from .table import Row, at_most, print_rows

DEADLINE = 1.0  # s
OVERRUN_MS = 50.0  # goal
SEED = 20190901
ROOM = np.array([[0, 0, 5, 0], [5, 0, 5, 4], [5, 4, 1, 4], [1, 4, 1, 3], [1, 3, 0, 3], [0, 3, 0, 0]], dtype=float)
INSIDE = (2.5, 1.5)
SCAN_SEGMENTS = 100
BEAMS = 720
REACH = 30.0  # m

Ends = np.ndarray[tuple[int, int], np.dtype[np.float64]]


def copies() -> Ends:
    """Return 10,000 copies of one room."""
    side = 100
    corners = 10.0 * np.stack(np.meshgrid(np.arange(side), np.arange(side)), axis=-1).reshape(-1, 1, 2)
    ends: Ends = (ROOM.reshape(1, -1, 2) + np.tile(corners, (1, 2 * len(ROOM), 1))).reshape(-1, 4)
    return ends


def parallel() -> Ends:
    """Return thousands of parallel walls of 10 m, 20 cm apart, and some across."""
    y = 0.2 * np.arange(5_000)
    x = 10.0 * np.arange(20)
    along = np.stack([np.zeros_like(y), y, np.full_like(y, 10.0), y], axis=1)
    across = np.stack([x, np.zeros_like(x), x, np.full_like(x, 10.0)], axis=1)
    return np.vstack([along, across])


def one_cell() -> Ends:
    """Return 10,000 walls of all directions within a metre."""
    rng = np.random.default_rng(SEED)
    middles, angles = rng.uniform(0.0, 1.0, (10_000, 2)), rng.uniform(-math.pi, math.pi, 10_000)
    half = 0.5 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return np.hstack([middles - half, middles + half])


def star() -> Ends:
    """Return 3,000 walls of 50 m that cross in one place."""
    angles = np.linspace(-math.pi, math.pi, 3_000, endpoint=False)
    tips = 25.0 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return np.hstack([-tips, tips])


def short_walls() -> Ends:
    """Return a grid of short walls, as a vectorizer makes of a noisy occupancy grid."""
    rng = np.random.default_rng(SEED)
    middles = np.stack(np.meshgrid(np.arange(35), np.arange(35)), axis=-1).reshape(-1, 2)[:1_223] * 0.5
    angles = 0.5 * math.pi * rng.integers(0, 4, len(middles))
    half = 0.15 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return np.hstack([middles - half, middles + half])


MAPS: Mapping[str, Callable[[], Ends]] = {
    "10,000 copies of one room": copies,
    "5,000 parallel walls": parallel,
    "10,000 walls in one cell": one_cell,
    "a star of 3,000 walls": star,
    "1,223 short walls": short_walls,
}


def adversarial(rounds: int) -> list[Row]:
    """Search each for many segments, without and with beams, under a deadline of a second; the best of some rounds.

    The elapsed time is measured: other work on the machine adds to it.
    """
    room = (ROOM.reshape(-1, 2) - INSIDE).reshape(-1, 4)
    associate(MapIndex.build(Segments.from_array(ROOM)), scan_of(room, with_beams=True))  # compiled
    rows = []
    for name, make in MAPS.items():
        ends = make()
        index = MapIndex.build(Segments.from_array(ends))
        for with_beams in (False, True):
            scan = scan_of(seen_of(ends), with_beams=with_beams)
            what = f"{name}, {'ranges' if with_beams else 'segments'}: past a deadline of {DEADLINE:g} s, ms"
            rows.append(at_most(what, 1e3 * min(overrun(index, scan) for _ in range(rounds)), None, OVERRUN_MS, ".0f"))
    print_rows("Maps that are made to be slow", rows)
    return rows


def seen_of(ends: Ends) -> Ends:
    """Return some segments of a map about a place in it, in a frame that is turned."""
    middles = 0.5 * (ends[:, :2] + ends[:, 2:])
    at = middles[len(middles) // 2] + [2.5, 1.5]
    near = ends[np.argsort(np.hypot(*(middles - at).T), kind="stable")[:SCAN_SEGMENTS]]
    c, s = math.cos(0.3), math.sin(0.3)
    turn = np.array([[c, -s], [s, c]])
    ends_seen: Ends = ((near.reshape(-1, 2) - at) @ turn).reshape(-1, 4)
    return ends_seen


def scan_of(ends: Ends, *, with_beams: bool) -> Scan:
    """Return segments as a scan, the beams of which read some metres each."""
    rng = np.random.default_rng(SEED)
    angles = np.linspace(-math.pi, math.pi, BEAMS, endpoint=False)
    beams = Beams(angles, rng.uniform(1.0, 8.0, BEAMS), REACH) if with_beams else None
    return Scan(MeasuredSegments.from_segments(Segments.from_array(ends), SIGMA), (0.0, 0.0), beams)


def overrun(index: MapIndex, scan: Scan) -> float:
    """Return by how many seconds a search goes on behind its deadline."""
    began = time.monotonic()
    associate(index, scan, None, AssociationOptions(), Deadline(began + DEADLINE))
    return max(0.0, time.monotonic() - began - DEADLINE)
