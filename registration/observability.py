"""Freedom that a set of pairs leaves, and the limit up to which lines count as parallel, by noise alone."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum
from functools import lru_cache

import numpy as np
from scipy.special import chdtri

from .correspondences import Correspondences
from .kernels.sums import MAX_DEVIATION, PARALLEL_RATIO
from .layout import Floats
from .sums import TRANSLATION, eigen2, information_of

SLACK = 3.0  # standard deviations that a fit may move and still be one

THREE_SIGMA_TAIL = math.erfc(3.0 / math.sqrt(2.0))


@lru_cache(maxsize=4096)
def chi_square_quantile(dof: int, tail: float) -> float:
    """Return what chi-square of `dof` degrees of freedom exceeds with the probability `tail`."""
    return float(chdtri(dof, tail))


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


class Free(Enum):
    """Free are: nothing; one direction of the translation; the same as all lines are parallel; the rotation."""

    NOTHING = 0
    DIRECTION = 1
    PARALLEL = 2
    ROTATION = 3


@dataclass(frozen=True, slots=True)
class Freedom:
    """The freedom that a set of pairs leaves."""

    what: Free
    direction: tuple[float, float] = (0.0, 0.0)  # unit vector in the map frame, to the right or straight up
    slack: float = 0.0  # m, how far the pose may move along it


def freedom(pairs: Correspondences, used: Floats, noise: tuple[Floats, Floats] | None, theta: float) -> Freedom:
    """Return what pairs leave free at a rotation. That is a question of noise, and not of how a caller weighs.

    Parameters
    ----------
    pairs : Correspondences
        About the centres of both sets.
    used : (18,)
        Joint sums with the weights of the estimator.
    noise : ((n,), (18,)) or None
        The weights 1 / variance, and the joint sums with them; None where these are not known.
    theta : float
    """
    small, big, x, y = eigen2(*used[TRANSLATION].tolist())
    if small <= PARALLEL_RATIO * big:
        return _free(Free.PARALLEL, x, y, 0.0)
    if noise is not None and _angle_chi_square(pairs, noise[0]) <= most_parallel(len(pairs)):
        xx, xy, yy = noise[1][TRANSLATION].tolist()
        _, _, x, y = eigen2(xx, xy, yy)
        return _free(Free.PARALLEL, x, y, x * (xx * x + xy * y) + y * (xy * x + yy * y))
    information = information_of(used, theta)
    if not _is_regular(information):
        return Freedom(Free.ROTATION)
    if noise is None:
        return Freedom(Free.NOTHING)
    f = information if noise[1] is used else information_of(noise[1], theta)
    (xx, xy, xt), (_, yy, yt), (_, _, tt) = f.tolist()
    # The translation, as far as it is known without the rotation.
    least, _, x, y = eigen2(xx - xt * xt / tt, xy - xt * yt / tt, yy - yt * yt / tt)
    if least >= MAX_DEVIATION**-2:
        return Freedom(Free.NOTHING)
    return _free(Free.DIRECTION, x, y, x * (xx * x + xy * y) + y * (xy * x + yy * y))


def _free(what: Free, x: float, y: float, curvature: float) -> Freedom:
    sign = -1.0 if x <= 1e-12 and y < 0.0 else 1.0
    return Freedom(what, (sign * x, sign * y), SLACK / math.sqrt(curvature) if curvature > 0.0 else math.inf)


def _angle_chi_square(pairs: Correspondences, weights: Floats) -> float:
    """Return the smaller eigenvalue of ``sum w s d d'`` over the map lines' directions d.

    That is ``sum w s sin^2`` of the angles to the direction from which it is least, s being the spread.
    """
    angle, (dx, dy) = weights * pairs.spreads, pairs.map_directions.T
    along = angle * dx
    xx, xy, yy = float(along @ dx), float(along @ dy), float((angle * dy) @ dy)
    return max(0.0, 0.5 * (xx + yy) - math.hypot(0.5 * (xx - yy), xy))


def _is_regular(matrix: Floats) -> bool:
    """Tell whether a matrix, scaled to a unit diagonal, has only eigenvalues over `PARALLEL_RATIO`.

    By Sylvester's law of inertia: with the least taken off the diagonal the pivots stay positive.
    """
    (xx, xy, xt), (_, yy, yt), (_, _, tt) = matrix.tolist()
    if not (xx > 0.0 and yy > 0.0 and tt > 0.0):
        return False
    a, b, c = xy / math.sqrt(xx * yy), xt / math.sqrt(xx * tt), yt / math.sqrt(yy * tt)
    first = 1.0 - PARALLEL_RATIO
    second = first - a * a / first
    rest = c - a * b / first
    return bool(second > 0.0 and first - b * b / first - rest * rest / second > 0.0)
