"""Estimate a pose together with the distortion of its map: one that is stretched along an axis, or that leans.

Walls far from the sensor are off by more then, and on all sides of it in a pattern that no error of single walls has. A
pose that is fitted to such walls is off by several of its deviations.

A distorted map shows the point of a building that is at q from the sensor at ``q + D q``. The matrix D is symmetric,
since its other part is a turn::

    D = [[s + a, b], [b, s - a]]

s stretches, a stretches one axis and shrinks the other, b lets the axes lean. They are unknowns of the least squares,
each with a prior of expectation 0. The covariance of the pose includes what the walls do not show of the distortion.
"""

from __future__ import annotations

import math

import numpy as np

from registration import RigidTransform
from registration.layout import Floats
from registration.values import value

from ..context import SearchContext
from ..tuning import DOUBTING_DEVIATIONS, FACTOR_DEVIATIONS, LEAST_FACTOR, MOST_FACTOR
from .consensus_set import ConsensusSet
from .estimation import EstimatedPose
from .matched_lines import LinesAtPose, MatchedLines, are_few


@value(frozen=True, slots=True)
class Distortion:
    """A pose with the distortion of the map around it.

    Attributes
    ----------
    pose : RigidTransform
        Index frame from scan frame.
    covariance : (3, 3)
        Of additive (x, y, theta), with the uncertainty of the distortion.
    strain : float
        By how much the map is longer along `direction` than across, as a fraction of the length: ``2 hypot(a, b)``.
    deviation : float
        Its standard deviation.
    direction : float
        Radians from the x axis of the map, from -pi/2 to pi/2.
    """

    pose: RigidTransform
    covariance: Floats
    strain: float
    deviation: float
    direction: float

    @property
    def large(self) -> bool:
        """Return whether the map is distorted by as much as a factor that a scan is searched with, beyond doubt."""
        return self.strain >= max(LEAST_FACTOR, DOUBTING_DEVIATIONS * self.deviation)


def fit_distortion(
    context: SearchContext,
    best: ConsensusSet,
    estimated: EstimatedPose,
    sensor: tuple[float, float],
    *,
    to_scale: bool,
) -> Distortion | None:
    """Fit a pose and the distortion of the map to a consensus set by least squares, linearized at the estimated pose.

    Parameters
    ----------
    context : SearchContext
    best : ConsensusSet
    estimated : EstimatedPose
        Its pose, which its walls fix, and the deviation of their own errors.
    sensor : (float, float)
        The position of the sensor in the scan frame, metres. The frame is fixed to the sensor.
    to_scale : bool
        True if the scan was put to scale by a factor. Then s has the uncertainty of that, with the greatest factor as
        its deviation. Otherwise that is the least factor which would have been found, as always of a and b.

    Returns
    -------
    Distortion or None
        None where each unknown of the distortion is within `FACTOR_DEVIATIONS` of its deviations of 0, and with
        hundreds of lines.
    """
    if not are_few(best):
        return None
    lines = MatchedLines.of(context, best, estimated.wall_sigma)
    at = lines.at(estimated.pose)
    (x, y), (to_x, to_y) = estimated.pose.apply(np.array([sensor, (0.0, 0.0)]))
    of_offsets = np.hstack([at.of_pose, _offsets_of_distortion(at, x - to_x, y - to_y)])
    of_sines = np.hstack([at.angle_of_pose, _sines_of_distortion(at)])
    normal, right = lines.normal_equations(at.offsets, of_offsets, at.sines, of_sines)
    deviations = np.array([MOST_FACTOR if to_scale else LEAST_FACTOR, LEAST_FACTOR, LEAST_FACTOR])
    normal[3:, 3:] += np.diag(deviations**-2)
    covariance: Floats = np.linalg.pinv(normal, hermitian=True).astype(np.float64)
    solution = covariance @ right
    shown = np.abs(solution) > FACTOR_DEVIATIONS * np.sqrt(np.diag(covariance))
    if not shown[4 if to_scale else 3 :].any():
        return None
    x, y, turn, _, a, b = solution.tolist()
    pose, strain, direction = estimated.pose, 2.0 * math.hypot(a, b), 0.5 * math.atan2(b, a)
    of_strain = 2.0 * np.array([math.cos(2.0 * direction), math.sin(2.0 * direction)])
    return Distortion(
        pose=RigidTransform(pose.x + x, pose.y + y, pose.theta + turn),
        covariance=covariance[:3, :3],
        strain=strain,
        deviation=math.sqrt(of_strain @ covariance[4:, 4:] @ of_strain),
        direction=direction,
    )


def _offsets_of_distortion(at: LinesAtPose, x: float, y: float) -> Floats:
    """Return the derivatives of the lines' offsets by s, a and b, (n, 3), if the map is distorted around a place."""
    return _strained(at, at.x - x, at.y - y)


def _sines_of_distortion(at: LinesAtPose) -> Floats:
    """Return the derivatives of the sines of the lines' angles by s, a and b, (n, 3)."""
    return _strained(at, at.dx, at.dy)


def _strained(at: LinesAtPose, x: Floats, y: Floats) -> Floats:
    """Return by how much vectors (n,) move to the left of the walls for each of s, a and b, (n, 3)."""
    dx, dy = at.wall_dx, at.wall_dy
    return np.stack([dx * y - dy * x, -dy * x - dx * y, dx * x - dy * y], axis=1)
