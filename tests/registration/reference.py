"""Slow and obviously right references: one pair at a time, straight from the definitions."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from registration import MeasuredSegments, Segments
from registration.layout import Floats

Line = tuple[Floats, Floats, float]  # Eq. (1)'s P and v, and alpha

TURN = np.array([[0.0, -1.0], [1.0, 0.0]])


def rotation(theta: float) -> Floats:
    return np.array([[np.cos(theta), -np.sin(theta)], [np.sin(theta), np.cos(theta)]])


def pair_rows(
    map_segments: Segments, scan: MeasuredSegments, pairs: Sequence[tuple[int, int]] | NDArray[np.intp]
) -> list[tuple[Floats | float, ...]]:
    """Data of each pair, in the order of the attributes of `Correspondences`."""
    rows: list[tuple[Floats | float, ...]] = []
    for i, j in pairs:
        m, s = map_segments, scan.segments
        sigma = max(scan.sigma[i], 1e-12) if scan.sigma[i] > 0.0 else 0.0
        offset = np.sum(TURN @ m.directions[j] * m.midpoints[j])
        on_map = m.directions[j], m.midpoints[j], offset, m.lengths[j]
        measured = scan.centroids[i], scan.spreads[i], sigma**2 / scan.point_counts[i]
        rows.append((*on_map, s.directions[i], s.midpoints[i], s.lengths[i], *measured))
    return rows


# Joint estimator -----------------------------------------------------------------------------------------------------


def joint_sums(
    normals: Floats, offsets: Floats, centroids: Floats, directions: Floats, spreads: Floats, weights: Floats
) -> Floats:
    """Upper triangle of Q = sum w (phi phi' + s psi psi'), Wahba's two sums, and the count."""
    q = np.zeros((5, 5))
    resultant = 0.0
    for n, p, m, d, s, w in zip(normals, offsets, centroids, directions, spreads, weights, strict=True):
        phi = np.array([n @ m, n @ TURN @ m, n[0], n[1], -p])
        psi = np.array([n @ d, n @ TURN @ d, 0.0, 0.0, 0.0])
        q += w * (np.outer(phi, phi) + s * np.outer(psi, psi))
        map_direction = TURN.T @ n
        resultant += w * s * complex(*map_direction) * complex(*d).conjugate()
    return np.concatenate([q[np.triu_indices(5)], [resultant.real, resultant.imag, len(weights)]])


def joint_residuals(unknown: Floats, *pairs: Floats) -> Floats:
    """Weighted distances of two points of each pair that have its centroid and spread, at (x, y, theta)."""
    r, at = rotation(unknown[2]), unknown[:2]
    rows = [(n, p, math.sqrt(0.5 * w), m, math.sqrt(s) * d) for n, p, m, d, s, w in zip(*pairs, strict=True)]
    return np.array([w * (n @ (r @ (m + side * half) + at) - p) for n, p, w, m, half in rows for side in (1.0, -1.0)])


def joint_cost(theta: float, t: Floats, *pairs: Floats) -> float:
    """Sum of squared distances of the points."""
    return float(np.sum(joint_residuals(np.array([*t, theta]), *pairs) ** 2))


def least_cost(theta: float, *pairs: Floats) -> float:
    """Cost at an angle with the best translation there, of which distances are linear functions."""
    rows = np.repeat(np.sqrt(0.5 * pairs[-1])[:, None] * pairs[0], 2, axis=0)
    gaps = joint_residuals(np.array([0.0, 0.0, theta]), *pairs)
    best = np.linalg.lstsq(rows, -gaps, rcond=1e-9)[0]
    return float(np.sum((rows @ best + gaps) ** 2))


def joint_solve(start: Floats, *pairs: Floats) -> tuple[Floats, Floats]:
    """Minimise the cost from (x, y, theta) on; return the minimum and the information there."""
    found = least_squares(joint_residuals, start, jac="cs", args=pairs, xtol=1e-15, ftol=1e-15, gtol=1e-15)
    jacobian = np.asarray(found.jac)
    return found.x, jacobian.T @ jacobian


