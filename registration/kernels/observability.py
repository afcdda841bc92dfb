"""Which directions of the plane a set of pairs leaves free, by its sums."""

from __future__ import annotations

import math

import numpy as np

from compiled import kernel

from ..layout import INFORMATION, Records
from .joint import joint_information
from .matrices import PARALLEL_RATIO, eigen2, is_regular3
from .records import keep_alive

MAX_DEVIATION = 0.5  # m; a translation less certain than this in some direction is not fixed
SLACK = 3.0  # standard deviations that a fit may move and still be one

# The freedom that a set of pairs leaves: none; one direction of the translation; the same because all lines are
# parallel; the rotation.
FIXED, FREE, PARALLEL, TURNING = range(4)


@kernel
def freedom(
    used: Records, noise: Records, theta: float, with_noise: bool, parallel: bool
) -> tuple[int, float, float, float]:
    """Tell what the lines leave free, the direction in which they do, and how far that is, metres.

    Parameters
    ----------
    used, noise : (2,) JOINT_SUMS
        With the weights of the estimator, and with 1 / variance, about the centres of both sets.
    theta : float
        The rotation, radians.
    with_noise : bool
        True if `noise` counts.
    parallel : bool
        True if the lines are parallel within the noise.
    """
    small, big, x, y = eigen2(used[0].xx, used[0].xy, used[0].yy)
    if small <= PARALLEL_RATIO * big:
        return PARALLEL, x, y, math.inf
    f = noise[0]
    if with_noise and parallel:
        _, _, x, y = eigen2(f.xx, f.xy, f.yy)
        return PARALLEL, x, y, _slack(noise, x, y)
    out = np.empty(1, INFORMATION)
    joint_information(used[0], theta, out[0])
    regular = is_regular3(out[0], PARALLEL_RATIO)
    least = math.inf
    if regular and with_noise:
        joint_information(f, theta, out[0])
        least, x, y = _least_known(out)
    keep_alive(out)
    if not regular:
        return TURNING, 0.0, 0.0, 0.0
    if least < MAX_DEVIATION**-2:
        return FREE, x, y, _slack(noise, x, y)
    return FIXED, 0.0, 0.0, 0.0


@kernel
def _least_known(information: Records) -> tuple[float, float, float]:
    """Return what is known of the translation where it is least, when the rotation is not known, and that direction."""
    f = information[0]
    left = (f.xx - f.xt * f.xt / f.tt, f.xy - f.xt * f.yt / f.tt, f.yy - f.yt * f.yt / f.tt)
    least, _, x, y = eigen2(left[0], left[1], left[2])
    return least, x, y


@kernel
def _slack(sums: Records, x: float, y: float) -> float:
    f = sums[0]
    curvature = x * (f.xx * x + f.xy * y) + y * (f.xy * x + f.yy * y)
    return SLACK / math.sqrt(curvature) if curvature > 0.0 else math.inf
