"""Slow, obviously right references of the kernels in ``vectorization/``."""

from __future__ import annotations

import itertools
import math
from collections.abc import Container

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from registration.layout import Floats
from vectorization.tuning import BREAK_PENALTY, BREAK_REACH, GRAZING, LEAST_TRIPLES, MISSING_STEPS

Pieces = list[tuple[int, int]]


def stretch_cost(points: Floats, rays: Floats, variance: float, floor: float) -> float:
    """Chi-square of the total least squares line through points, by the singular values."""
    n = len(points)
    if n < 3:
        return 0.0
    _, singular, basis = np.linalg.svd(points - points.mean(axis=0))
    normal = basis[1]
    cosines = np.where((rays == 0).all(axis=1), 1.0, rays @ normal)
    return float(singular[1] ** 2 / np.mean(variance * cosines**2 + floor))


def find_gaps(
    points: Floats, rays: Floats, increment: float, sigma: float, default_gap: float, max_gap: float
) -> list[int]:
    starts = [0] if len(points) else []
    for i in range(1, len(points)):
        limit = default_gap
        if increment > 0:
            step = math.acos(min(1.0, max(-1.0, rays[i - 1] @ rays[i])))
            nearer = float(min(np.linalg.norm(points[i - 1]), np.linalg.norm(points[i])))
            limit = nearer * math.sin(step) / math.sin(max(GRAZING - step, GRAZING / 2)) + 4 * sigma
            if step > MISSING_STEPS * increment:
                limit = 0.0
        if np.linalg.norm(points[i] - points[i - 1]) > min(limit, max_gap):
            starts.append(i)
    return starts


def merge(pieces: Pieces, points: Floats, rays: Floats, gaps: Container[int], variance: float, floor: float) -> Pieces:
    pieces = list(pieces)

    def cost(a: int, b: int) -> float:
        return stretch_cost(points[a:b], rays[a:b], variance, floor)

    while True:
        joints = [
            (cost(a, d) - cost(a, b) - cost(c, d), k)
            for k, ((a, b), (c, d)) in enumerate(itertools.pairwise(pieces))
            if c not in gaps
        ]
        if not joints or min(joints)[0] >= BREAK_PENALTY:
            return pieces
        k = min(joints)[1]
        pieces[k : k + 2] = [(pieces[k][0], pieces[k + 1][1])]


def settle_breaks(
    pieces: Pieces, points: Floats, rays: Floats, gaps: Container[int], variance: float, floor: float
) -> Pieces:
    pieces = list(pieces)
    for i in range(len(pieces) - 1):
        (a, b), (_, c) = pieces[i : i + 2]
        if b in gaps or b - a < 2 or c - b < 2:
            continue
        costs = {
            k: stretch_cost(points[a:k], rays[a:k], variance, floor)
            + stretch_cost(points[k:c], rays[k:c], variance, floor)
            for k in range(max(a + 2, b - BREAK_REACH), min(c - 2, b + BREAK_REACH) + 1)
        }
        place = min(costs, key=lambda k: costs[k])
        pieces[i : i + 2] = (a, place), (place, c)
    return pieces


def fit_line(ranges: Floats, rays: Floats, normal_angle: float, distance: float) -> tuple[Floats, Floats]:
    """Maximum likelihood line under range noise alone: normal's angle and distance, information times sigma^2."""

    def misses(line: Floats) -> Floats:
        angle, distance = line
        expected: Floats = distance / (rays @ [np.cos(angle), np.sin(angle)])
        return ranges - expected

    solution = least_squares(misses, [normal_angle, distance], xtol=1e-15, ftol=1e-15)
    jacobian = np.asarray(solution.jac)
    return solution.x, jacobian.T @ jacobian


def ray_noise(ranges: Floats, angles: Floats, increment: float, trusted: float, mean_square: float) -> float:
    z = []
    for i in range(1, len(ranges) - 1):
        (ra, rb, rc), (a, b, c) = ranges[i - 1 : i + 2], angles[i - 1 : i + 2]
        if max(b - a, c - b) < 1.6 * increment:
            coefficients = np.array([np.sin(c - b) / ra, -np.sin(c - a) / rb, np.sin(b - a) / rc])
            z.append(abs(coefficients.sum()) / np.linalg.norm(coefficients / [ra, rb, rc]))
    if len(z) < LEAST_TRIPLES:
        return 0.0
    return math.sqrt(np.mean(np.square(np.sort(z)[: int(trusted * len(z))])) / mean_square)


def window_noise(points: Floats, window: int, median: float) -> float:
    squares = []
    for a in range(len(points) - window + 1):
        p = points[a : a + window]
        squares.append(np.linalg.svd(p - p.mean(axis=0))[1][1] ** 2 / (window - 2))
    return math.sqrt(np.sort(squares)[len(squares) // 2] / median)


def gather(cleaned: Floats, angles: Floats, backward: bool, closed: bool) -> tuple[NDArray[np.intp], Floats, Floats]:
    order = np.arange(len(cleaned))[:: -1 if backward else 1]
    order = order[np.isfinite(cleaned[order])]
    if closed and len(order):
        order = np.roll(order, -int(np.argmax(cleaned[order])))
    return order, cleaned[order], np.stack([np.cos(angles[order]), np.sin(angles[order])])
