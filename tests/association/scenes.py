"""Rooms and floors with known answers, and what a laser measures in them.

`seen` cuts pieces out of walls without occlusion. `ranges` casts rays, with noise, bias and rotation of the sensor.
"""

from __future__ import annotations

import json
import math
import tracemalloc
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from association import (
    AssociationOptions,
    AssociationResult,
    Beams,
    Deadline,
    MapIndex,
    Prior,
    Scan,
    View,
    assemble,
    associate,
)
from registration import MeasuredSegments, RigidTransform, Segments
from vectorization import LaserScan, Motion, vectorize

T = TypeVar("T")
Floats = NDArray[np.float64]
Truth = NDArray[np.intp]

# An L-shaped room with a niche: no rotation or shift of it looks like itself.
ROOM = np.array(
    [
        [0.0, 0.0, 9.0, 0.0],
        [9.0, 0.0, 9.0, 4.0],
        [9.0, 4.0, 5.0, 4.0],
        [5.0, 4.0, 5.0, 7.0],
        [5.0, 7.0, 2.0, 7.0],
        [2.0, 7.0, 2.0, 5.5],
        [2.0, 5.5, 0.0, 5.5],
        [0.0, 5.5, 0.0, 0.0],
    ]
)
LOBBY = np.array([[0, 0, 8, 0], [8, 0, 8, 3], [8, 3, 5, 3], [5, 3, 5, 6], [5, 6, 0, 6], [0, 6, 0, 0]], dtype=float)
SQUARE = np.array([[0, 0, 5, 0], [5, 0, 5, 5], [5, 5, 0, 5], [0, 5, 0, 0]], dtype=float)
CORRIDOR = np.array([[0, 0, 30, 0], [30, 2, 0, 2]], dtype=float)

BEAMS = 360
REACH = 20.0  # m
PERIOD = 0.1  # s, of one scan
NOISE = 0.01  # m


@contextmanager
def allocates_less_than(count: float) -> Iterator[None]:
    """Fail where the block holds this many bytes at a time."""
    tracemalloc.start()
    try:
        yield
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < count


def pose(x: float = 0.0, y: float = 0.0, theta: float = 0.0) -> RigidTransform:
    return RigidTransform(x, y, theta)


INSIDE = pose(3.0, 2.5, 0.7)  # of ROOM and of LOBBY


def maze(seed: int, n: int = 60, size: float = 30.0) -> Floats:
    """Draw n walls along two directions, in no order that repeats."""
    rng = np.random.default_rng(seed)
    begins = rng.uniform(0.0, size, (n, 2))
    lengths = rng.uniform(0.8, 6.0, n)
    turns = rng.integers(0, 4, n) * (math.pi / 2)
    ends = begins + lengths[:, None] * np.stack([np.cos(turns), np.sin(turns)], axis=1)
    return np.hstack([begins, ends])


def ring(corners: ArrayLike) -> Floats:
    """Return the walls of an outline; counter-clockwise corners have the free space inside."""
    points = np.asarray(corners, dtype=float)
    return np.hstack([points, np.roll(points, -1, axis=0)])


def box(x: float, y: float, width: float, height: float) -> Floats:
    """Return the walls of a thing that stands in a room, free space around it."""
    return ring([(x, y), (x, y + height), (x + width, y + height), (x + width, y)])


def drawn_room(rng: np.random.Generator) -> tuple[Floats, RigidTransform]:
    """Draw a room with corners cut out, a pillar, and a pose in it from which most of it is seen."""
    w, h = rng.uniform(6.0, 12.0), rng.uniform(5.0, 9.0)
    a, b, c, d = rng.uniform(0.15, 0.35, 4) * w
    e, f, g, i = rng.uniform(0.1, 0.3, 4) * h
    corners = [(a, 0), (w - b, 0), (w - b, e), (w, e), (w, h - f), (w - c, h - f), (w - c, h), (d, h), (d, h - g)]
    corners += [(0, h - g), (0, i), (a, i)]
    pillar = box(rng.uniform(0.55, 0.6) * w, rng.uniform(0.45, 0.55) * h, *rng.uniform(0.3, 0.6, 2))
    at = pose(rng.uniform(0.38, 0.5) * w, rng.uniform(0.38, 0.6) * h, rng.uniform(-math.pi, math.pi))
    return np.vstack([ring(corners), pillar]), at


def side_by_side(room: ArrayLike, count: int, pitch: float = 12.0) -> Floats:
    """Return a room, and the same again every `pitch` metres to the right."""
    return np.vstack([np.asarray(room, dtype=float) + np.tile([pitch * k, 0.0], 2) for k in range(count)])


