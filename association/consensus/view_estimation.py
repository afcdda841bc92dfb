"""Estimate the pose of several views that are not exact, together with the errors of the views.

Unknown are the pose and the variates z of `Views.root`, which by odometry are standard normal. Each view shows a
matched line for itself; the offset of a wall is one error for all its observations, from whatever view. Let ``phi`` be
the row of an offset's derivatives, w its weight, and V the walls' variance. The normal matrix is ``sum w phi phi'`` of
offsets and angles, less ``v v' / (s + 1 / V)`` of each wall, plus the unit matrix for z. The pose's covariance is its
block of the inverse: the rest of view v is ``(I + F_v S_v)^-1 F_v`` where views are independent.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from registration import RigidTransform, wrap_angle
from registration.layout import POSE, Floats, Records

from ..deadline import Deadline
from ..layout import POINT, as_records, record
from ..scan.scan import Views
from ..tables import SeenByViews
from .kernels.view_estimation import add_views
from .tuning import (
    LEAST_WALL_ERROR,
    MAX_STEP,
    MAX_TURN,
    SPRING,
    UNSEEN_ERROR,
    USUAL_WALL_ERROR,
    USUAL_WALLS,
    VIEW_ROUNDS,
)

CONVERGED_STEP = 1e-4  # m, rad and deviations; the step after one below it is none,
CONVERGED_FRACTION = 0.02  # where the walls' variance changes by less than that


@dataclass(frozen=True, slots=True)
class EstimatedViews:
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
        Covariance of the variates that remains.
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
    """The walls as the views show them.

    Attributes
    ----------
    views : Views
    seen : (k,) of `SIGHTING`, view by view
    walls : (k,) of `WALL`, on which each lies
    number : (k,) which of the walls that is, from 0 up
    origins : (v,) of `POINT`, where the views' frames begin, as reported
    """

    views: Views
    seen: Records
    walls: Records
    number: NDArray[np.intp]
    origins: Records

    @classmethod
    def of(cls, views: Views, seen: Records, lines: Records, on: NDArray[np.intp]) -> SeenOnWalls:
        """Take what lies on `lines`, (k,) of `WALL`, of the walls that `on` (k,) numbers."""
        _, number = np.unique(on, return_inverse=True)
        origins = as_records(POINT, np.array([(pose.x, pose.y) for pose in views.poses]))
        return cls(views, seen, lines, number, origins)

    def estimate(self, start: RigidTransform, known: float | None, deadline: Deadline) -> EstimatedViews:
        """Solve for the pose and the errors of the views, with the walls' variance or as their residuals show it.

        A pose that would go too far stays, as it does for one view. After the deadline no further round begins.
        """
        begin = np.array([start.x, start.y, start.theta, *self.views.found])
        x, variance = begin, USUAL_WALL_ERROR**2 if known is None else known
        for _ in range(VIEW_ROUNDS):
            normal, gradient = self._normal(x, variance)
            step, before = np.linalg.solve(normal, -gradient), variance
            x = x + step
            if known is None:
                variance = self._shown_variance(x, np.asarray(np.linalg.inv(normal), dtype=np.float64), variance)
            still = np.abs(step).max() < CONVERGED_STEP and abs(variance - before) < CONVERGED_FRACTION * before
            if still or deadline.passed:
                break
        far = math.hypot(x[0] - start.x, x[1] - start.y) > MAX_STEP or abs(wrap_angle(x[2] - start.theta)) > MAX_TURN
        if far or not np.isfinite(x).all():
            x, variance = begin, USUAL_WALL_ERROR**2 if known is None else known
        inverse = self._covariance(x, variance)
        pose = RigidTransform(float(x[0]), float(x[1]), float(x[2]))
        return EstimatedViews(pose, inverse[:3, :3], x[3:], inverse[3:, 3:], variance)

    def covariance_with(self, found: EstimatedViews, wall_variance: float) -> Floats:
        """Return the covariance of an estimated pose if walls are off with another variance, (3, 3)."""
        x = np.array([found.pose.x, found.pose.y, found.pose.theta, *found.found])
        return self._covariance(x, wall_variance)[:3, :3]

    def _covariance(self, x: Floats, wall_variance: float) -> Floats:
        inverse = np.linalg.inv(self._normal(x, wall_variance)[0])
        return np.asarray(0.5 * (inverse + inverse.T))

    def _shown_variance(self, x: Floats, covariance: Floats, wall_variance: float) -> float:
        """Return the variance of the walls' own errors that their residuals show; see `wall_variance_shown`."""
        sums = self._sums(x, wall_variance)
        means = sums.wall_sums / sums.weights[:, None]
        spreads = ((means[:, :-1] @ covariance) * means[:, :-1]).sum(axis=1)
        free = np.maximum(0.0, 1.0 - spreads / (wall_variance + 1.0 / sums.weights))
        found = USUAL_WALLS * USUAL_WALL_ERROR**2 + float(np.sum(means[:, -1] ** 2 - free / sums.weights))
        count = USUAL_WALLS + float(free.sum())
        unsure = UNSEEN_ERROR * (1.0 + 2.0 / max(1.0, count - 2.0))
        return unsure * max(found / count, LEAST_WALL_ERROR**2)

    def _normal(self, x: Floats, wall_variance: float) -> tuple[Floats, Floats]:
        """Return the normal matrix and the gradient at pose and variates, (3 + 3 u, 3 + 3 u) and (3 + 3 u,)."""
        views, sums = self.views, self._sums(x, wall_variance)
        own, root, size = sums.own, views.root, len(x)
        by_view = root.reshape(len(views), 3, -1)
        normal, gradient = np.zeros((size, size)), np.zeros(size)
        normal[:3, :3], gradient[:3] = own[:, :3, :3].sum(axis=0), own[:, :3, 6].sum(axis=0)
        across = own[:, 3:6, :3].reshape(-1, 3).T @ root
        normal[:3, 3:], normal[3:, :3] = across, across.T
        normal[3:, 3:] = root.T @ (own[:, 3:6, 3:6] @ by_view).reshape(root.shape)
        gradient[3:] = own[:, 3:6, 6].reshape(-1) @ root
        if wall_variance > 0.0:
            apart = sums.wall_sums / (sums.weights + 1.0 / wall_variance)[:, None]
            normal -= sums.wall_sums[:, :-1].T @ apart[:, :-1]
            gradient -= apart[:, :-1].T @ sums.wall_sums[:, -1]
        prior = np.arange(3, size)
        normal[prior, prior] += 1.0
        gradient[prior] += x[prior]
        normal[[0, 1], [0, 1]] += SPRING
        return normal, gradient

    def _sums(self, x: Floats, wall_variance: float) -> _Sums:
        """Add up what all views show at pose and variates."""
        views, seen, walls = len(self.views), self.seen, int(self.number.max(initial=-1)) + 1
        shifts = (self.views.root @ (x[3:] - self.views.found)).reshape(-1, 3)
        pose = record(POSE, x=x[0], y=x[1], theta=x[2])
        own, weights = np.zeros((views, 7, 7)), np.zeros(walls)
        wall_sums, of_views = np.zeros((walls, 4)), np.zeros((walls, 3 * views))
        by_views = SeenByViews(seen, self.walls, self.number, self.origins)
        add_views(by_views, shifts, pose, wall_variance, own, wall_sums, of_views, weights)
        return _Sums(own, np.hstack([wall_sums[:, :3], of_views @ self.views.root, wall_sums[:, 3:]]), weights)


@dataclass(frozen=True, slots=True)
class _Sums:
    """Weighted sums over all that views show.

    Attributes
    ----------
    own : (v, 7, 7)
        By view, of products of the derivatives by the pose, by that of the view, and the residual.
    wall_sums : (w, 3 + 3 u + 1)
        By wall, of the derivatives of offsets by pose and variates, the residuals last.
    weights : (w,)
        By wall.
    """

    own: Floats
    wall_sums: Floats
    weights: Floats
