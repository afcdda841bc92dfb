"""Scans with known answers: pieces of a map's walls, moved to the sensor's frame, with noise and clutter."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from association import AssociationOptions, AssociationResult, Beams, Deadline, MapIndex, Prior, Scan, associate
from association.context import SearchContext
from registration import MeasuredSegments, RigidTransform, Segments
from registration.layout import Floats

from .reference.sight import first_hit

Truth = NDArray[np.intp]

# An L-shaped room with a niche: no turn or shift of it looks like itself.
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
SQUARE = np.array([[0, 0, 5, 0], [5, 0, 5, 5], [5, 5, 0, 5], [0, 5, 0, 0]], dtype=float)
CORRIDOR = np.array([[0, 0, 30, 0], [30, 2, 0, 2]], dtype=float)
ANGLES = np.linspace(-math.pi, math.pi, 240, endpoint=False)  # of the beams of a laser


def pose(x: float = 0.0, y: float = 0.0, theta: float = 0.0) -> RigidTransform:
    return RigidTransform(x, y, theta)


INSIDE = pose(3.0, 2.5, 0.7)  # of ROOM


def maze(seed: int, n: int = 60, size: float = 30.0) -> Floats:
    """Draw n walls along two directions, in no order that repeats."""
    rng = np.random.default_rng(seed)
    begins = rng.uniform(0.0, size, (n, 2))
    lengths = rng.uniform(0.8, 6.0, n)
    turns = rng.integers(0, 4, n) * (math.pi / 2)
    ends = begins + lengths[:, None] * np.stack([np.cos(turns), np.sin(turns)], axis=1)
    return np.hstack([begins, ends])


def equal_rooms(count: int) -> Floats:
    """Return ROOM, and the same again every 12 m to the right."""
    return np.vstack([ROOM + np.tile([12.0 * k, 0.0], 2) for k in range(count)])


def seen(
    walls: Any,
    at: RigidTransform,
    *,
    noise: float = 0.0,
    cut: float = 0.0,
    clutter: int = 0,
    seed: int = 0,
    radius: float = math.inf,
) -> tuple[Floats, Truth]:
    """Return (endpoints in the scan frame, truth), truth the wall of each segment or -1 for clutter.

    Of every wall within `radius` of the pose a share from ``1 - cut`` to 1 is seen.
    """
    rng = np.random.default_rng(seed)
    ends = np.asarray(walls, dtype=float)
    middle = 0.5 * (ends[:, :2] + ends[:, 2:])
    near = np.nonzero(np.hypot(middle[:, 0] - at.x, middle[:, 1] - at.y) <= radius)[0]
    pieces = []
    for i in near:
        share = 1.0 - cut * rng.random()
        start = (1.0 - share) * rng.random()
        a, d = ends[i, :2], ends[i, 2:] - ends[i, :2]
        n = np.array([-d[1], d[0]]) / np.hypot(*d)
        pieces.append(
            [*(a + start * d + noise * rng.normal() * n), *(a + (start + share) * d + noise * rng.normal() * n)]
        )
    for _ in range(clutter):
        begin = np.array([at.x, at.y]) + rng.uniform(-6.0, 6.0, 2)
        turn = rng.uniform(-math.pi, math.pi)
        pieces.append([*begin, *(begin + rng.uniform(0.5, 2.0) * np.array([math.cos(turn), math.sin(turn)]))])
    truth = np.concatenate([near, np.full(clutter, -1)])
    order = rng.permutation(len(pieces))
    local = at.inverse().apply(np.array(pieces).reshape(-1, 2, 2)).reshape(-1, 4)
    return local[order], truth[order]


def index_of(endpoints: Any, sigma: float | None = None) -> MapIndex:
    return MapIndex.build(Segments.from_array(endpoints), sigma)


def scan_of(
    endpoints: Any, sigma: float = 0.02, viewpoint: tuple[float, float] | None = None, beams: Beams | None = None
) -> Scan:
    """Wrap scan-frame endpoints; by default not seen from one place, since `seen` lets every wall be seen."""
    return Scan(MeasuredSegments.from_segments(Segments.from_array(endpoints), sigma), viewpoint, beams)


def context_of(
    index: MapIndex, scan: Scan, prior: Prior | None = None, deadline: Deadline | None = None, **options: Any
) -> SearchContext:
    """Prepare a search."""
    return SearchContext.of(index, scan, prior, AssociationOptions(**options), deadline or Deadline())


def answer_of(index: MapIndex, scan: Scan, prior: Prior | None = None, **options: Any) -> AssociationResult:
    """Search under the options that are named."""
    return associate(index, scan, prior, AssociationOptions(**options))


def pose_in(result: AssociationResult) -> RigidTransform:
    """Return the pose of an answer that has one."""
    assert result.pose is not None
    return result.pose


def squared_error(result: AssociationResult, truth: RigidTransform) -> float:
    """Return the squared error of an answer's pose, normalized by its covariance: a chi-square of three."""
    found = pose_in(result)
    error = np.array([found.x - truth.x, found.y - truth.y, math.remainder(found.theta - truth.theta, math.tau)])
    assert result.covariance is not None
    return float(error @ np.linalg.solve(result.covariance, error))


def warning_codes(result: AssociationResult) -> list[str]:
    return [warning.code for warning in result.warnings]


def local(index: MapIndex, at: RigidTransform) -> RigidTransform:
    """Return a pose of the map frame in the index frame."""
    return pose(at.x - float(index.origin[0]), at.y - float(index.origin[1]), at.theta)


def read(index: MapIndex, at: RigidTransform, reach: float = 20.0) -> Floats:
    """Return the exact ranges along `ANGLES` at a pose in the map frame, inf beyond `reach`."""
    here = local(index, at)
    found = [first_hit((here.x, here.y), at.theta + a, reach, index.walls.rows) for a in ANGLES]
    return np.array([distance if wall >= 0 else math.inf for distance, wall in found])


def beams_of(index: MapIndex, at: RigidTransform, reach: float = 20.0) -> Beams:
    """Return what a laser at a pose in the map frame reads without noise."""
    return Beams(ANGLES, read(index, at, reach), reach)


def same_pose(a: RigidTransform, b: RigidTransform, distance: float = 0.1, angle: float = 0.0175) -> bool:
    turn = math.remainder(a.theta - b.theta, math.tau)
    return math.hypot(a.x - b.x, a.y - b.y) <= distance and abs(turn) <= angle