def equal_rooms(count: int) -> Floats:
    return side_by_side(ROOM, count)


def carried(ends: ArrayLike, by: RigidTransform) -> Floats:
    """Return endpoints (n, 4) in another frame."""
    return np.asarray(by.apply(np.asarray(ends, dtype=float).reshape(-1, 2, 2)).reshape(-1, 4))


def seen(
    walls: ArrayLike,
    at: RigidTransform,
    *,
    noise: float = 0.0,
    cut: float = 0.0,
    clutter: int = 0,
    seed: int = 0,
    radius: float = math.inf,
) -> tuple[Floats, Truth]:
    """Return (endpoints in the scan frame, truth), truth the wall of each segment or -1 for clutter.

    Of every wall within `radius` of the pose a fraction from ``1 - cut`` to 1 is seen.
    """
    rng = np.random.default_rng(seed)
    ends = np.asarray(walls, dtype=float)
    middle = 0.5 * (ends[:, :2] + ends[:, 2:])
    near = np.nonzero(np.hypot(middle[:, 0] - at.x, middle[:, 1] - at.y) <= radius)[0]
    pieces = []
    for i in near:
        fraction = 1.0 - cut * rng.random()
        start = (1.0 - fraction) * rng.random()
        a, d = ends[i, :2], ends[i, 2:] - ends[i, :2]
        n = np.array([-d[1], d[0]]) / np.hypot(*d)
        offsets = noise * rng.normal(size=2)
        pieces.append([*(a + start * d + offsets[0] * n), *(a + (start + fraction) * d + offsets[1] * n)])
    for _ in range(clutter):
        begin = np.array([at.x, at.y]) + rng.uniform(-6.0, 6.0, 2)
        turn = rng.uniform(-math.pi, math.pi)
        pieces.append([*begin, *(begin + rng.uniform(0.5, 2.0) * np.array([math.cos(turn), math.sin(turn)]))])
    truth = np.concatenate([near, np.full(clutter, -1)])
    order = rng.permutation(len(pieces))
    return carried(pieces, at.inverse())[order], truth[order]


