"""Closed forms for small symmetric matrices, records of type SYMMETRIC3 where they are 3 x 3."""

from __future__ import annotations

import math

from compiled import kernel

from ..layout import Record

# Below this ratio of the smaller to the larger eigenvalue rounding alone decides the smaller one's direction.
PARALLEL_RATIO = 1e-12

MIN_PIVOT = 1e-12  # of the determinant to the product of the diagonal; a smaller one is singular


@kernel
def eigen2(a: float, b: float, d: float) -> tuple[float, float, float, float]:
    """Return both eigenvalues of ``[[a, b], [b, d]]``, none below 0, the smaller first, and the smaller's axis.

    With no more rounding than an eigenvalue routine has.
    """
    big = 0.5 * (a + d) + math.sqrt(0.25 * (a - d) * (a - d) + b * b)
    small = max(0.0, a * d - b * b) / big if big > 0.0 else 0.0
    angle = 0.5 * math.atan2(-2.0 * b, d - a)
    return small, big, math.cos(angle), math.sin(angle)


@kernel
def is_regular3(m: Record, least: float) -> bool:
    """Tell whether a matrix, scaled to a unit diagonal, has only eigenvalues over `least`.

    By Sylvester's law of inertia: with `least` taken off the diagonal the pivots stay positive.
    """
    if not (m.xx > 0.0 and m.yy > 0.0 and m.tt > 0.0):
        return False
    a = m.xy / math.sqrt(m.xx * m.yy)
    b = m.xt / math.sqrt(m.xx * m.tt)
    c = m.yt / math.sqrt(m.yy * m.tt)
    first = 1.0 - least
    second = first - a * a / first
    if not second > 0.0:
        return False
    rest = c - a * b / first
    return first - b * b / first - rest * rest / second > 0.0


@kernel
def invert3(m: Record, out: Record) -> bool:
    """Write the inverse of a positive definite matrix to `out`, by cofactors; return False where it is singular."""
    a = m.yy * m.tt - m.yt * m.yt
    b = m.xt * m.yt - m.xy * m.tt
    d = m.xy * m.yt - m.xt * m.yy
    det = m.xx * a + m.xy * b + m.xt * d
    if not det > MIN_PIVOT * m.xx * m.yy * m.tt:
        return False
    # All are read before one is written: `out` may be `m`.
    yy = (m.xx * m.tt - m.xt * m.xt) / det
    yt = (m.xy * m.xt - m.xx * m.yt) / det
    tt = (m.xx * m.yy - m.xy * m.xy) / det
    out.xx = a / det
    out.xy = b / det
    out.xt = d / det
    out.yy = yy
    out.yt = yt
    out.tt = tt
    return True


@kernel
def invert3_scaled(m: Record, out: Record) -> None:
    """Write the inverse of a positive definite matrix to `out`, with no more rounding than its condition implies.

    Scaled to a unit diagonal, as its units are unlike, and by pivots. It has to be regular, see `is_regular3`.
    """
    # All are read before one is written: `out` may be `m`.
    scale_x = 1.0 / math.sqrt(m.xx)
    scale_y = 1.0 / math.sqrt(m.yy)
    scale_t = 1.0 / math.sqrt(m.tt)
    a = m.xy * scale_x * scale_y
    b = m.xt * scale_x * scale_t
    c = m.yt * scale_y * scale_t
    # L D L' with a unit lower L and the pivots 1, p and q.
    p = 1.0 - a * a
    l32 = (c - a * b) / p
    q = 1.0 - b * b - l32 * l32 * p
    # Of the inverse of L: its second row is -a, 1 and its third l31, -l32, 1.
    l31 = a * l32 - b
    # From 0.0, so that there is no -0.0.
    out.xx = (1.0 + a * a / p + l31 * l31 / q) * (scale_x * scale_x)
    out.xy = (0.0 - a / p - l31 * l32 / q) * (scale_x * scale_y)
    out.xt = (0.0 + l31 / q) * (scale_x * scale_t)
    out.yy = (1.0 / p + l32 * l32 / q) * (scale_y * scale_y)
    out.yt = (0.0 - l32 / q) * (scale_y * scale_t)
    out.tt = 1.0 / q * (scale_t * scale_t)


@kernel
def sandwich(c: Record, m: Record, out: Record) -> None:
    """Write the upper triangle of ``C M C`` to `out`, which may be `c`."""
    # Rows of C M.
    xx = c.xx * m.xx + c.xy * m.xy + c.xt * m.xt
    xy = c.xx * m.xy + c.xy * m.yy + c.xt * m.yt
    xt = c.xx * m.xt + c.xy * m.yt + c.xt * m.tt
    yx = c.xy * m.xx + c.yy * m.xy + c.yt * m.xt
    yy = c.xy * m.xy + c.yy * m.yy + c.yt * m.yt
    yt = c.xy * m.xt + c.yy * m.yt + c.yt * m.tt
    tx = c.xt * m.xx + c.yt * m.xy + c.tt * m.xt
    ty = c.xt * m.xy + c.yt * m.yy + c.tt * m.yt
    tt = c.xt * m.xt + c.yt * m.yt + c.tt * m.tt
    of_xx = xx * c.xx + xy * c.xy + xt * c.xt
    of_xy = xx * c.xy + xy * c.yy + xt * c.yt
    of_xt = xx * c.xt + xy * c.yt + xt * c.tt
    of_yy = yx * c.xy + yy * c.yy + yt * c.yt
    of_yt = yx * c.xt + yy * c.yt + yt * c.tt
    out.tt = tx * c.xt + ty * c.yt + tt * c.tt
    out.xx = of_xx
    out.xy = of_xy
    out.xt = of_xt
    out.yy = of_yy
    out.yt = of_yt


@kernel
def carried(covariance: Record, x: float, y: float, out: Record) -> None:
    """Write the covariance of (x, y, theta) of a frame whose origin is ``-(x, y)``, both turned, in the moved one.

    ``L C L'`` with ``L = [[1, 0, y], [0, 1, -x], [0, 0, 1]]``.
    """
    c = covariance  # `out` may be the same: each is read before it is written
    out.xx = c.xx + 2.0 * y * c.xt + y * y * c.tt
    out.xy = c.xy + y * c.yt - x * c.xt - x * y * c.tt
    out.yy = c.yy - 2.0 * x * c.yt + x * x * c.tt
    out.xt = c.xt + y * c.tt
    out.yt = c.yt - x * c.tt
    out.tt = c.tt
