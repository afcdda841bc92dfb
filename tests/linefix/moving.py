"""The ranges of a scanner on a robot that moves during the scan, worked out beam by beam."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from registration import RigidTransform, Segments
from vectorization import Motion


def moving_ranges(
    walls: Segments,
    robot: RigidTransform,
    mount: RigidTransform,
    angles: NDArray[np.float64],
    motion: Motion,
    rng: np.random.Generator,
) -> NDArray[np.float64]:
    """Return ranges with noise of 1 cm; `robot` is map_from_base at the first beam, and `motion` that of the robot."""
    poses = [robot.compose(RigidTransform(*place)).compose(mount) for place in motion.places(len(angles)).tolist()]
    x, y, heading = np.array([(pose.x, pose.y, pose.theta) for pose in poses]).T
    along = np.array([np.cos(heading + angles), np.sin(heading + angles)])
    begin, way = walls.endpoints[:, None, :2], (walls.endpoints[:, 2:] - walls.endpoints[:, :2])[:, None]
    away = begin - np.array([x, y]).T
    across = along[0] * way[..., 1] - along[1] * way[..., 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = (away[..., 0] * way[..., 1] - away[..., 1] * way[..., 0]) / across
        place = (away[..., 0] * along[1] - away[..., 1] * along[0]) / across
    met = (distance > 0.0) & (place >= 0.0) & (place <= 1.0)
    ranges: NDArray[np.float64] = np.where(met, distance, np.inf).min(axis=0) + rng.normal(0.0, 0.01, len(angles))
    return ranges
