"""Walls that the pose of a scan depends on alone; the scan is no evidence for them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from registration import JointSums, RigidTransform, Segments

from . import tuning
from .scans import Localized

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
    normals, directions, middles = pairs.map_normals, pairs.map_directions, pairs.map_midpoints
    lines: list[Floats] = []
    rests: list[JointSums] = []
    left = np.ones(len(pairs), dtype=bool)
    while left.any():
        first = int(np.argmax(left))
        normal, offset = normals[first], pairs.map_offsets[first]
        mine = _on_line(directions, middles, normal, offset)
        mine[first] = True
        left &= ~mine
        lines.append(np.array([*normal, offset]))
        rests.append(total - JointSums.of_set(local.take(mine), weights[mine]))
    found = np.array(lines).reshape(-1, 3)
    return found[_deviations(rests, one.pose, found[:, :2]) > tuning.HANGING]


def on_lines(walls: Segments, lines: Floats) -> Bools:
    """Return which walls lie on any of some lines, (n,)."""
    out = np.zeros(len(walls), dtype=bool)
    for line in lines:
        out |= _on_line(walls.directions, walls.midpoints, line[:2], float(line[2]))
    return out


def _on_line(directions: Floats, midpoints: Floats, normal: Floats, offset: float) -> Bools:
    """Return which segments lie on a line, as pieces of one wall do."""
    return np.asarray(
        (np.abs(directions @ normal) < 0.05) & (np.abs(midpoints @ normal - offset) < tuning.LEAST_TOLERANCE)
    )


def _deviations(sums: Sequence[JointSums], pose: RigidTransform, normals: Floats) -> Floats:
    """Return the standard deviation of a pose along a direction by each of some sums, (k,) metres; inf where free.

    Of fewer than two correspondences it is inf.
    """
    information = np.array([one.information(pose.theta) for one in sums]).reshape(-1, 3, 3)
    values, vectors = np.linalg.eigh(information)
    along = np.einsum("kji,kj->ki", vectors[:, :2], normals)
    free = values <= 1e-9 * np.maximum(1.0, values.max(axis=1, initial=0.0))[:, None]
    square = np.where(free, 0.0, along**2 / np.where(free, 1.0, values)).sum(axis=1)
    unknown = np.array([one.count < 2 for one in sums], dtype=bool) | (free & (np.abs(along) > 1e-3)).any(axis=1)
    return np.where(unknown, math.inf, np.sqrt(square))
