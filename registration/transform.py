"""Rigid transforms of the plane, and the one place where angles are wrapped."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

MOST_TURNED = 4.0 * math.tau  # rad


def wrap_angle(angle: float) -> float:
    """Return the same angle in (-pi, pi].

    Parameters
    ----------
    angle : float
        Radians, any finite value.
    """
    wrapped = math.remainder(angle, math.tau)
    return math.pi if wrapped <= -math.pi else wrapped


@dataclass(frozen=True, slots=True)
class RigidTransform:
    """The pose of frame b in frame a: ``p_a = R(theta) p_b + [x, y]``.

    Name instances ``a_from_b``; then ``a_from_b.compose(b_from_c)`` is ``a_from_c``.

    Attributes
    ----------
    x, y : float
        Metres.
    theta : float
        Radians, counter-clockwise, in (-pi, pi]. Up to four turns are wrapped; beyond that is a
        `ValueError`, because the angle is likely in degrees.
    """

    x: float
    y: float
    theta: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.x) and math.isfinite(self.y) and math.isfinite(self.theta)):
            raise ValueError(f"expected finite x, y and theta, found ({self.x:g}, {self.y:g}, {self.theta:g})")
        if abs(self.theta) > MOST_TURNED:
            radians = math.radians(self.theta)
            raise ValueError(f"expected theta in radians, found {self.theta:g}; if these are degrees, give {radians:g}")
        if not -math.pi < self.theta <= math.pi:
            object.__setattr__(self, "theta", wrap_angle(self.theta))

    def compose(self, other: RigidTransform) -> RigidTransform:
        """Return the transform that applies `other` first, then this one."""
        c, s = math.cos(self.theta), math.sin(self.theta)
        return RigidTransform(
            self.x + c * other.x - s * other.y,
            self.y + s * other.x + c * other.y,
            self.theta + other.theta,
        )

    def shifted(self, x: float, y: float) -> RigidTransform:
        """Return the transform with a translation of so many metres added."""
        return RigidTransform(self.x + x, self.y + y, self.theta)

    def inverse(self) -> RigidTransform:
        """Return the transform that undoes this one."""
        c, s = math.cos(self.theta), math.sin(self.theta)
        return RigidTransform(-c * self.x - s * self.y, s * self.x - c * self.y, -self.theta)

    def carry(self, covariance: ArrayLike, by: RigidTransform) -> NDArray[np.float64]:
        """Return the covariance of ``self.compose(by)``, where `by` is known exactly.

        Parameters
        ----------
        covariance : (3, 3)
            Of this pose: additive (x, y, theta); m^2, m rad, rad^2.
        by : RigidTransform

        Returns
        -------
        (3, 3)
        """
        there = self.compose(by)
        # A small turn moves what is fixed to this frame about its origin, 90 degrees on from where it is.
        about = np.eye(3)
        about[0, 2], about[1, 2] = self.y - there.y, there.x - self.x
        carried: NDArray[np.float64] = about @ np.asarray(covariance, dtype=np.float64) @ about.T
        return carried

    def chi_square(self, other: RigidTransform, covariance: ArrayLike) -> float:
        """Return the squared Mahalanobis distance of two poses, which has three degrees of freedom.

        Parameters
        ----------
        other : RigidTransform
            Another pose in the same frame.
        covariance : (3, 3) array-like
            Of their difference, additive (x, y, theta) in that frame; m^2, m rad, rad^2.
        """
        difference = np.array([other.x - self.x, other.y - self.y, wrap_angle(other.theta - self.theta)])
        return float(difference @ np.linalg.solve(np.asarray(covariance, dtype=np.float64), difference))

    def apply(self, points: ArrayLike) -> NDArray[np.float64]:
        """Transform points, shape (..., 2), metres."""
        p = np.asarray(points, dtype=np.float64)
        c, s = math.cos(self.theta), math.sin(self.theta)
        moved = np.empty_like(p)
        moved[..., 0] = c * p[..., 0] - s * p[..., 1] + self.x
        moved[..., 1] = s * p[..., 0] + c * p[..., 1] + self.y
        return moved


IDENTITY = RigidTransform(0.0, 0.0, 0.0)
