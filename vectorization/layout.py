"""The records of the kernels; see `registration.layout` for how records are used.

The sensor is at the origin, and points come counter-clockwise about it.
"""

from __future__ import annotations

import numpy as np

# A measured point.
POINT = np.dtype(
    [
        ("x", "f8"), ("y", "f8"),  # m
        ("ray_x", "f8"), ("ray_y", "f8"),  # unit direction from the sensor; 0, 0 where noise has no direction
        ("range", "f8"),  # m, from the sensor; 0 where there is none
    ]
)  # fmt: skip

# Sums over points. Those of consecutive points are kept as running totals: the difference of two is the sums of the
# points between, so a line is fitted to any stretch in constant time. If noise has no direction the rays' sums are
# those of the unit matrix, and the ray's projection on any normal is 1.
SUMS = np.dtype(
    [
        ("count", "f8"),
        ("x", "f8"), ("y", "f8"),  # m
        ("xx", "f8"), ("xy", "f8"), ("yy", "f8"),  # m^2
        ("ray_xx", "f8"), ("ray_xy", "f8"), ("ray_yy", "f8"),
    ]
)  # fmt: skip

# A stretch of points.
PIECE = np.dtype(
    [
        ("first", "i8"), ("end", "i8"),  # indices of the first point and of the one after the last
    ]
)  # fmt: skip

# A line that was fitted to points. Abscissae are counted along (-ny, nx) from the foot of the normal.
FITTED = np.dtype(
    [
        ("nx", "f8"), ("ny", "f8"),  # unit normal, away from the sensor
        ("p", "f8"),  # m, distance from the sensor
        ("middle", "f8"),  # m, weighted mean of the points' abscissae
        ("spread", "f8"),  # m^2, their weighted second moment about it
        ("weight", "f8"),  # 1/m^2, of all points
        ("count", "f8"),  # of points
        ("chi2", "f8"),
        ("begin", "f8"), ("end", "f8"),  # m, abscissae of the ends
        ("first", "i8"), ("last", "i8"),  # indices of the points at the ends
    ]
)  # fmt: skip

# Properties of the scanner and its noise, and the least segments that are wanted. The variance of a point normal to a
# line is ``variance (n.u)^2 + floor``.
SCANNER = np.dtype(
    [
        ("increment", "f8"),  # rad, between neighbouring rays; 0 for points without rays
        ("sigma", "f8"),  # m, of ranges
        ("variance", "f8"),  # m^2, sigma^2
        ("floor", "f8"),  # m^2, what no wall is straighter than
        ("default_gap", "f8"),  # m, that neighbours without rays are apart at most
        ("max_gap", "f8"),  # m, that any neighbours are apart at most
        ("longest", "f8"),  # m, that a line is continued over
        ("least_points", "f8"), ("least_length", "f8"),  # of a segment; m
    ]
)  # fmt: skip
