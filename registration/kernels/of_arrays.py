"""What Python calls of the sums' kernels: they take arrays, as handing a single record over from Python is slow."""

from __future__ import annotations

import math

import numpy as np

from ..compiling import kernel
from ..layout import INFORMATION, SYMMETRIC3, Floats, Records
from .joint import joint_cost, joint_information, joint_solve
from .matrices import carried, invert3_scaled
from .one_step import one_step_solve


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
def covariance(sums: Records, theta: float) -> Floats:
    """Return the inverse of the information of (x, y, theta), (3, 3); see `invert3_scaled`."""
    out = np.empty(1, INFORMATION)
    joint_information(sums[0], theta, out[0])
    invert3_scaled(out[0], out[0])
    return full_matrix(out)


@kernel
def carried_matrix(covariance: Floats, theta: float, x: float, y: float) -> Floats:
    """Do as `carried` with a (3, 3) matrix, by a lever that is turned by `theta` as the frame is."""
    m = upper_triangle(covariance)
    c = math.cos(theta)
    s = math.sin(theta)
    carried(m[0], c * x - s * y, s * x + c * y, m[0])
    return full_matrix(m)


@kernel
def direction_moments(sums: Records) -> tuple[float, float, float, float]:
    """Return the paper's ``S_w``, ``S_x2``, ``S_y2`` and ``S_xy``."""
    return sums[0].w, sums[0].x2, sums[0].y2, sums[0].xy


@kernel
def solve_one_step(sums: Records, use_wahba: bool) -> tuple[float, float, float, bool]:
    """Do as `one_step_solve`."""
    return one_step_solve(sums[0], use_wahba)
