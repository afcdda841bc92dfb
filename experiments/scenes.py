"""The three environments of the paper's Fig. 5, in its character: it prints no coordinates."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from registration import RigidTransform, Segments
from simulation import Scanner, World, cut_square, oblique, pillars, scan

Floats = NDArray[np.float64]
Places = Literal["path", "scattered"]

UNIT = 0.01  # m; what one of the paper's units is taken to be
GRID = 50.0  # units
REACH = 100.0  # m; every wall is seen however far it is
CLEARANCE = 30.0 * UNIT  # m between a scattered pose and the nearest wall

NAMES = ("CutSquare", "Oblique", "Pillars")


def _squares(corners: list[tuple[float, float]]) -> World:
    """Return the square of CutSquare with another piece cut off its upper right corner, scanned from the same path."""
    ends = np.array([(0.0, 0.0), (400.0, 0.0), *corners, (0.0, 400.0)]) * UNIT
    segments = Segments.from_array(np.hstack([ends, np.roll(ends, -1, axis=0)]))
    return World("cut_square", segments, cut_square(UNIT).poses, len(segments))


MAKERS: dict[str, Callable[[], World]] = {
    "CutSquare": lambda: cut_square(UNIT),
    "Oblique": lambda: oblique(UNIT),
    "Pillars": lambda: pillars(UNIT),
    "CutSquare, cut of 141": lambda: _squares([(400.0, 300.0), (300.0, 400.0)]),
    "CutSquare, cut of 71": lambda: _squares([(400.0, 350.0), (350.0, 400.0)]),
    "CutSquare, notch of 100": lambda: _squares([(400.0, 300.0), (300.0, 300.0), (300.0, 400.0)]),
}


@cache
def world(name: str) -> World:
    """Return one of the environments, or of the other drawings of CutSquare, metres."""
    return MAKERS[name]()


@cache
def poses(name: str, places: Places = "path") -> tuple[RigidTransform, ...]:
    """Return the poses along the path, or as many drawn anywhere in free space."""
    scene = world(name)
    if places == "path":
        return scene.poses
    rng = np.random.default_rng(list(MAKERS).index(name))
    corners = scene.segments.endpoints.reshape(-1, 2)
    found: list[RigidTransform] = []
    while len(found) < len(scene.poses):
        x, y = rng.uniform(corners.min(axis=0), corners.max(axis=0))
        pose = RigidTransform(float(x), float(y), float(rng.uniform(-math.pi, math.pi)))
        seen = scan(scene.segments, pose, Scanner(sigma=0.0, range_max=REACH))
        if seen.facing.all() and seen.ranges.min() > CLEARANCE:
            found.append(pose)
    return tuple(found)


def expected_ranges(
    segments: Segments, hits: NDArray[np.int64], angles: Floats, pose: RigidTransform
) -> tuple[Floats, Floats]:
    """Return what beams measure that hit known walls, and the derivatives.

    Parameters
    ----------
    segments : Segments
    hits : (m,)
        The wall of each beam.
    angles : (m,)
        Of the beams in the scan frame, radians.
    pose : RigidTransform

    Returns
    -------
    ranges : (m,) metres
    jacobian : (m, 3)
        By x and y in metres and by the heading.
    """
    directions = angles + pose.theta
    rays = np.stack([np.cos(directions), np.sin(directions)], axis=1)
    normals = segments.normals[hits]
    # A range is (p - n . t) / (n . ray): its derivative by t is -n over the cosine, and by theta that of the ray.
    cosines = np.einsum("ij,ij->i", normals, rays)
    across = np.einsum("ij,ij->i", normals, rays @ np.array([[0.0, 1.0], [-1.0, 0.0]]))
    ranges = (segments.offsets[hits] - normals @ np.array([pose.x, pose.y])) / cosines
    return ranges, np.column_stack([-normals / cosines[:, None], -ranges * across / cosines])


def bound(name: str, pose: RigidTransform, points: int, sigma: float) -> Floats:
    """Return the Cramer-Rao bound of (x, y, theta) from all beams of a scan whose walls are known.

    Parameters
    ----------
    name : str
    pose : RigidTransform
    points : int
        Beams.
    sigma : float
        Of a range, units.

    Returns
    -------
    (3, 3)
        The least covariance, units^2, units rad, rad^2.
    """
    segments = world(name).segments
    seen = scan(segments, pose, Scanner.over(math.tau, points, sigma=0.0, range_max=REACH))
    _, jacobian = expected_ranges(segments, seen.hits, seen.angles, pose)
    jacobian[:, 2] /= UNIT
    return np.asarray(np.linalg.inv(jacobian.T @ jacobian / sigma**2))