def joint_information(theta: float, *pairs: Floats) -> Floats:
    """Information of (x, y, theta) at an angle, by complex steps."""
    columns = [joint_residuals(np.array([0.0, 0.0, theta]) + 1e-200j * e, *pairs).imag / 1e-200 for e in np.eye(3)]
    return np.array(columns) @ np.array(columns).T


# The paper's estimator -----------------------------------------------------------------------------------------------


def transformation_line(map_direction: Floats, map_midpoint: Floats, direction: Floats, midpoint: Floats) -> Line:
    """Eq. (1), sign corrected: the point P and direction v of the ideal translations, and the angle alpha."""
    n_s, n_d = TURN @ map_direction, TURN @ direction
    point = (map_midpoint @ n_s - midpoint @ n_d) * n_s
    alpha = math.atan2(map_direction[1], map_direction[0]) - math.atan2(direction[1], direction[0])
    return point, map_direction, math.remainder(alpha, math.tau)


def one_step_translation(lines: Sequence[Line], weights: Floats) -> Floats:
    """Minimise sum w (|T - P|^2 - ((T - P) . v)^2) as least squares of the distances along the normals."""
    a = np.array([math.sqrt(w) * (TURN @ v) for (_, v, _), w in zip(lines, weights, strict=True)])
    b = np.array([math.sqrt(w) * (TURN @ v) @ p for (p, v, _), w in zip(lines, weights, strict=True)])
    solution: Floats = np.linalg.lstsq(a, b, rcond=1e-9)[0]
    return solution


def translation_ambiguity(at: Floats, lines: Sequence[Line], weights: Floats) -> float:
    """Eq. (2) squared and summed: distances of a translation from the lines."""
    return sum(
        float(w * ((at - p)[0] * v[1] - (at - p)[1] * v[0]) ** 2) for (p, v, _), w in zip(lines, weights, strict=True)
    )


def mitsuta(angles: Sequence[float], weights: Floats) -> tuple[float, float]:
    """Alg. 1, lines 15 and 16 corrected: the weighted sums of the unwrapped angles and of their squares."""
    old = angles[0]
    total, squares = weights[0] * old, weights[0] * old**2
    for angle, weight in zip(angles[1:], weights[1:], strict=True):
        delta = angle - old
        if delta < -math.pi:
            delta += math.tau
        elif delta > math.pi:
            delta -= math.tau
        old += delta
        total += weight * old
        squares += weight * old**2
    return total, squares


def wahba_error(theta: float, map_directions: Floats, directions: Floats, weights: Floats) -> float:
    """Eq. (11)."""
    return sum(
        float(w) * float(np.sum((s - rotation(theta) @ d) ** 2))
        for s, d, w in zip(map_directions, directions, weights, strict=True)
    )


def wahba(map_directions: Floats, directions: Floats, weights: Floats) -> float:
    """Minimise Eq. (11) by singular values, as for any dimension."""
    b = sum(w * np.outer(s, d) for s, d, w in zip(map_directions, directions, weights, strict=True))
    u, _, v = np.linalg.svd(b)
    r = u @ np.diag([1.0, np.linalg.det(u) * np.linalg.det(v)]) @ v
    return math.atan2(r[1, 0], r[0, 0])


def one_step_sums(
    map_directions: Floats,
    map_midpoints: Floats,
    directions: Floats,
    midpoints: Floats,
    weights: Floats,
    reference: tuple[float, float, float],
) -> Floats:
    """The sums of Eqs. (5), (17), (19) and (15) about a reference ``(x, y, alpha)``."""
    total = np.zeros(12)
    for row in zip(map_directions, map_midpoints, directions, midpoints, weights, strict=True):
        v, m, d, q, w = row
        point, _, alpha = transformation_line(v, m - np.array(reference[:2]), d, q)
        a = math.remainder(alpha - reference[2], math.tau)
        c = point[0] * v[1] - point[1] * v[0]
        turn = 1.0 - math.cos(a), math.sin(a)
        total[:-1] += w * np.array([1.0, *v**2, v[0] * v[1], *point, c**2, a, a**2, *turn])
        total[-1] += 1.0
    return total
