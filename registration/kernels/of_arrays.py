"""The sums' kernels for calls from Python: they take arrays, because passing a single record from Python is slow."""

from __future__ import annotations

import numpy as np

from compiled import kernel

from ..layout import INFORMATION, Floats, Records
from .joint import joint_cost, joint_information, joint_solve
from .matrices import invert3_scaled
from .one_step import determinant_and_reliability, one_step_solve


@kernel
def full_matrix(symmetric: Records) -> Floats:
    """Return an array of one SYMMETRIC3 as (3, 3)."""
    m = symmetric[0]
    out = np.empty((3, 3), np.float64)
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
def covariance(sums: Records, theta: float) -> Floats:
    """Return the inverse of the information of (x, y, theta), (3, 3); see `invert3_scaled`."""
    out = np.empty(1, INFORMATION)
    joint_information(sums[0], theta, out[0])
    invert3_scaled(out[0], out[0])
    return full_matrix(out)


@kernel
def direction_measures(sums: Records) -> tuple[float, float]:
    """Do as `determinant_and_reliability`."""
    return determinant_and_reliability(sums[0])


@kernel
def solve_one_step(sums: Records, use_wahba: bool) -> tuple[float, float, float, bool]:
    """Do as `one_step_solve`."""
    return one_step_solve(sums[0], use_wahba)
