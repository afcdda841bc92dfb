"""Which directions of the plane a set of pairs leaves free."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ._kernels import PARALLEL_RATIO
from .joint import JointSums

Floats = NDArray[np.float64]

MAX_DEVIATION = 0.5  # m; a translation less certain than this in some direction is not fixed
SLACK = 3.0  # standard deviations that a fit may move and still be one


@dataclass(frozen=True, slots=True)
class Freedom:
    """What is not fixed.

    Attributes
    ----------
    degenerate : bool
    parallel : bool
        All directions are the same to within rounding or noise, and a degree of freedom is lost.
    direction : (2,) unit vector in the map frame, or None
        Along which the translation is free; None when nothing is, or when it is the rotation (segments that are taken
        to have no spread, all through one point).
    slack : float
        How far in metres the translation may move along `direction` and fit no worse by three standard deviations;
        inf for lines that are parallel to rounding.
    """

    degenerate: bool
    parallel: bool = False
    direction: Floats | None = None
    slack: float = 0.0


def find_freedom(used: JointSums, noise: JointSums | None, theta: float) -> Freedom:
    """Tell whether the lines fix the transform, and what they leave free.

    Degenerate are lines that are parallel to rounding; or to three standard deviations of their angles; or that leave
    the translation in some direction a standard deviation over 0.5 m, where the translation is that of the scan
    segments' common centre, which is as certain wherever the frames have their origins.

    Parameters
    ----------
    used : JointSums
        With the weights of the estimator, about the centres of both sets.
    noise : JointSums or None
        The same with weights 1 / variance; None when there is no noise.
    theta : float
        The rotation, radians.
    """
    small, axes = np.linalg.eigh(used.normal_matrix)
    if small[0] <= PARALLEL_RATIO * small[1]:
        return Freedom(True, True, _signed(axes[:, 0]), math.inf)
    if noise is not None and noise.parallel:
        axis = _signed(np.linalg.eigh(noise.normal_matrix)[1][:, 0])
        return Freedom(True, True, axis, _slack(noise, axis))
    if _singular(used.information(theta)):
        return Freedom(True)
    if noise is not None:
        # What is known of the translation when the rotation is not: the Schur complement.
        information = noise.information(theta)
        coupling = information[:2, 2]
        marginal, axes = np.linalg.eigh(information[:2, :2] - np.outer(coupling, coupling) / information[2, 2])
        if marginal[0] < MAX_DEVIATION**-2:
            axis = _signed(axes[:, 0])
            return Freedom(True, False, axis, _slack(noise, axis))
    return Freedom(False)


def _singular(information: Floats) -> bool:
    """Tell whether a direction of (x, y, theta) is free, whatever the units."""
    diagonal = np.diag(information)
    if diagonal.min() <= 0.0:
        return True
    scale = 1.0 / np.sqrt(diagonal)
    return float(np.linalg.eigvalsh(information * np.outer(scale, scale))[0]) <= PARALLEL_RATIO


def _slack(sums: JointSums, axis: Floats) -> float:
    curvature = float(axis @ sums.normal_matrix @ axis)
    return SLACK / math.sqrt(curvature) if curvature > 0.0 else math.inf


def _signed(axis: Floats) -> Floats:
    """Of the two opposite unit vectors return the one that points to the right, or straight up."""
    return -axis if axis[0] < -1e-12 or (abs(axis[0]) <= 1e-12 and axis[1] < 0.0) else axis
