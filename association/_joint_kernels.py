"""The joint estimator's sums as flat arrays of doubles, in the order of `registration.layout.JOINT_SUMS`."""

import numpy as np

from registration import kernels
from registration.compiling import kernel
from registration.layout import JOINT_SUMS, LINE, SEEN, SYMMETRIC3


@kernel
def joint_add(sums, nx, ny, p, mx, my, dx, dy, spread, weight, sign):
    """Add (`sign` 1) or remove (-1) one pair: map line ``(nx, ny, p)``, scan centroid, direction, second moment."""
    line = np.empty(1, LINE)
    line[0].dx = ny
    line[0].dy = -nx
    line[0].offset = p
    seen = np.empty(1, SEEN)
    seen[0].centroid_x = mx
    seen[0].centroid_y = my
    seen[0].dx = dx
    seen[0].dy = dy
    seen[0].spread = spread
    kernels.joint_add(sums.view(JOINT_SUMS)[0], line[0], seen[0], weight, sign)


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
