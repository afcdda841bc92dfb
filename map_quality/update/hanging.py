"""Walls that the pose of a scan depends on alone; the scan is no evidence for them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from registration import JointSums, RigidTransform, Segments

from .scans import Localized
from .tuning import HANGING, LEAST_TOLERANCE

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]


def hanging_lines(one: Localized, sigma: float) -> Floats:
    """Return the lines of walls without which the pose of a scan would not be known along their normal.

    The sums of the other correspondences are what remains when those of a wall are taken out.

    Parameters
    ----------
    one : Localized
    sigma : float
        Standard deviation of the walls, metres.

    Returns
    -------
    (k, 3)
        Normal and offset of each line in the map frame.
    """
    pairs = one.pairs
    weights = 1.0 / (pairs.variances + sigma**2)
    local = pairs.about((one.pose.x, one.pose.y), (0.0, 0.0))
    total = JointSums.of_set(local, weights)
    hanging: list[Floats] = []
    left = np.ones(len(pairs), dtype=bool)
    while left.any():
        first = int(np.argmax(left))
        normal, offset = pairs.map_normals[first], pairs.map_offsets[first]
        mine = _on_line(pairs.map_directions, pairs.map_midpoints, normal, offset)
        mine[first] = True
        left &= ~mine
        rest = total - JointSums.of_set(local.take(mine), weights[mine])
        if rest.count < 2 or _deviation(rest, one.pose, normal) > HANGING:
            hanging.append(np.array([*normal, offset]))
    return np.array(hanging).reshape(-1, 3)


def on_lines(walls: Segments, lines: Floats) -> Bools:
    """Return which walls lie on any of some lines, (n,)."""
    out = np.zeros(len(walls), dtype=bool)
    for line in lines:
        out |= _on_line(walls.directions, walls.midpoints, line[:2], float(line[2]))
    return out


def _on_line(directions: Floats, midpoints: Floats, normal: Floats, offset: float) -> Bools:
    """Return which segments lie on a line, as pieces of one wall do."""
    return np.asarray((np.abs(directions @ normal) < 0.05) & (np.abs(midpoints @ normal - offset) < LEAST_TOLERANCE))


def _deviation(sums: JointSums, pose: RigidTransform, normal: Floats) -> float:
    """Return the standard deviation of a pose along a direction by some sums, metres; inf where it is free."""
    information = sums.information(pose.theta)
    values, vectors = np.linalg.eigh(information)
    along = vectors.T @ np.array([normal[0], normal[1], 0.0])
    free = values <= 1e-9 * max(1.0, float(values.max()))
    if np.any(np.abs(along[free]) > 1e-3):
        return math.inf
    return float(np.sqrt(np.sum(along[~free] ** 2 / values[~free])))
