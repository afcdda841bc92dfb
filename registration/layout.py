"""The records of the kernels.

Arrays of these go in and out of kernels; ``rows[i].dx`` is field `dx` of element i there. A kernel changes the
element of an array: ``sums[0]`` of an array of length 1. Inside kernels an element is a bare pointer, which costs
nothing to hand on and does not keep its array alive: see `kernels.keep_alive`. Between Python and kernels whole arrays
go to and fro: handing over one element costs three microseconds.
"""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Floats: TypeAlias = NDArray[np.float64]
Records: TypeAlias = NDArray[np.void]  # an array of one of the types below
Record: TypeAlias = Any  # an element of one; type checkers cannot see its fields

LEAST_POINTS = 2.0  # behind all that is seen of one wall, if they were not counted

X, Y = 0, 1  # columns of an (n, 2) array of points or directions

# The ends of a segment.
SEGMENT = np.dtype([("begin_x", "f8"), ("begin_y", "f8"), ("end_x", "f8"), ("end_y", "f8")])  # m

# A map line, in the map frame.
LINE = np.dtype(
    [
        ("dx", "f8"), ("dy", "f8"),  # unit direction; the left normal is (-dy, dx)
        ("offset", "f8"),  # m, of the line from the origin along the left normal
    ]
)  # fmt: skip

# The measurement of a scan segment, in the scan frame.
SEEN = np.dtype(
    [
        ("dx", "f8"), ("dy", "f8"),  # unit direction
        ("centroid_x", "f8"), ("centroid_y", "f8"),  # m, mean of the points behind it
        ("spread", "f8"),  # m^2, their second moment along it
    ]
)  # fmt: skip

# Sums over pairs for the joint estimator: the upper triangle of Q in ``cost = x' Q x`` with ``x = [cos, sin, t_x, t_y,
# 1]``, named by c, s, x, y and 1; Q has the unit of the weights times that of the two factors of x, which m^2 goes with
# for c and s, m for a translation with them, and so on.
JOINT_SUMS = np.dtype(
    [
        ("cc", "f8"), ("cs", "f8"), ("cx", "f8"), ("cy", "f8"), ("c1", "f8"),
        ("ss", "f8"), ("sx", "f8"), ("sy", "f8"), ("s1", "f8"),
        ("xx", "f8"), ("xy", "f8"), ("x1", "f8"),
        ("yy", "f8"), ("y1", "f8"),
        ("one", "f8"),
        ("wahba_cos", "f8"), ("wahba_sin", "f8"),  # of the angle from scan to map, by the information of the angle
        ("count", "f8"),  # pairs
    ]
)  # fmt: skip

# Sums over pairs for the paper's estimator about a reference ``T_ref``, ``alpha_ref``: ``sum w`` times what the comment
# says, with ``r = p_map - p_scan - n_map . T_ref``, ``a = wrap(alpha - alpha_ref)``, ``v = d_map`` and ``P = r n_map``.
ONE_STEP_SUMS = np.dtype(
    [
        ("w", "f8"),  # 1
        ("x2", "f8"), ("y2", "f8"), ("xy", "f8"),  # v_x^2, v_y^2, v_x v_y
        ("px", "f8"), ("py", "f8"),  # P_x, P_y; m
        ("gap2", "f8"),  # r^2; m^2
        ("angle", "f8"), ("angle2", "f8"),  # a, a^2; rad, rad^2
        ("versine", "f8"), ("sine", "f8"),  # 1 - cos a, sin a
        ("count", "f8"),  # pairs, not weighted
    ]
)  # fmt: skip

# The upper triangle of a symmetric matrix of x, y (m) and theta (rad): a covariance, or its inverse, an information.
SYMMETRIC3 = np.dtype([("xx", "f8"), ("xy", "f8"), ("xt", "f8"), ("yy", "f8"), ("yt", "f8"), ("tt", "f8")])

# p_map = R(theta) p_scan + (x, y).
POSE = np.dtype(
    [
        ("theta", "f8"),  # rad
        ("x", "f8"), ("y", "f8"),  # m
    ]
)  # fmt: skip


def floats(rows: Records, *names: str) -> tuple[Floats, ...]:
    """Return fields of an array of records."""
    return tuple(rows[name] for name in names)


def record(dtype: np.dtype[Any], /, **values: float) -> Records:
    """Return an array of one record; what is not named is 0."""
    # numpy's own zeros of such a type go through its fields one by one: a bytearray takes a tenth of the time.
    out = np.frombuffer(bytearray(dtype.itemsize), dtype)
    for name, value in values.items():
        out[name] = value
    return out
