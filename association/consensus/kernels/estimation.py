"""The normal equations of the estimator's model, their solution, and what it would be without each wall.

The model and its unknowns are those of `association.consensus.estimator`.
"""

from __future__ import annotations

import math

import numpy as np

from compiled import kernel
from registration.layout import Floats

from ...tables import Model
from ..tuning import (
    ESTIMATION_ROUNDS,
    FREE_DEVIATION,
    LEAST_KNOWN_VARIANCE,
    LEAST_WALL_ERROR,
    MAX_STEP,
    MAX_TURN,
    ROUGH_FRACTION,
    SMALL_CHANGE,
    SMALL_STEP,
    UNSEEN_ERROR,
    USUAL_WALL_ERROR,
    USUAL_WALLS,
)
from .geometry import wrap

# Unknowns after the sensor's place and the heading: offset along the rays; strain xx, yy, xy; rotation of the sensor;
# then those of the views.
OFFSET, STRAIN, TURN = 3, 4, 7
COLUMNS = 8
ROUNDING = 1e-13
MOST_TIED = 1.0 - 1e-9


@kernel
def linearize(model: Model, x: Floats, of_points: Floats, of_slopes: Floats) -> None:
    """Write the derivatives of each observation by the active unknowns, and in the last column its residual.

    Of the centroids, metres, and of the directions, rad: both (n, k + 1).
    """
    seen, active, sensor, places, root = model.seen, model.active, model.sensor, model.places, model.root
    size, k = len(x), len(active)
    a, b = np.zeros(size), np.zeros(size)
    c, s = math.cos(x[2]), math.sin(x[2])
    xx, yy, xy = x[STRAIN], x[STRAIN + 1], x[STRAIN + 2]
    for i in range(len(seen)):
        one = seen[i]
        nx, ny, dx, dy = one.normal_x, one.normal_y, one.dx, one.dy
        mx, my = one.centroid_x - sensor[0], one.centroid_y - sensor[1]
        if size > COLUMNS:
            # The view where it is found, and the derivatives by its steps.
            first = 3 * one.of_view
            shift_x = shift_y = turn = 0.0
            for j in range(COLUMNS, size):
                more = x[j] - model.began[j - COLUMNS]
                shift_x += root[first, j - COLUMNS] * more
                shift_y += root[first + 1, j - COLUMNS] * more
                turn += root[first + 2, j - COLUMNS] * more
            ct, st = math.cos(turn), math.sin(turn)
            ox, oy = places[one.of_view, 0], places[one.of_view, 1]
            px, py = one.centroid_x - ox, one.centroid_y - oy
            px, py = ct * px - st * py, st * px + ct * py
            dx, dy = ct * dx - st * dy, st * dx + ct * dy
            mx, my = (
                places[one.of_view, 0] + shift_x + px - sensor[0],
                places[one.of_view, 1] + shift_y + py - sensor[1],
            )
            lx, ly = c * nx + s * ny, c * ny - s * nx
            for j in range(COLUMNS, size):
                rx, ry, rt = root[first, j - COLUMNS], root[first + 1, j - COLUMNS], root[first + 2, j - COLUMNS]
                a[j] = lx * rx + ly * ry + (ly * px - lx * py) * rt
                b[j] = (ly * dx - lx * dy) * rt
        # As the sensor would have seen it at the middle of its sweep.
        ct, st = math.cos(x[TURN] * one.time), math.sin(x[TURN] * one.time)
        px, py = ct * mx - st * my, st * mx + ct * my
        dx, dy = ct * dx - st * dy - x[TURN] * one.pace * py, st * dx + ct * dy + x[TURN] * one.pace * px
        qx, qy, ex, ey = c * px - s * py, s * px + c * py, c * dx - s * dy, s * dx + c * dy
        zx, zy = qx + xx * qx + xy * qy, qy + xy * qx + yy * qy
        fx, fy = ex + xx * ex + xy * ey, ey + xy * ex + yy * ey
        by_turn = ny * qx - nx * qy
        a[0], a[1], a[2] = nx, ny, ny * zx - nx * zy
        a[OFFSET] = (nx * zx + ny * zy) / max(1e-6, math.hypot(zx, zy))
        a[STRAIN], a[STRAIN + 1], a[STRAIN + 2], a[TURN] = nx * qx, ny * qy, nx * qy + ny * qx, by_turn * one.time
        b[2] = ny * fx - nx * fy
        b[STRAIN], b[STRAIN + 1], b[STRAIN + 2] = nx * ex, ny * ey, nx * ey + ny * ex
        b[TURN] = (ny * ex - nx * ey) * one.time + by_turn * one.pace
        for j in range(k):
            of_points[i, j], of_slopes[i, j] = a[active[j]], b[active[j]]
        of_points[i, k] = nx * (zx + x[0]) + ny * (zy + x[1]) + x[OFFSET] * a[OFFSET] - one.offset
        of_slopes[i, k] = nx * fx + ny * fy


