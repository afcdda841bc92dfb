"""Compiled closed forms for small symmetric matrices, with no more rounding than an eigenvalue routine has."""

import math

import numpy as np

from .compiling import kernel


@kernel
def eigen2(a, b, d):
    """Return both eigenvalues of ``[[a, b], [b, d]]``, none below 0, the smaller first, and the smaller's axis."""
    big = 0.5 * (a + d) + math.sqrt(0.25 * (a - d) * (a - d) + b * b)
    small = max(0.0, a * d - b * b) / big if big > 0.0 else 0.0
    angle = 0.5 * math.atan2(-2.0 * b, d - a)
    return small, big, math.cos(angle), math.sin(angle)


@kernel
def is_regular3(m, least):
    """Tell whether a symmetric 3 x 3 matrix, scaled to a unit diagonal, has only eigenvalues over `least`.

    By Sylvester's law of inertia: with `least` taken off the diagonal the pivots stay positive.
    """
    if not (m[0, 0] > 0.0 and m[1, 1] > 0.0 and m[2, 2] > 0.0):
        return False
    a = m[0, 1] / math.sqrt(m[0, 0] * m[1, 1])
    b = m[0, 2] / math.sqrt(m[0, 0] * m[2, 2])
    c = m[1, 2] / math.sqrt(m[1, 1] * m[2, 2])
    first = 1.0 - least
    second = first - a * a / first
    if not second > 0.0:
        return False
    rest = c - a * b / first
    return first - b * b / first - rest * rest / second > 0.0


@kernel
def invert3(m):
    """Return the inverse of a positive definite 3 x 3 matrix of unlike units: scaled to a unit diagonal, by pivots."""
    scale = np.empty(3)
    for i in range(3):
        scale[i] = 1.0 / math.sqrt(m[i, i])
    a = m[0, 1] * scale[0] * scale[1]
    b = m[0, 2] * scale[0] * scale[2]
    c = m[1, 2] * scale[1] * scale[2]
    # L D L' with a unit lower L: row k of `lower` is that of L's inverse.
    lower = np.zeros((3, 3))
    pivots = np.ones(3)
    pivots[1] = 1.0 - a * a
    l32 = (c - a * b) / pivots[1]
    pivots[2] = 1.0 - b * b - l32 * l32 * pivots[1]
    lower[0, 0] = 1.0
    lower[1, 0] = -a
    lower[1, 1] = 1.0
    lower[2, 0] = a * l32 - b
    lower[2, 1] = -l32
    lower[2, 2] = 1.0
    out = np.zeros((3, 3))
    for i in range(3):
        for j in range(3):
            for k in range(max(i, j), 3):
                out[i, j] += lower[k, i] * lower[k, j] / pivots[k]
            out[i, j] *= scale[i] * scale[j]
    return out


@kernel
def carried(covariance, x, y):
    """Return the covariance of (x, y, theta) of a frame whose origin is ``-(x, y)``, both turned, in the moved one.

    ``L C L'`` with ``L = [[1, 0, y], [0, 1, -x], [0, 0, 1]]``.
    """
    xx = covariance[0, 0] + 2.0 * y * covariance[0, 2] + y * y * covariance[2, 2]
    yy = covariance[1, 1] - 2.0 * x * covariance[1, 2] + x * x * covariance[2, 2]
    xy = covariance[0, 1] + y * covariance[1, 2] - x * covariance[0, 2] - x * y * covariance[2, 2]
    xt = covariance[0, 2] + y * covariance[2, 2]
    yt = covariance[1, 2] - x * covariance[2, 2]
    out = np.empty((3, 3))
    out[0, 0] = xx
    out[1, 1] = yy
    out[2, 2] = covariance[2, 2]
    out[0, 1] = xy
    out[1, 0] = xy
    out[0, 2] = xt
    out[2, 0] = xt
    out[1, 2] = yt
    out[2, 1] = yt
    return out
