"""Twins of the kernels that decide whether a set fixes its pose: by eigenvalues."""

from __future__ import annotations

import math

import numpy as np

from association.consensus.tuning import LEAST_SPREAD, PARALLEL_QUANTILE
from association.layout import Integers
from registration.layout import Floats, Records


def reliability(scan: Records, held: Integers, walls: Records) -> float:
    """Eqs. (22) to (28): twice the root of the product of the eigenvalues of E, the mean of n n' by weight."""
    values = _eigenvalues(scan, held, walls)
    return 2.0 * math.sqrt(max(0.0, float(np.prod(values)))) / values.sum() if values.sum() > 0.0 else 0.0


def least_reliability(scan: Records, held: Integers, walls: Records) -> float:
    """Return the reliability that the errors of the angles give parallel walls."""
    on, weight = held >= 0, _eigenvalues(scan, held, walls).sum()
    n = int(on.sum())
    if n < 2:
        return 1.0
    noise = 1.0 / np.maximum(scan["spread"][on], LEAST_SPREAD)
    freedom = max(1.0, noise.sum() ** 2 / (noise**2).sum() - 1.0)
    smaller = noise.sum() * (1.0 - 1.0 / n) / freedom * quantile(freedom)
    return 2.0 * math.sqrt(smaller * (weight - smaller)) / weight if smaller < 0.5 * weight else 1.0


def quantile(freedom: float) -> float:
    """Return that of a chi-square, after Wilson and Hilferty: its cube root is about normal."""
    return float(freedom * (1.0 - 2.0 / (9.0 * freedom) + PARALLEL_QUANTILE * math.sqrt(2.0 / (9.0 * freedom))) ** 3)


def _eigenvalues(scan: Records, held: Integers, walls: Records) -> Floats:
    on = held >= 0
    chosen = walls[held[on]]
    normals = np.stack([-chosen["dy"], chosen["dx"]], axis=1)
    values: Floats = np.linalg.eigvalsh((scan["weight"][on][:, None] * normals).T @ normals)
    return values
