"""The pose of several views that are not exact: solved beside the errors of theirs.

Unknown are the pose and the variates z of `Views.root`, which odometry says are standard normal. Each view shows a
matched line for itself; the offset of a wall is one error for all that was seen of it, from whatever view. With
``phi`` the row of an offset's derivatives, w its weight, V the walls' variance, the normal matrix is ``sum w phi phi'``
of offsets and angles, less ``v v' / (s + 1 / V)`` of each wall, plus the unit matrix for z. The pose's covariance is
its block of the inverse: what is left of view v is ``(I + F_v S_v)^-1 F_v`` where views are independent.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from registration import RigidTransform, wrap_angle
from registration.layout import Floats, Records

from .scan import Views
from .tuning import (
    LEAST_WALL_ERROR,
    MAX_STEP,
    MAX_TURN,
    ROUGH_SHARE,
    SETTLING_ROUNDS,
    SPRING,
    UNSEEN_ERROR,
    USUAL_WALL_ERROR,
    USUAL_WALLS,
    VIEW_ROUNDS,
)


@dataclass(frozen=True, slots=True)
class ViewsSettled:
    """A pose with the errors of its views.

    Attributes
    ----------
    pose : RigidTransform
        Index frame from scan frame.
    covariance : (3, 3)
        Of additive (x, y, theta).
    found : (3 u,)
        The variates of `Views.root`.
    spread : (3 u, 3 u)
        What remains of them.
    wall_variance : float
        Of the walls' own offsets, m^2.
    """

    pose: RigidTransform
    covariance: Floats
    found: Floats
    spread: Floats
    wall_variance: float


@dataclass(frozen=True, slots=True)
class SeenOnWalls:
    """What views show of walls.

    Attributes
    ----------
    views : Views
    seen : (k,) of `SIGHTING`
    walls : (k,) of `WALL`, on which each lies
    of_wall : (k,) which wall that is
    """

    views: Views
    seen: Records
    walls: Records
    of_wall: NDArray[np.intp]

    def estimate(self, start: RigidTransform) -> ViewsSettled:
        """Solve likewise, with the walls' variance as their residuals show it."""
        found = self.settle(start, USUAL_WALL_ERROR**2)
        for _ in range(SETTLING_ROUNDS - 1):
            found = self.settle(found.pose, found.wall_variance)
        return found

    def settle(self, start: RigidTransform, wall_variance: float) -> ViewsSettled:
        """Solve for the pose and the errors of the views, walls off with that variance.

        A pose that would go too far stays, as it does for one view.
        """
        x = np.array([start.x, start.y, start.theta, *self.views.found])
        normal = np.eye(len(x))
        for _ in range(VIEW_ROUNDS):
            normal, gradient = self._normal(x, wall_variance)
            step = np.linalg.solve(normal, -gradient)
            x = x + step
            if np.abs(step).max() < 1e-9:
                break
        far = math.hypot(x[0] - start.x, x[1] - start.y) > MAX_STEP or abs(wrap_angle(x[2] - start.theta)) > MAX_TURN
        if far or not np.isfinite(x).all():
            x = np.array([start.x, start.y, start.theta, *self.views.found])
        normal, _ = self._normal(x, wall_variance)
        inverse = np.linalg.inv(normal)
        inverse = 0.5 * (inverse + inverse.T)
        pose = RigidTransform(float(x[0]), float(x[1]), float(x[2]))
        shown = self._shown_variance(x, inverse, wall_variance)
        return ViewsSettled(pose, inverse[:3, :3], x[3:], inverse[3:, 3:], shown)

    def _shown_variance(self, x: Floats, covariance: Floats, wall_variance: float) -> float:
        """Return the variance of the walls' own errors that their residuals show, as `settling` has it for one view."""
        offsets, _, rows, _ = self._residuals(x)
        weights = 1.0 / (self.seen["variance"] + ROUGH_SHARE * wall_variance)
        shares, sums = self._by_wall(np.column_stack([rows, offsets]) * weights[:, None], weights)
        means = shares / sums[:, None]
        spreads = np.einsum("ij,jk,ik->i", means[:, :-1], covariance, means[:, :-1])
        free = np.maximum(0.0, 1.0 - spreads / (wall_variance + 1.0 / sums))
        found = USUAL_WALLS * USUAL_WALL_ERROR**2 + float(np.sum(means[:, -1] ** 2 - free / sums))
        count = USUAL_WALLS + float(free.sum())
        unsure = UNSEEN_ERROR * (1.0 + 2.0 / max(1.0, count - 2.0))
        return unsure * max(found / count, LEAST_WALL_ERROR**2)

    def _by_wall(self, rows: Floats, weights: Floats) -> tuple[Floats, Floats]:
        """Add up rows (k, c) and weights (k,) wall by wall."""
        _, wall = np.unique(self.of_wall, return_inverse=True)
        count = int(wall.max(initial=-1)) + 1
        shares = np.zeros((count, rows.shape[1]))
        np.add.at(shares, wall, rows)
        return shares, np.bincount(wall, weights, count).astype(np.float64)

    def _normal(self, x: Floats, wall_variance: float) -> tuple[Floats, Floats]:
        """Return the normal matrix and the gradient at pose and variates, (3 + 3 u, 3 + 3 u) and (3 + 3 u,)."""
        offsets, angles, rows, turns = self._residuals(x)
        weights = 1.0 / (self.seen["variance"] + ROUGH_SHARE * wall_variance)
        normal = np.zeros((len(x), len(x)))
        gradient = np.zeros(len(x))
        for jacobian, residuals, each in ((rows, offsets, weights), (turns, angles, weights * self.seen["spread"])):
            weighed = jacobian * each[:, None]
            normal += jacobian.T @ weighed
            gradient += weighed.T @ residuals
        if wall_variance > 0.0:
            shares, sums = self._by_wall(np.column_stack([rows, offsets]) * weights[:, None], weights)
            apart = shares / (sums + 1.0 / wall_variance)[:, None]
            normal -= shares[:, :-1].T @ apart[:, :-1]
            gradient -= apart[:, :-1].T @ shares[:, -1]
        prior = np.arange(3, len(x))
        normal[prior, prior] += 1.0
        gradient[prior] += x[prior]
        normal[[0, 1], [0, 1]] += SPRING
        return normal, gradient

    def _residuals(self, x: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """Return offsets (k,) and sines of angles (k,) from the walls, and their derivatives, (k, 3 + 3 u) each."""
        views, seen, walls = self.views, self.seen, self.walls
        shifts = (views.root @ (x[3:] - views.found)).reshape(-1, 3)[seen["sensor"]]
        origins = np.array([[pose.x, pose.y] for pose in views.poses])[seen["sensor"]]
        levers = _turned(np.stack([seen["centroid_x"], seen["centroid_y"]], axis=1) - origins, shifts[:, 2])
        here = origins + shifts[:, :2] + levers
        there = _turned(here, x[2])
        normals = np.stack([-walls["dy"], walls["dx"]], axis=1)
        offsets = np.einsum("ij,ij->i", normals, there + x[:2]) - walls["offset"]
        towards = _turned(np.stack([seen["dx"], seen["dy"]], axis=1), shifts[:, 2] + x[2])
        angles = walls["dx"] * towards[:, 1] - walls["dy"] * towards[:, 0]
        cosines = walls["dx"] * towards[:, 0] + walls["dy"] * towards[:, 1]
        own = _turned(normals, -x[2])  # the normals in the scan frame
        by_view = np.column_stack([own, np.einsum("ij,ij->i", own, _quarter(levers))])
        root = views.root.reshape(len(views), 3, -1)[seen["sensor"]]
        by_pose = np.column_stack([normals, np.einsum("ij,ij->i", normals, _quarter(there))])
        rows = np.hstack([by_pose, np.einsum("ij,ijk->ik", by_view, root)])
        none = np.zeros((len(seen), 2))
        turns = np.hstack([none, cosines[:, None], cosines[:, None] * root[:, 2]])
        return offsets, angles, rows, turns


def _turned(vectors: Floats, angles: Floats | float) -> Floats:
    """Rotate vectors (k, 2), by an angle each or by one."""
    c, s = np.cos(angles), np.sin(angles)
    return np.stack([c * vectors[:, 0] - s * vectors[:, 1], s * vectors[:, 0] + c * vectors[:, 1]], axis=1)


def _quarter(vectors: Floats) -> Floats:
    """Rotate vectors (k, 2) by +90 degrees."""
    return np.stack([-vectors[:, 1], vectors[:, 0]], axis=1)
