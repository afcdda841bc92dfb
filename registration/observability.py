"""Which directions of the plane a set of pairs leaves free."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from .chi_square import chi_square_quantile
from .correspondences import Correspondences
from .joint import JointSums
from .kernels.observability import FIXED, FREE, MAX_DEVIATION, PARALLEL, freedom
from .kernels.pairs import angle_chi_square
from .layout import Floats

__all__ = ["MAX_DEVIATION", "THREE_SIGMA_TAIL", "Freedom", "are_parallel", "find_freedom"]

THREE_SIGMA_TAIL = math.erfc(3.0 / math.sqrt(2.0))


@dataclass(frozen=True, slots=True)
class Freedom:
    """The unobservable part of the pose.

    Attributes
    ----------
    degenerate : bool
    parallel : bool
        All directions are the same to within rounding or noise, and a degree of freedom is lost.
    direction : (float, float), unit vector in the map frame, or None
        Along which the translation is free; None when nothing is, or when it is the rotation (segments that are taken
        to have no spread, all through one point).
    slack : float
        Distance in metres that the translation may move along `direction` and fit no worse by three standard
        deviations; inf for lines that are parallel to rounding.
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
    return bool(unlike <= most_parallel(count))


def most_parallel(count: int) -> float:
    """Return the chi-square of their angles up to which so many lines are parallel; inf for fewer than two."""
    return chi_square_quantile(count - 1, THREE_SIGMA_TAIL) if count > 1 else math.inf


def most_parallel_up_to(count: int) -> Floats:
    """Return the same for each number of lines up to `count` and at most twice as many, (k,)."""
    return _most_parallel(1 << count.bit_length())


@lru_cache
def _most_parallel(count: int) -> Floats:
    most = np.array([most_parallel(k) for k in range(count)])
    most.setflags(write=False)
    return most


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
        True if the lines are parallel within the noise.
    """
    weighing = used if noise is None else noise
    what, x, y, slack = freedom(used.compensated, weighing.compensated, float(theta), noise is not None, parallel)
    direction = _signed(x, y) if what in (FREE, PARALLEL) else None
    return Freedom(what != FIXED, what == PARALLEL, direction, slack)


def _signed(x: float, y: float) -> tuple[float, float]:
    """Of two opposite unit vectors return the one that points to the right, or straight up; x is not below 0."""
    return (-x, -y) if x <= 1e-12 and y < 0.0 else (x, y)
