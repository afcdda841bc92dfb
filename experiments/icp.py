"""Iterative closest point, point to line: the usual way, for comparison.

Each point goes to the nearest point of the nearest map segment; a tenth of the points, the farthest, are left out; the
squared distances from the lines of those segments are minimised by one Gauss-Newton step; and again, until nothing
moves. The nearest segment is found exactly, so no tree of points could do better.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from registration import RigidTransform, Segments

Floats = NDArray[np.float64]

KEPT = 0.9  # share of the points
MAX_ITERATIONS = 100
LEAST_STEP = 1e-7  # m and rad


@dataclass(frozen=True, slots=True)
class Aligned:
    """The final pose.

    Attributes
    ----------
    pose : RigidTransform
        map_from_scan.
    iterations : int
    converged : bool
        True if it converged before `MAX_ITERATIONS`.
    """

    pose: RigidTransform
    iterations: int
    converged: bool


def nearest(points: Floats, map: Segments) -> tuple[NDArray[np.intp], Floats]:
    """Return the nearest segment of each point (m, 2), and its distance: (m,) and (m,) metres."""
    begins, directions = map.endpoints[:, :2], map.directions
    x = points[:, None, 0] - begins[None, :, 0]
    y = points[:, None, 1] - begins[None, :, 1]
    along = np.clip(x * directions[:, 0] + y * directions[:, 1], 0.0, map.lengths)
    squares = (x - along * directions[:, 0]) ** 2 + (y - along * directions[:, 1]) ** 2
    indices = squares.argmin(axis=1)
    return indices, np.sqrt(squares[np.arange(len(points)), indices])


def align(points: Floats, map: Segments, start: RigidTransform) -> Aligned:
    """Move a scan onto a map.

    Parameters
    ----------
    points : (m, 2)
        In the scan frame, metres.
    map : Segments
    start : RigidTransform
        Where to begin, map_from_scan.
    """
    pose = start
    for iteration in range(1, MAX_ITERATIONS + 1):
        moved = pose.apply(points)
        indices, distances = nearest(moved, map)
        kept = distances <= np.quantile(distances, KEPT)
        normals, feet = map.normals[indices[kept]], map.midpoints[indices[kept]]
        centre = moved[kept].mean(axis=0)
        lever = moved[kept] - centre
        residuals = np.einsum("ij,ij->i", normals, moved[kept] - feet)
        jacobian = np.column_stack([normals, normals[:, 1] * lever[:, 0] - normals[:, 0] * lever[:, 1]])
        step = np.linalg.lstsq(jacobian, -residuals, rcond=1e-9)[0]
        # A turn about the middle of the points, then a shift.
        turn = RigidTransform(0.0, 0.0, float(step[2]))
        x, y = centre + step[:2] - turn.apply(centre)
        pose = RigidTransform(float(x), float(y), turn.theta).compose(pose)
        if np.abs(step).max() < LEAST_STEP:
            return Aligned(pose, iteration, True)
    return Aligned(pose, MAX_ITERATIONS, False)
