"""Free poses of a robot in a building."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from registration import RigidTransform, Segments
from simulation import SimulationError
from simulation.kernels.casting import cast

Floats = NDArray[np.float64]

CLEARANCE = 0.4  # m; what a robot keeps from everything
RAYS = 72
FAR = 25.0  # m; range within which a place is recognized,
SEEN = 0.2  # the least share of the rays that meet anything,
NEAR_ENOUGH = 15.0  # m; and what the nearest of them meets lies within
TRIES = 4000


def free_place(segments: Segments, rng: np.random.Generator, clearance: float = CLEARANCE) -> RigidTransform:
    """Draw a pose in free space, all over the building with equal probability, looking anywhere.

    A place is free where all that is seen from it shows its free side, and nothing is nearer than `clearance` metres.

    Parameters
    ----------
    segments : Segments
        All that stands there, free space on the left.
    rng : numpy.random.Generator
    clearance : float

    Raises
    ------
    SimulationError
        When there is no such place, as far as many tries can tell.
    """
    corners = segments.endpoints.reshape(-1, 2)
    low, high = corners.min(axis=0), corners.max(axis=0)
    for _ in range(TRIES):
        x, y = rng.uniform(low, high)
        if is_free(segments, float(x), float(y), clearance):
            return RigidTransform(float(x), float(y), rng.uniform(-math.pi, math.pi))
    raise SimulationError(f"found no free place with {clearance:g} m about it", argument="segments")


def is_free(segments: Segments, x: float, y: float, clearance: float = CLEARANCE) -> bool:
    """Tell whether a robot could stand at ``(x, y)`` and would see something from there."""
    if distances(segments, x, y).min() < clearance:
        return False
    angles = np.arange(RAYS) * (math.tau / RAYS)
    ranges, hits = cast(
        segments.endpoints, x, y, 0.0, math.tau / RAYS, np.cos(angles), np.sin(angles), False
    )  # fmt: skip
    seen = hits[ranges < FAR]
    if len(seen) < SEEN * RAYS or ranges.min() > NEAR_ENOUGH:
        return False
    met = np.unique(hits[hits >= 0])
    normals, away = segments.normals[met], np.array([x, y]) - segments.midpoints[met]
    return bool((np.einsum("ij,ij->i", normals, away) > 0.0).all())


def distances(segments: Segments, x: float, y: float) -> Floats:
    """Return how far ``(x, y)`` is from each segment, ``(n,)`` metres."""
    offsets = np.array([x, y]) - segments.endpoints[:, :2]
    along = np.clip(np.einsum("ij,ij->i", offsets, segments.directions), 0.0, segments.lengths)
    gaps = offsets - along[:, None] * segments.directions
    return np.asarray(np.hypot(gaps[:, 0], gaps[:, 1]))