@kernel
def tied(ties: Floats, w: int) -> float:
    """Return the correlation of a wall's error with that of the wall before it; 0 where they are not tied."""
    if w <= 0 or w >= len(ties) or ties[w] < 0.0 or ties[w - 1] < 0.0:
        return 0.0
    return min(MOST_TIED, math.exp(min(0.0, ties[w - 1] - ties[w])))


@kernel
def normal_equations(
    model: Model, x: Floats, variance: float, of_points: Floats, of_slopes: Floats, normal: Floats, by_wall: Floats
) -> None:
    """Write the normal matrix with the gradient and chi-square in its last column, the walls' errors eliminated.

    `by_wall` (m, k + 2) gets the sums of rows, residuals and weights of each wall.
    """
    seen, ties, active, information = model.seen, model.ties, model.active, model.information
    k = len(active)
    normal[:] = 0.0
    by_wall[:] = 0.0
    for i in range(len(seen)):
        weight = 1.0 / (seen[i].variance + ROUGH_FRACTION * variance)
        w = seen[i].wall
        by_wall[w, k + 1] += weight
        for p in range(k + 1):
            across, along = weight * of_points[i, p], weight * seen[i].spread * of_slopes[i, p]
            by_wall[w, p] += across
            for q in range(k + 1):
                normal[p, q] += across * of_points[i, q] + along * of_slopes[i, q]
    if variance > LEAST_KNOWN_VARIANCE:
        # The errors' information is tridiagonal: walls are correlated with their neighbours on a chain.
        left = np.zeros(k + 1)
        pivot = 1.0
        for w in range(len(ties)):
            r, after = tied(ties, w), tied(ties, w + 1)
            beside = -r / ((1.0 - r * r) * variance)
            own = 1.0 + r * r / (1.0 - r * r) + after * after / (1.0 - after * after)
            passed = beside / pivot
            pivot = own / variance + by_wall[w, k + 1] - passed * beside
            for p in range(k + 1):
                left[p] = by_wall[w, p] - passed * left[p]
            for p in range(k + 1):
                for q in range(k + 1):
                    normal[p, q] -= left[p] * left[q] / pivot
    for p in range(k):
        for q in range(k):
            normal[p, q] += information[p, q]
            if p > 2 and q > 2:
                normal[p, k] += information[p, q] * x[active[q]]


@kernel
def invert(matrix: Floats, out: Floats) -> None:
    """Write the inverse of a positive definite matrix, scaled to a unit diagonal, as its units are unlike.

    Of the first rows and columns of `matrix`, as many as `out` has.
    """
    k = len(out)
    scale = np.empty(k)
    for p in range(k):
        scale[p] = 1.0 / math.sqrt(max(matrix[p, p], 1e-300))
    for p in range(k):
        for q in range(k):
            out[p, q] = matrix[p, q] * scale[p] * scale[q]
        out[p, p] += ROUNDING
    for p in range(k):
        pivot = 1.0 / out[p, p]
        out[p, p] = 1.0
        for q in range(k):
            out[p, q] *= pivot
        for r in range(k):
            if r != p:
                factor = out[r, p]
                out[r, p] = 0.0
                for q in range(k):
                    out[r, q] -= factor * out[p, q]
    for p in range(k):
        for q in range(p, k):
            out[p, q] = out[q, p] = 0.5 * (out[p, q] + out[q, p]) * scale[p] * scale[q]


