"""The likelihood field of a map: how near each place is to a wall, for points of a scan without direction.

Thrun, Burgard and Fox, *Probabilistic Robotics*, 6.4, have it in Monte Carlo localization; the pyramid of its maxima is
that of Hess et al., *Real-Time Loop Closure in 2D LIDAR SLAM*, ICRA 2016.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from registration.layout import Floats, Records

from ..layout import ENDS, as_records
from .grids import field_shape
from .kernels.likelihood_field import stamp_walls
from .tuning import FIELD_DEVIATION, FIELD_LEVELS


class LikelihoodField(NamedTuple):
    """The likelihood of points all over a map.

    Attributes
    ----------
    shape : (1,) of `GRID_SHAPE`
    pyramid : (levels, rows, columns) uint8
        On level 0 ``255 exp(-d^2 / 2 sigma^2)`` in the middle of each cell, where d is the distance to the nearest
        wall and sigma `FIELD_DEVIATION`. On level k the greatest value of the 2^k by 2^k cells up and to the right.
    """

    shape: Records
    pyramid: NDArray[np.uint8]


def likelihood_field(ends: Floats) -> LikelihoodField | None:
    """Return the likelihood field of walls from their ends (m, 4), metres; None where the map is too large for one."""
    shape = field_shape(ends)
    if shape is None:
        return None
    rows, columns = int(shape["rows"][0]), int(shape["columns"][0])
    pyramid = np.zeros((FIELD_LEVELS, rows, columns), np.uint8)
    stamp_walls(as_records(ENDS, ends), FIELD_DEVIATION, shape, pyramid[0])
    for k in range(1, FIELD_LEVELS):
        half = 1 << (k - 1)
        pyramid[k] = pyramid[k - 1]
        np.maximum(pyramid[k][:, :-half], pyramid[k - 1][:, half:], out=pyramid[k][:, :-half])
        wide = pyramid[k].copy()
        np.maximum(pyramid[k][:-half], wide[half:], out=pyramid[k][:-half])
    return LikelihoodField(shape, pyramid)
