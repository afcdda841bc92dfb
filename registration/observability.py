"""Which directions of the plane a set of pairs leaves free."""

from __future__ import annotations

import math
from dataclasses import dataclass

from .chi_square import chi_square_quantile
from .correspondences import Correspondences
from .joint import JointSums
from .kernels import eigen2
from .kernels.matrices import PARALLEL_RATIO
from .kernels.pairs import angle_chi_square
from .layout import Floats

THREE_SIGMA_TAIL = math.erfc(3.0 / math.sqrt(2.0))

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
    direction : (float, float), unit vector in the map frame, or None
        Along which the translation is free; None when nothing is, or when it is the rotation (segments that are taken
        to have no spread, all through one point).
    slack : float
        How far in metres the translation may move along `direction` and fit no worse by three standard deviations;
        inf for lines that are parallel to rounding.
    """

    degenerate: bool
    parallel: bool = False
    direction: tuple[float, float] | None = None
    slack: float = 0.0


def are_parallel(pairs: Correspondences, inverse_variances: Floats) -> bool:
    """Tell whether all lines are parallel within three standard deviations of what is known of their angles.

    For two lines that is what it says; for more, whether their directions differ as those of parallel lines do by
    noise in 99.73 % of cases. A pair knows its angle with the information w s of its weight and spread, and of the
    common direction ``sum w s sin^2`` is least: a chi-square.

    Parameters
    ----------
    pairs : Correspondences
    inverse_variances : (n,) 1/m^2
        Of the offsets; those of 0 do not count.
    """
    unlike, count = angle_chi_square(pairs.rows, inverse_variances)
    return count < 2 or bool(unlike <= chi_square_quantile(count - 1, THREE_SIGMA_TAIL))


def find_freedom(used: JointSums, noise: JointSums | None, theta: float, *, parallel: bool) -> Freedom:
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
    parallel : bool
        Whether the lines are parallel within the noise.
    """
    small, big, *axis = eigen2(*used.normal_moments)
    if small <= PARALLEL_RATIO * big:
        return Freedom(True, True, _signed(*axis), math.inf)
    if noise is not None and parallel:
        _, _, *axis = eigen2(*noise.normal_moments)
        return Freedom(True, True, _signed(*axis), _slack(noise, *axis))
    if not used.is_regular(theta, PARALLEL_RATIO):
        return Freedom(True)
    if noise is not None:
        # What is known of the translation when the rotation is not.
        least, _, *axis = eigen2(*noise.marginal(theta))
        if least < MAX_DEVIATION**-2:
            return Freedom(True, False, _signed(*axis), _slack(noise, *axis))
    return Freedom(False)


def _slack(sums: JointSums, x: float, y: float) -> float:
    xx, xy, yy = sums.normal_moments
    curvature = x * (xx * x + xy * y) + y * (xy * x + yy * y)
    return SLACK / math.sqrt(curvature) if curvature > 0.0 else math.inf


def _signed(x: float, y: float) -> tuple[float, float]:
    """Of two opposite unit vectors return the one that points to the right, or straight up; x is not below 0."""
    return (-x, -y) if x <= 1e-12 and y < 0.0 else (x, y)