@kernel
def shown_variance(own: Floats, by_wall: Floats, covariance: Floats, step: Floats, variance: float) -> float:
    """Return the variance of the walls' own errors that their residuals show, shrunk where walls are few.

    After a step. An estimate from few walls is uncertain itself: Student's t has that much more variance. And walls
    that are farthest off match nothing.
    """
    k = len(step)
    found = USUAL_WALLS * USUAL_WALL_ERROR**2
    count = USUAL_WALLS
    for w in range(len(own)):
        weight = by_wall[w, k + 1]
        mean = by_wall[w, k] / weight
        spread = 0.0
        for p in range(k):
            mean += by_wall[w, p] / weight * step[p]
            for q in range(k):
                spread += by_wall[w, p] * covariance[p, q] * by_wall[w, q]
        free = max(0.0, 1.0 - spread / (weight * weight) / (variance + 1.0 / weight))
        found += own[w] * (mean * mean - free / weight)
        count += own[w] * free
    return UNSEEN_ERROR * (1.0 + 2.0 / max(1.0, count - 2.0)) * max(found / count, LEAST_WALL_ERROR**2)


@kernel
def solve_model(model: Model, x: Floats, covariance: Floats, known: float) -> tuple[float, float]:
    """Take the steps of Gauss-Newton until they are small; return the variance of the walls' errors, and a chi-square.

    The chi-square is that of the columns' differing from 0, as the residuals scatter.

    Parameters
    ----------
    model : Model
    x : (COLUMNS + views,)
        The start; changed to the solution, or left where that is far.
    covariance : (k, k)
        Written.
    known : float
        Variance of the walls' errors, m^2; below 0 where it is not known.
    """
    seen, ties, active = model.seen, model.ties, model.active
    n, k = len(seen), len(active)
    of_points, of_slopes = np.empty((n, k + 1)), np.empty((n, k + 1))
    normal, by_wall = np.empty((k + 1, k + 1)), np.empty((len(ties), k + 2))
    begin, step = x.copy(), np.empty(k)
    variance = known if known >= 0.0 else USUAL_WALL_ERROR**2
    for _ in range(ESTIMATION_ROUNDS):
        linearize(model, x, of_points, of_slopes)
        normal_equations(model, x, variance, of_points, of_slopes, normal, by_wall)
        invert(normal, covariance)
        largest = 0.0
        for p in range(k):
            step[p] = 0.0
            for q in range(k):
                step[p] -= covariance[p, q] * normal[q, k]
            x[active[p]] += step[p]
            largest = max(largest, abs(step[p]))
        before = variance
        if known < 0.0:
            variance = shown_variance(model.own, by_wall, covariance, step, variance)
        if largest < SMALL_STEP and abs(variance - before) < SMALL_CHANGE * before:
            break
    near = math.hypot(x[0] - begin[0], x[1] - begin[1]) <= MAX_STEP and abs(wrap(x[2] - begin[2])) <= MAX_TURN
    if not near or not np.isfinite(x).all():
        x[:] = begin
        variance = known if known >= 0.0 else USUAL_WALL_ERROR**2
    linearize(model, x, of_points, of_slopes)
    normal_equations(model, x, variance, of_points, of_slopes, normal, by_wall)
    if not near:
        invert(normal, covariance)
    columns = k - 3 - (len(x) - COLUMNS)
    block = covariance[3 : 3 + columns, 3 : 3 + columns].copy()
    invert(block, block)
    differs = 0.0
    for p in range(columns):
        for q in range(columns):
            differs += x[active[3 + p]] * block[p, q] * x[active[3 + q]]
    return variance, differs / max(1.0, normal[k, k] / max(1, 2 * n - k))


