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
from itertools import pairwise

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
    SPRING,
    UNSEEN_ERROR,
    USUAL_WALL_ERROR,
    USUAL_WALLS,
    VIEW_ROUNDS,
)

SETTLED_STEP = 1e-4  # m, rad and deviations; the step after one below it is none,
SETTLED_SHARE = 0.02  # where the walls' variance changes by less than that


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
    seen : (k,) of `SIGHTING`, view by view
    walls : (k,) of `WALL`, on which each lies
    number : (k,) which of the walls that is, from 0 up
    """

    views: Views
    seen: Records
    walls: Records
    number: NDArray[np.intp]

    @classmethod
    def of(cls, views: Views, seen: Records, walls: Records, on: NDArray[np.intp]) -> SeenOnWalls:
        """Take what lies on the walls of a map, `on` which says."""
        _, number = np.unique(on, return_inverse=True)
        return cls(views, seen, walls[on], number)

    def settle(self, start: RigidTransform, known: float | None) -> ViewsSettled:
        """Solve for the pose and the errors of the views, with the walls' variance or as their residuals show it.

        A pose that would go too far stays, as it does for one view.
        """
        begin = np.array([start.x, start.y, start.theta, *self.views.found])
        x, variance = begin, USUAL_WALL_ERROR**2 if known is None else known
        for _ in range(VIEW_ROUNDS):
            normal, gradient = self._normal(x, variance)
            step, before = np.linalg.solve(normal, -gradient), variance
            x = x + step
            if known is None:
                variance = self._shown_variance(x, np.asarray(np.linalg.inv(normal), dtype=np.float64), variance)
            if np.abs(step).max() < SETTLED_STEP and abs(variance - before) < SETTLED_SHARE * before:
                break
        far = math.hypot(x[0] - start.x, x[1] - start.y) > MAX_STEP or abs(wrap_angle(x[2] - start.theta)) > MAX_TURN
        if far or not np.isfinite(x).all():
            x, variance = begin, USUAL_WALL_ERROR**2 if known is None else known
        inverse = self._covariance(x, variance)
        pose = RigidTransform(float(x[0]), float(x[1]), float(x[2]))
        return ViewsSettled(pose, inverse[:3, :3], x[3:], inverse[3:, 3:], variance)

    def covariance_with(self, settled: ViewsSettled, wall_variance: float) -> Floats:
        """Return the covariance of a settled pose if walls are off with another variance, (3, 3)."""
        x = np.array([settled.pose.x, settled.pose.y, settled.pose.theta, *settled.found])
        return self._covariance(x, wall_variance)[:3, :3]

    def _covariance(self, x: Floats, wall_variance: float) -> Floats:
        inverse = np.linalg.inv(self._normal(x, wall_variance)[0])
        return np.asarray(0.5 * (inverse + inverse.T))

    def _shown_variance(self, x: Floats, covariance: Floats, wall_variance: float) -> float:
        """Return the variance of the walls' own errors that their residuals show, as `settling` has it for one view."""
        shares, sums = self._by_wall(self._rows(x), self._weights(wall_variance))
        means = shares / sums[:, None]
        spreads = ((means[:, :-1] @ covariance) * means[:, :-1]).sum(axis=1)
        free = np.maximum(0.0, 1.0 - spreads / (wall_variance + 1.0 / sums))
        found = USUAL_WALLS * USUAL_WALL_ERROR**2 + float(np.sum(means[:, -1] ** 2 - free / sums))
        count = USUAL_WALLS + float(free.sum())
        unsure = UNSEEN_ERROR * (1.0 + 2.0 / max(1.0, count - 2.0))
        return unsure * max(found / count, LEAST_WALL_ERROR**2)

    def _weights(self, wall_variance: float) -> Floats:
        return np.asarray(1.0 / (self.seen["variance"] + ROUGH_SHARE * wall_variance))

    def _normal(self, x: Floats, wall_variance: float) -> tuple[Floats, Floats]:
        """Return the normal matrix and the gradient at pose and variates, (3 + 3 u, 3 + 3 u) and (3 + 3 u,).

        First by the pose and the errors of each view by themselves, of which any line has no more than its own.
        """
        views, rows, weights = self.views, self._rows(x), self._weights(wall_variance)
        starts = np.searchsorted(self.seen["sensor"], np.arange(len(views) + 1))
        offsets, angles = rows.offsets * weights[:, None], rows.angles * (weights * self.seen["spread"])[:, None]
        own = np.stack(
            [
                offsets[a:b].T @ rows.offsets[a:b] + angles[a:b].T @ rows.angles[a:b]
                for a, b in pairwise(starts.tolist())
            ]
        )
        root, size = views.root, len(x)
        by_view = root.reshape(len(views), 3, -1)
        normal, gradient = np.zeros((size, size)), np.zeros(size)
        normal[:3, :3], gradient[:3] = own[:, :3, :3].sum(axis=0), own[:, :3, 6].sum(axis=0)
        across = own[:, 3:6, :3].reshape(-1, 3).T @ root
        normal[:3, 3:], normal[3:, :3] = across, across.T
        normal[3:, 3:] = root.T @ (own[:, 3:6, 3:6] @ by_view).reshape(root.shape)
        gradient[3:] = own[:, 3:6, 6].reshape(-1) @ root
        if wall_variance > 0.0:
            shares, sums = self._by_wall(rows, weights)
            apart = shares / (sums + 1.0 / wall_variance)[:, None]
            normal -= shares[:, :-1].T @ apart[:, :-1]
            gradient -= apart[:, :-1].T @ shares[:, -1]
        prior = np.arange(3, size)
        normal[prior, prior] += 1.0
        gradient[prior] += x[prior]
        normal[[0, 1], [0, 1]] += SPRING
        return normal, gradient

    def _by_wall(self, rows: _Rows, weights: Floats) -> tuple[Floats, Floats]:
        """Add up the rows of offsets and the weights wall by wall: (w, 3 + 3 u + 1), the residuals last, and (w,)."""
        views, count = self.views, int(self.number.max(initial=-1)) + 1
        weighed, place = rows.offsets * weights[:, None], self.number * len(views) + self.seen["sensor"]
        by_view = np.empty((count * len(views), 3))
        for k in range(3):
            by_view[:, k] = np.bincount(place, weighed[:, 3 + k], count * len(views))
        shares = np.stack([np.bincount(self.number, weighed[:, k], count) for k in (0, 1, 2, 6)], axis=1)
        by_variates = by_view.reshape(count, -1) @ views.root
        together = np.hstack([shares[:, :3], by_variates, shares[:, 3:]])
        return together, np.bincount(self.number, weights, count).astype(np.float64)

    def _rows(self, x: Floats) -> _Rows:
        """Return offsets and sines of angles from the walls at pose and variates, with their derivatives."""
        views, seen, walls = self.views, self.seen, self.walls
        shifts = (views.root @ (x[3:] - views.found)).reshape(-1, 3)[seen["sensor"]]
        origins = np.array([[pose.x, pose.y] for pose in views.poses])[seen["sensor"]]
        levers = _turned(np.stack([seen["centroid_x"], seen["centroid_y"]], axis=1) - origins, shifts[:, 2])
        there = _turned(origins + shifts[:, :2] + levers, x[2])
        normals = np.stack([-walls["dy"], walls["dx"]], axis=1)
        offsets = np.einsum("ij,ij->i", normals, there + x[:2]) - walls["offset"]
        towards = _turned(np.stack([seen["dx"], seen["dy"]], axis=1), shifts[:, 2] + x[2])
        sines = walls["dx"] * towards[:, 1] - walls["dy"] * towards[:, 0]
        cosines = walls["dx"] * towards[:, 0] + walls["dy"] * towards[:, 1]
        own = _turned(normals, -x[2])  # the normals in the scan frame
        by_pose, by_view = _lever(normals, there), _lever(own, levers)
        none = np.zeros(len(seen))
        return _Rows(
            np.column_stack([normals, by_pose, own, by_view, offsets]),
            np.column_stack([none, none, cosines, none, none, cosines, sines]),
        )


@dataclass(frozen=True, slots=True)
class _Rows:
    """Offsets and sines of angles, (k, 7) each: derivatives by the pose, by that of the own view, and the residual."""

    offsets: Floats
    angles: Floats


def _turned(vectors: Floats, angles: Floats | float) -> Floats:
    """Rotate vectors (k, 2), by an angle each or by one."""
    c, s = np.cos(angles), np.sin(angles)
    return np.stack([c * vectors[:, 0] - s * vectors[:, 1], s * vectors[:, 0] + c * vectors[:, 1]], axis=1)


def _lever(normals: Floats, places: Floats) -> Floats:
    """Return how offsets along normals (k, 2) change where places (k, 2) turn about the origin."""
    return np.asarray(normals[:, 1] * places[:, 0] - normals[:, 0] * places[:, 1])
