"""What Python calls of the sums' kernels: they take arrays, as handing a single record over from Python is slow."""

from __future__ import annotations

import numpy as np

from ..compiling import kernel
from ..layout import INFORMATION, SYMMETRIC3, Floats, Records
from .joint import joint_cost, joint_information, joint_solve
from .matrices import carried, invert3_scaled, is_regular3
from .one_step import one_step_solve
from .records import keep_alive


@kernel
def full_matrix(symmetric: Records) -> Floats:
    """Return an array of one SYMMETRIC3 as (3, 3)."""
    m = symmetric[0]
    out = np.empty((3, 3))
    out[0, 0] = m.xx
    out[0, 1] = m.xy
    out[0, 2] = m.xt
    out[1, 0] = m.xy
    out[1, 1] = m.yy
    out[1, 2] = m.yt
    out[2, 0] = m.xt
    out[2, 1] = m.yt
    out[2, 2] = m.tt
    return out


@kernel
def solve(sums: Records, start: float) -> tuple[float, float, float, float, bool]:
    """Do as `joint_solve` from an angle."""
    return joint_solve(sums[0], start, False)


@kernel
def cost(sums: Records, theta: float, tx: float, ty: float) -> float:
    """Do as `joint_cost`."""
    return joint_cost(sums[0], theta, tx, ty)


@kernel
def information(sums: Records, theta: float) -> Floats:
    """Return the information of (x, y, theta), (3, 3); see `joint_information`."""
    out = np.empty(1, INFORMATION)
    joint_information(sums[0], theta, out[0])
    return full_matrix(out)


@kernel
def is_regular(sums: Records, theta: float, least: float) -> bool:
    """Tell whether the information of (x, y, theta) is; see `is_regular3`."""
    out = np.empty(1, INFORMATION)
    joint_information(sums[0], theta, out[0])
    regular = is_regular3(out[0], least)
    keep_alive(out)
    return regular


@kernel
def marginal(sums: Records, theta: float) -> tuple[float, float, float]:
    """Return the information of (x, y) when theta is not known, its elements xx, xy and yy."""
    out = np.empty(1, INFORMATION)
    f = out[0]
    joint_information(sums[0], theta, f)
    left = (f.xx - f.xt * f.xt / f.tt, f.xy - f.xt * f.yt / f.tt, f.yy - f.yt * f.yt / f.tt)
    keep_alive(out)
    return left


@kernel
def upper_triangle(matrix: Floats) -> Records:
    """Return the upper triangle of a (3, 3) matrix, an array of one SYMMETRIC3."""
    out = np.empty(1, SYMMETRIC3)
    m = out[0]
    m.xx = matrix[0, 0]
    m.xy = matrix[0, 1]
    m.xt = matrix[0, 2]
    m.yy = matrix[1, 1]
    m.yt = matrix[1, 2]
    m.tt = matrix[2, 2]
    return out


@kernel
def inverse(matrix: Floats) -> Floats:
    """Do as `invert3_scaled` with a (3, 3) matrix."""
    m = upper_triangle(matrix)
    invert3_scaled(m[0], m[0])
    return full_matrix(m)


@kernel
def carried_matrix(covariance: Floats, x: float, y: float) -> Floats:
    """Do as `carried` with a (3, 3) matrix."""
    m = upper_triangle(covariance)
    carried(m[0], x, y, m[0])
    return full_matrix(m)


@kernel
def normal_moments(sums: Records) -> tuple[float, float, float]:
    """Return ``sum w n n'``, its elements xx, xy and yy."""
    return sums[0].xx, sums[0].xy, sums[0].yy


@kernel
def direction_moments(sums: Records) -> tuple[float, float, float, float]:
    """Return the paper's ``S_w``, ``S_x2``, ``S_y2`` and ``S_xy``."""
    return sums[0].w, sums[0].x2, sums[0].y2, sums[0].xy


@kernel
def solve_one_step(sums: Records, use_wahba: bool) -> tuple[float, float, float, bool]:
    """Do as `one_step_solve`."""
    return one_step_solve(sums[0], use_wahba)
