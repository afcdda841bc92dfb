"""The laser's pose and the robot's, and covariances of 3 x 3 and of ROS's 6 x 6."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

Covariance = list[list[float]]
"""Of additive (x, y, theta) in the map frame: 3 rows; m^2, m rad, rad^2."""

_PLANAR = (0, 1, 5)  # x, y and the turn about z among ROS's six


class Pose(NamedTuple):
    """The pose of frame b in frame a: metres, radians, counter-clockwise; ``p_a = R(theta) p_b + [x, y]``."""

    x: float
    y: float
    theta: float

    @classmethod
    def of(cls, told: Mapping[str, float]) -> Pose:
        """Return the pose of an answer."""
        return cls(told["x"], told["y"], told["theta"])

    def then(self, other: Pose) -> Pose:
        """Return a_from_c of this a_from_b and of b_from_c."""
        c, s = math.cos(self.theta), math.sin(self.theta)
        theta = math.remainder(self.theta + other.theta, math.tau)
        return Pose(self.x + c * other.x - s * other.y, self.y + s * other.x + c * other.y, theta)

    def inverse(self) -> Pose:
        """Return b_from_a."""
        c, s = math.cos(self.theta), math.sin(self.theta)
        return Pose(-c * self.x - s * self.y, s * self.x - c * self.y, -self.theta)


def base_from_laser(map_from_laser: Pose, covariance: Covariance | None, mount: Pose) -> tuple[Pose, Covariance | None]:
    """Return where the robot is, given where its laser is.

    Parameters
    ----------
    map_from_laser : Pose
        Of the answer.
    covariance : 3 x 3 or None
        Of the answer.
    mount : Pose
        base_from_laser: where the laser sits on the robot.

    Returns
    -------
    Pose
        map_from_base.
    3 x 3 or None
        Its covariance: the turn moves the robot about the laser.
    """
    return _carried(map_from_laser, covariance, mount.inverse())


def laser_from_base(map_from_base: Pose, covariance: Covariance | None, mount: Pose) -> tuple[Pose, Covariance | None]:
    """Return where the laser is, given where the robot is, for a prior; parameters as of `base_from_laser`."""
    return _carried(map_from_base, covariance, mount)


def covariance_to_ros(covariance: Covariance | None) -> list[float]:
    """Return 36 numbers as PoseWithCovariance has them; all 0, not known, where there is none."""
    full = [0.0] * 36
    if covariance is not None:
        for i, row in zip(_PLANAR, covariance, strict=True):
            for j, value in zip(_PLANAR, row, strict=True):
                full[6 * i + j] = float(value)
    return full


def covariance_from_ros(covariance: Sequence[float]) -> Covariance | None:
    """Return the part in the plane of PoseWithCovariance's 36 numbers; None where all of it is 0, not known.

    Raises
    ------
    ValueError
        When there are not 36.
    """
    if len(covariance) != 36:
        raise ValueError(f"expected 36 numbers, found {len(covariance)}")
    planar = [[float(covariance[6 * i + j]) for j in _PLANAR] for i in _PLANAR]
    return planar if any(value != 0.0 for row in planar for value in row) else None


def _carried(pose: Pose, covariance: Covariance | None, to: Pose) -> tuple[Pose, Covariance | None]:
    moved = pose.then(to)
    if covariance is None:
        return moved, None
    # d(x, y) of what is carried along, for a small turn: 90 degrees on from where it is.
    jacobian = ((1.0, 0.0, pose.y - moved.y), (0.0, 1.0, moved.x - pose.x), (0.0, 0.0, 1.0))
    half = [[sum(j[k] * covariance[k][n] for k in range(3)) for n in range(3)] for j in jacobian]
    return moved, [[sum(row[k] * j[k] for k in range(3)) for j in jacobian] for row in half]