@kernel
def leave_out_walls(
    model: Model, x: Floats, variance: float, loose: float, covariances: Floats, places: Floats
) -> None:
    """Write covariances of the unknowns, and how the pose would be without each wall and those that are one with it.

    Parameters
    ----------
    model : Model
    x : (COLUMNS + views,)
        The solution.
    variance, loose : float
        Of the walls' errors, and another one, m^2.
    covariances : (2, k, k)
        Written, one for either variance.
    places : (m, 5)
        Written: the move of the sensor's place, metres; the deviation along its weakest direction, and that direction.
    """
    seen, ties, active, information = model.seen, model.ties, model.active, model.information
    n, k, m = len(seen), len(active), len(ties)
    of_points, of_slopes = np.empty((n, k + 1)), np.empty((n, k + 1))
    normal, by_wall = np.empty((k + 1, k + 1)), np.empty((m, k + 2))
    linearize(model, x, of_points, of_slopes)
    normal_equations(model, x, loose, of_points, of_slopes, normal, by_wall)
    invert(normal, covariances[1])
    normal_equations(model, x, variance, of_points, of_slopes, normal, by_wall)
    invert(normal, covariances[0])
    # The walls one by one, without the steps of the views.
    p = k - (len(x) - COLUMNS)
    parts, gradients = np.zeros((m, p, p)), np.zeros((m, p))
    for i in range(n):
        weight = 1.0 / (seen[i].variance + ROUGH_FRACTION * variance)
        w = seen[i].wall
        for a in range(p):
            across, along = weight * of_points[i, a], weight * seen[i].spread * of_slopes[i, a]
            gradients[w, a] += across * of_points[i, k] + along * of_slopes[i, k]
            for b in range(p):
                parts[w, a, b] += across * of_points[i, b] + along * of_slopes[i, b]
    for w in range(m):
        factor = 1.0 / (by_wall[w, k + 1] + 1.0 / variance)
        for a in range(p):
            gradients[w, a] -= factor * by_wall[w, k] * by_wall[w, a]
            for b in range(p):
                parts[w, a, b] -= factor * by_wall[w, a] * by_wall[w, b]
    total, gradient, covariance = np.empty((p, p)), np.empty(p), np.empty((p, p))
    whole_x = whole_y = 0.0
    for out in range(m, -1, -1):  # first with all walls
        total[:] = information[:p, :p]
        for a in range(p):
            gradient[a] = 0.0
            for b in range(3, p):
                gradient[a] += information[a, b] * x[active[b]] if a > 2 else 0.0
        for w in range(m):
            kept = 1.0
            if out == w:
                kept = 0.0
            elif out < m and ties[out] >= 0.0 and ties[w] >= 0.0:
                kept = 1.0 - math.exp(-2.0 * abs(ties[out] - ties[w]))
            for a in range(p):
                gradient[a] += kept * gradients[w, a]
                for b in range(p):
                    total[a, b] += kept * parts[w, a, b]
        invert(total, covariance)
        step_x = step_y = 0.0
        for a in range(p):
            step_x -= covariance[0, a] * gradient[a]
            step_y -= covariance[1, a] * gradient[a]
        if out == m:
            whole_x, whole_y = step_x, step_y
            continue
        places[out, 0], places[out, 1] = step_x - whole_x, step_y - whole_y
        deviation, dx, dy = weakest(covariance)
        places[out, 2], places[out, 3], places[out, 4] = min(deviation, FREE_DEVIATION), dx, dy


@kernel
def weakest(covariance: Floats) -> tuple[float, float, float]:
    """Return the deviation of a place along its weakest direction, and that direction, to the right or straight up."""
    xx, xy, yy = covariance[0, 0], covariance[0, 1], covariance[1, 1]
    half = math.hypot(0.5 * (xx - yy), xy)
    angle = 0.5 * math.atan2(2.0 * xy, xx - yy)
    dx, dy = math.cos(angle), math.sin(angle)
    if dx <= 1e-12 and dy < 0.0:
        dx, dy = -dx, -dy
    return math.sqrt(max(0.0, 0.5 * (xx + yy) + half)), dx, dy
