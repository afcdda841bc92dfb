"""Scenes with known answers for the tests of registration."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from registration import Correspondences, MeasuredSegments, RegistrationResult, RigidTransform, Segments
from registration.layout import Floats

ROOM: list[list[float]] = [[0, 0, 10, 0], [10, 0, 10, 6], [10, 6, 0, 6], [0, 6, 0, 0], [3, 3, 4, 5], [7, 2, 5, 1]]
POSE = RigidTransform(3.0, 2.0, 0.4)
Measured = tuple[Floats, Floats, Floats, Floats, Floats, Floats]


def diagonal(n: int) -> NDArray[np.intp]:
    """Pair i with i."""
    return np.repeat(np.arange(n)[:, None], 2, axis=1)


def seen_from(pose: RigidTransform, segments: Segments) -> Segments:
    """Return map segments as a perfect scan from `pose` sees them."""
    ends = pose.inverse().apply(segments.endpoints.reshape(-1, 2, 2))
    return Segments.from_array(ends.reshape(-1, 4))


def moved(pose: RigidTransform, segments: Segments) -> Segments:
    """Return segments carried along by a transform."""
    return Segments.from_array(pose.apply(segments.endpoints.reshape(-1, 2, 2)).reshape(-1, 4))


def random_segments(rng: np.random.Generator, n: int, extent: float = 10.0) -> Segments:
    """Return n segments of 1 to 6 m in all directions."""
    begin = rng.uniform(-extent, extent, (n, 2))
    angle = rng.uniform(-math.pi, math.pi, n)
    length = rng.uniform(1.0, 6.0, n)
    return Segments.from_array(
        np.hstack([begin, begin + length[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)])
    )


def directed(degrees: ArrayLike, length: float = 1.0) -> Segments:
    """Return segments from the origin at these angles."""
    a = np.radians(np.asarray(degrees, dtype=float))
    ends = length * np.stack([np.cos(a), np.sin(a)], axis=1)
    return Segments.from_array(np.hstack([np.zeros_like(ends), ends]))


def noisy_pairs(
    rng: np.random.Generator, n: int, noise: float = 0.02, pose: RigidTransform = POSE
) -> tuple[Segments, MeasuredSegments]:
    """Return a map and a scan of it whose endpoints have noise."""
    map_segments = random_segments(rng, n)
    clean = seen_from(pose, map_segments).endpoints
    return map_segments, MeasuredSegments.from_segments(
        Segments.from_array(clean + rng.normal(0.0, noise, clean.shape)), max(noise, 1e-3)
    )


def correspondences(map_segments: Segments, scan: MeasuredSegments) -> Correspondences:
    """Pair row by row."""
    return Correspondences.of(map_segments, scan, diagonal(len(scan)))


def scanned_points(
    rng: np.random.Generator, map_segments: Segments, pose: RigidTransform, sigma: float, count: int
) -> Floats:
    """Return, per segment, `count` evenly spread points with normal noise across the wall, in the scan frame."""
    clean = seen_from(pose, map_segments)
    along = (np.arange(count) + 0.5) / count
    points = clean.endpoints[:, None, :2] + along[:, None] * (clean.directions * clean.lengths[:, None])[:, None]
    return points + rng.normal(0.0, sigma, points.shape[:2])[..., None] * clean.normals[:, None]


def fitted(points: Floats, sigma: float) -> MeasuredSegments:
    """Fit a segment to each row of points by total least squares, with its moments."""
    rows, centroids, spreads = [], [], []
    for p in points:
        centre = p.mean(axis=0)
        axis = np.linalg.svd(p - centre)[2][0]
        axis = axis if axis @ (p[-1] - p[0]) > 0.0 else -axis
        along = (p - centre) @ axis
        rows.append(np.concatenate([centre + along.min() * axis, centre + along.max() * axis]))
        centroids.append(centre)
        spreads.append(float(np.mean(along**2)))
    return MeasuredSegments.from_segments(
        Segments.from_array(rows), sigma, np.full(len(points), float(points.shape[1])), (centroids, spreads)
    )


def pose_of(result: RegistrationResult) -> RigidTransform:
    """Return the pose of a result that has one."""
    assert result.pose is not None
    return result.pose


def difference(a: RigidTransform, b: RigidTransform) -> Floats:
    """Return pose a minus pose b as (x, y, theta)."""
    return np.array([a.x - b.x, a.y - b.y, math.remainder(a.theta - b.theta, math.tau)])


def assert_close(actual: Any, expected: Any) -> None:
    np.testing.assert_allclose(actual, expected, rtol=1e-9, atol=1e-9)


def drawn(seed: int, n: int = 7) -> tuple[np.random.Generator, Correspondences, Floats, Measured]:
    rng = np.random.default_rng(seed)
    pairs = correspondences(*noisy_pairs(rng, n, noise=0.05))
    weights = rng.uniform(0.1, 2.0, n)
    measured = (pairs.map_normals, pairs.map_offsets, pairs.centroids, pairs.directions, pairs.spreads, weights)
    return rng, pairs, weights, measured


def room(pose: RigidTransform = POSE, sigma: float = 0.02) -> tuple[Segments, MeasuredSegments]:
    map_segments = Segments.from_array(ROOM)
    return map_segments, MeasuredSegments.from_segments(seen_from(pose, map_segments), sigma)
