"""Comparison of the pose of the robot's localizer, such as AMCL, with the pose that the scans give."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from registration import RigidTransform

from . import tuning
from .agreement import Observation, chi_square
from .clock import nanoseconds
from .frames import Frames
from .messages import PoseWithCovarianceStamped
from .odometry import OdometryHistory
from .reporting import PLANAR
from .transforms import Floats, FrameError, matrix_of, planar

UNKNOWN = np.diag([1.0, 1.0, math.pi])  # covariance of a pose without a valid one


@dataclass(frozen=True, slots=True, eq=False)
class _Estimate:
    stamp: int
    pose: RigidTransform
    covariance: Floats


class Watch:
    """Compares poses with ``amcl_pose``, or with the transform from the map to the odometry frame.

    Parameters
    ----------
    transforms : bool
        False where this node publishes the transform itself: it is not that of a localizer.
    """

    def __init__(self, *, transforms: bool = True) -> None:
        self._transforms = transforms
        self._amcl: _Estimate | None = None
        self._against = 0

    @property
    def lost(self) -> bool:
        """Return whether the localizer disagreed with the last scans that confirmed the pose."""
        return self._against >= tuning.LOST_SCANS

    def reset(self) -> None:
        """Forget what was compared, as after a new pose was published."""
        self._against = 0

    def take(self, message: PoseWithCovarianceStamped) -> None:
        """Take a message of ``amcl_pose``.

        Raises
        ------
        FrameError
            When it is no pose, or its covariance is none: the pose then counts with a wide one.
        """
        pose, _, _ = planar(matrix_of(message.pose.pose.position, message.pose.pose.orientation))
        covariance = np.reshape(np.asarray(message.pose.covariance, dtype=np.float64), (6, 6))[np.ix_(PLANAR, PLANAR)]
        valid = bool((np.abs(covariance) <= tuning.MAX_COVARIANCE).all())
        self._amcl = _Estimate(nanoseconds(message.header.stamp), pose, _positive(covariance) if valid else UNKNOWN)
        if not valid:
            raise FrameError(f"found a covariance with {np.abs(covariance).max():g}; 1 m and 102 degrees are assumed")

    def compare(
        self, scan: Observation, names: tuple[str, str], frames: Frames, odometry: OdometryHistory
    ) -> bool | None:
        """Return whether the localizer agrees with a scan that is agreed; None where it is not known.

        `names` are the frames of the map and of odometry. The result counts for `lost`.
        """
        estimate = self._at(scan, names, frames, odometry)
        if estimate is None or scan.pose is None:
            return None
        both = estimate.covariance + (0.0 if scan.covariance is None else scan.covariance)
        both = both + np.diag([tuning.LOCALIZER_SIGMA**2, tuning.LOCALIZER_SIGMA**2, tuning.LOCALIZER_SIGMA_THETA**2])
        agrees = chi_square(estimate.pose, scan.pose, both) <= tuning.AGREEING_CHI_SQUARE
        self._against = 0 if agrees else self._against + 1
        return agrees

    def _at(
        self, scan: Observation, names: tuple[str, str], frames: Frames, odometry: OdometryHistory
    ) -> _Estimate | None:
        matrix = frames.lookup(*names, scan.stamp) if self._transforms else None
        if matrix is not None and scan.odometry is not None:
            covariance = np.zeros((3, 3)) if self._amcl is None else self._amcl.covariance
            return _Estimate(scan.stamp, planar(matrix)[0].compose(scan.odometry), covariance)
        if self._amcl is None:
            return None
        step = odometry.between(self._amcl.stamp, scan.stamp)
        if step is None:
            return None
        return _Estimate(scan.stamp, self._amcl.pose.compose(step), self._amcl.pose.carry(self._amcl.covariance, step))


def _positive(covariance: Floats) -> Floats:
    """Return a covariance without negative variances."""
    values, vectors = np.linalg.eigh(0.5 * (covariance + covariance.T))
    positive: Floats = (vectors * np.maximum(values, 0.0)) @ vectors.T
    return positive