def cast(walls: ArrayLike, origin: Floats, headings: Floats) -> Floats:
    """Return how far each ray from a place goes before it meets a wall, (m,); inf where it meets none."""
    ends = np.asarray(walls, dtype=float)
    a, e = ends[:, :2] - origin, ends[:, 2:] - ends[:, :2]
    dx, dy = np.cos(headings)[:, None], np.sin(headings)[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        det = dy * e[:, 0] - dx * e[:, 1]
        along = (a[:, 1] * e[:, 0] - a[:, 0] * e[:, 1]) / det
        on = (a[:, 1] * dx - a[:, 0] * dy) / det
    met = (along > 1e-9) & (on >= 0.0) & (on <= 1.0)
    return np.asarray(np.where(met, along, math.inf).min(axis=1))


@dataclass(frozen=True)
class Turning:
    """Rotation of a sensor during a scan, rad/s, which the scan states or does not."""

    rate: float = 0.0
    stated: bool = False


def ranges(
    walls: ArrayLike,
    at: RigidTransform,
    seed: int = 0,
    *,
    sigma: float = NOISE,
    bias: float = 0.0,
    turning: Turning = Turning(),
    reach: float = REACH,
    beams: int = BEAMS,
) -> Scan:
    """Return the scan, with its beams, of a laser that reads all around from `at`, where it is at the first beam."""
    rng, step = np.random.default_rng(seed), math.tau / beams
    angles, times = -math.pi + step * np.arange(beams), PERIOD / beams * np.arange(beams)
    read = cast(walls, np.array([at.x, at.y]), at.theta + turning.rate * times + angles)
    read = read + bias + rng.normal(0.0, sigma, beams)
    read[read > reach] = math.inf
    motion = Motion(PERIOD / beams, 0.0, 0.0, turning.rate) if turning.stated else None
    found = vectorize(LaserScan(-math.pi, step, read, 0.05, reach, motion))
    return Scan(found.measured, found.viewpoint, found.beams, sweep_s=0.0 if turning.stated else PERIOD)


def without_beams(scan: Scan) -> Scan:
    return Scan(scan.measured, scan.viewpoint)


def in_frame(scan: Scan, mount: RigidTransform) -> Scan:
    """Return the same data in a frame in which the sensor's frame is at `mount`."""
    one = scan.measured
    ends = Segments.from_array(carried(one.segments.endpoints, mount))
    moments = (mount.apply(one.centroids), one.spreads)
    points = one.point_counts if one.counted else None
    viewpoint = scan.viewpoint
    there = None if viewpoint is None else tuple(mount.apply(np.array(viewpoint)).tolist())
    beams = None if scan.beams is None else scan.beams.moved(mount, viewpoint or (0.0, 0.0))
    return Scan(MeasuredSegments.from_segments(ends, one.sigma, points, moments), there, beams, sweep_s=scan.sweep_s)


def mounted(scan: Scan, mount: RigidTransform) -> Scan:
    """Return the same data as an exact view of a sensor at `mount`."""
    return assemble([View(scan, mount)])


def index_of(endpoints: Any, sigma: float | None = None, **others: Any) -> MapIndex:
    return MapIndex.build(Segments.from_array(endpoints), sigma, **others)


def scan_of(
    endpoints: Any, sigma: float = 0.02, viewpoint: tuple[float, float] | None = None, beams: Beams | None = None
) -> Scan:
    """Wrap scan-frame endpoints; by default not seen from one place, since `seen` lets every wall be seen."""
    return Scan(MeasuredSegments.from_segments(Segments.from_array(endpoints), sigma), viewpoint, beams)


def answer_of(
    index: MapIndex, scan: Scan, prior: Prior | None = None, deadline: Deadline | None = None, **options: Any
) -> AssociationResult:
    """Search under the options that are named."""
    return associate(index, scan, prior, AssociationOptions(**options), deadline)


def known(value: T | None) -> T:
    """Return what an answer must have."""
    assert value is not None
    return value


def same_pose(
    one: RigidTransform | None, other: RigidTransform | None, distance: float = 0.1, angle: float = 0.0175
) -> bool:
    a, b = known(one), known(other)
    turn = math.remainder(a.theta - b.theta, math.tau)
    return math.hypot(a.x - b.x, a.y - b.y) <= distance and abs(turn) <= angle


def is_wrong(result: AssociationResult, truth: RigidTransform) -> bool:
    """Return whether an answer is usable and more than 0.3 m or 3 degrees off."""
    return result.usable and not same_pose(result.pose, truth, 0.3, math.radians(3.0))


def as_json(result: AssociationResult) -> str:
    return json.dumps(asdict(result), default=lambda array: array.tolist())


def squared_error(result: AssociationResult, truth: RigidTransform) -> float:
    """Return the squared error of an answer's pose, normalized by its covariance: a chi-square of three."""
    found = known(result.pose)
    error = np.array([found.x - truth.x, found.y - truth.y, math.remainder(found.theta - truth.theta, math.tau)])
    return float(error @ np.linalg.solve(known(result.covariance), error))


def warning_codes(result: AssociationResult) -> list[str]:
    return [warning.code for warning in result.warnings]


def reason_codes(result: AssociationResult) -> list[str]:
    return [reason.code for reason in result.reasons]


# Two rooms of which one wall differs by 10 cm.
UNLIKE_ROOMS = equal_rooms(2)
UNLIKE_ROOMS[12, [1, 3]] += 0.1


def drawn(seed: int) -> tuple[Floats, Scan]:
    """Draw a map, and a scan of it: as ranges, as segments of ranges, or as pieces of walls among clutter."""
    rng = np.random.default_rng(seed)
    kind = seed % 6
    if kind < 4:
        room, at = drawn_room(rng)
        found = ranges(room, at, seed, bias=0.02 * (kind == 1), turning=Turning(0.8 * (kind == 2)))
        walls = room + np.tile(rng.normal(0.0, 0.02, (len(room), 2)), 2) if kind == 3 else room
        return walls, found if seed % 12 < 6 else without_beams(found)
    return pieces_of(seed)


def pieces_of(seed: int) -> tuple[Floats, Scan]:
    """Draw a map and pieces of its walls among clutter: of a room, of one of two, of a corridor, of a maze."""
    walls, ends = ends_of(seed)
    return walls, scan_of(ends)


def ends_of(seed: int) -> tuple[Floats, Floats]:
    rng = np.random.default_rng(seed)
    kind, clutter = seed % 5, int(rng.integers(0, 5))
    if kind < 2:
        return (ROOM, UNLIKE_ROOMS)[kind], seen(ROOM, INSIDE, noise=0.02, cut=0.5, clutter=clutter, seed=seed)[0]
    if kind == 2:
        return CORRIDOR, seen(CORRIDOR, pose(4.0, 0.8, 0.05), noise=0.01, cut=0.5, seed=seed)[0]
    x, y, theta = (*rng.uniform(10.0, 20.0, 2), rng.uniform(-3.0, 3.0))
    at = pose(x, y, theta)
    return maze(1), seen(maze(1), at, noise=0.02, cut=0.5, clutter=clutter, seed=seed, radius=8.0)[0]
