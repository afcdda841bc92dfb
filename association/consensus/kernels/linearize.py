"""The residuals of the estimator's model, and their derivatives."""

from __future__ import annotations

import math

from compiled import kernel
from registration.layout import Floats, Records

# Unknowns after the sensor's place and the heading: offset along the rays; strain xx, yy, xy; rotation of the sensor.
OFFSET, STRAIN, TURN = 3, 4, 7
COLUMNS = 8


@kernel
def linearize(seen: Records, sensor: Floats, x: Floats, of_points: Floats, of_slopes: Floats) -> None:
    """Write the derivatives of each observation by the unknowns, and in the last column its residual.

    The model is that of `association.consensus.estimator`.

    Parameters
    ----------
    seen : (n,) of `OBSERVATION`
    sensor : (2,)
        The sensor's place in the scan frame.
    x : (COLUMNS,)
    of_points, of_slopes : (n, COLUMNS + 1)
        Written: of the centroids, metres, and of the directions, rad.
    """
    c = math.cos(x[2])
    s = math.sin(x[2])
    xx = x[STRAIN]
    yy = x[STRAIN + 1]
    xy = x[STRAIN + 2]
    for i in range(len(seen)):
        one = seen[i]
        a = of_points[i]
        b = of_slopes[i]
        nx = one.normal_x
        ny = one.normal_y
        # As the sensor would have seen it at the middle of its sweep.
        ct = math.cos(x[TURN] * one.time)
        st = math.sin(x[TURN] * one.time)
        mx = one.centroid_x - sensor[0]
        my = one.centroid_y - sensor[1]
        px = ct * mx - st * my
        py = st * mx + ct * my
        dx = ct * one.dx - st * one.dy - x[TURN] * one.pace * py
        dy = st * one.dx + ct * one.dy + x[TURN] * one.pace * px
        qx = c * px - s * py
        qy = s * px + c * py
        ex = c * dx - s * dy
        ey = s * dx + c * dy
        zx = qx + xx * qx + xy * qy
        zy = qy + xy * qx + yy * qy
        fx = ex + xx * ex + xy * ey
        fy = ey + xy * ex + yy * ey
        incidence = (nx * zx + ny * zy) / max(1e-6, math.hypot(zx, zy))
        by_turn = ny * qx - nx * qy
        a[0] = nx
        a[1] = ny
        a[2] = ny * zx - nx * zy
        a[OFFSET] = incidence
        a[STRAIN] = nx * qx
        a[STRAIN + 1] = ny * qy
        a[STRAIN + 2] = nx * qy + ny * qx
        a[TURN] = by_turn * one.time
        a[COLUMNS] = nx * (zx + x[0]) + ny * (zy + x[1]) + x[OFFSET] * incidence - one.offset
        b[0] = 0.0
        b[1] = 0.0
        b[2] = ny * fx - nx * fy
        b[OFFSET] = 0.0
        b[STRAIN] = nx * ex
        b[STRAIN + 1] = ny * ey
        b[STRAIN + 2] = nx * ey + ny * ex
        b[TURN] = (ny * ex - nx * ey) * one.time + by_turn * one.pace
        b[COLUMNS] = nx * fx + ny * fy
