"""The joint estimator's sums as flat arrays of doubles, in the order of `registration.layout.JOINT_SUMS`."""

import numpy as np

from registration import kernels
from registration.compiling import kernel
from registration.layout import JOINT_SUMS, LINE, SYMMETRIC3

# The rows of `walls` and `scan`, see `_match_kernels`, as far as the sums read them.
WALL = np.dtype([*LINE.descr, ("others", "f8", 5)])
SCAN_SEGMENT = np.dtype(
    [
        ("dx", "f8"), ("dy", "f8"), ("before", "f8", 4),
        ("centroid_x", "f8"), ("centroid_y", "f8"), ("spread", "f8"), ("after", "f8", 7),
    ]
)  # fmt: skip


@kernel
def joint_solve(sums, theta0, use_wahba):
    """Minimise the cost; see `registration.kernels.joint_solve`."""
    return kernels.joint_solve(sums.view(JOINT_SUMS)[0], theta0, use_wahba)


@kernel
def joint_information(sums, theta, out):
    """Write the 3 x 3 information matrix of additive (t_x, t_y, theta) in the map frame to `out`."""
    record = np.empty(1, SYMMETRIC3)
    f = record[0]
    kernels.joint_information(sums.view(JOINT_SUMS)[0], theta, f)
    out[0, 0] = f.xx
    out[0, 1] = f.xy
    out[1, 0] = f.xy
    out[0, 2] = f.xt
    out[2, 0] = f.xt
    out[1, 1] = f.yy
    out[1, 2] = f.yt
    out[2, 1] = f.yt
    out[2, 2] = f.tt
    kernels.keep_alive(record)
