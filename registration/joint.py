"""The joint estimator: rotation and translation together by weighted least squares, from additive sums."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .correspondences import Correspondences
from .kernels import of_arrays
from .kernels.joint import joint_sums_compensated
from .layout import Floats
from .sums import CompensatedSums


@dataclass(frozen=True, slots=True, eq=False)
class JointSums(CompensatedSums):
    """All that the joint estimator needs of a set of pairs; adding or removing takes constant time whatever its size.

    For a pair, with the map line's normal ``n`` and offset ``p`` and the scan segment's centroid ``m``, direction ``d``
    and spread ``s``, the cost is ``w ((n . (R m + t) - p)^2 + s (n . R d)^2)``: for points that a segment was fitted to
    by least squares it is, to first order, the sum of their squared distances from the map line. Over a set it is
    ``x' Q x`` with ``x = [cos, sin, t_x, t_y, 1]``; the sums are the upper triangle of ``Q``, two sums of Wahba's angle
    (Eq. 15, weighted ``w s``), and the number of pairs.

    A solution is as good as ``Q`` in plain doubles, so keep the coordinates near the origin
    (`Correspondences.about`).

    Attributes
    ----------
    compensated : (2,) JOINT_SUMS
        Values and their errors, read-only; `values` (18,).
    """

    @classmethod
    def of_set(cls, pairs: Correspondences, weights: ArrayLike) -> JointSums:
        """Sum over all pairs, `weights` (n,) in 1/m^2; those of weight 0 do not count."""
        return cls(joint_sums_compensated(pairs.rows, np.ascontiguousarray(weights, dtype=np.float64)))

    @classmethod
    def of_pair(cls, pairs: Correspondences, index: int, weight: float) -> JointSums:
        """Sum over pair `index` alone, in constant time."""
        return cls(joint_sums_compensated(pairs.rows[index : index + 1], np.array([weight], dtype=np.float64)))

    def add(self, pairs: Correspondences, index: int, weight: float) -> JointSums:
        """Return the sums with one pair more."""
        return self + self.of_pair(pairs, index, weight)

    def remove(self, pairs: Correspondences, index: int, weight: float) -> JointSums:
        """Return the sums with one pair less; `weight` is the one that it was added with."""
        return self - self.of_pair(pairs, index, weight)

    def solve(self, start: float) -> tuple[float, Floats, bool]:
        """Minimise the cost.

        Parameters
        ----------
        start : float
            Radians. `Q` cannot tell a direction from its opposite: the minimum near this angle is taken.

        Returns
        -------
        theta : float
            Radians in (-pi, pi].
        translation : (2,) metres
            If all lines are parallel, the shortest.
        observable : bool
            False where all lines are parallel to rounding.
        """
        theta, x, y, _, observable = of_arrays.solve(self.compensated, float(start))
        return theta, np.array([x, y]), observable

    def cost(self, theta: float, translation: ArrayLike) -> float:
        """Return ``x' Q x`` at any transform: chi-square when the weights are 1 / variance."""
        x, y = np.asarray(translation, dtype=np.float64)
        return of_arrays.cost(self.compensated, float(theta), x, y)

    def information(self, theta: float) -> Floats:
        """Return the information of additive (x, y, theta) in the map frame at rotation `theta`, (3, 3)."""
        return of_arrays.information(self.compensated, float(theta))

    def covariance(self, theta: float) -> Floats:
        """Return the inverse of `information`, which has to be regular, (3, 3)."""
        return of_arrays.covariance(self.compensated, float(theta))
