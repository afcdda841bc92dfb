"""Twins of the kernels that decide whether a set fixes its pose: by eigenvalues."""

from __future__ import annotations

import math

import numpy as np

from association.layout import Integers
from registration.layout import Floats, Records
from registration.observability import most_parallel


def reliability(scan: Records, held: Integers, walls: Records) -> float:
    """Eqs. (22) to (28): twice the root of the product of the eigenvalues of E, the mean of n n' by weight."""
    values = _eigenvalues(scan, held, walls)
    return 2.0 * math.sqrt(max(0.0, float(np.prod(values)))) / values.sum() if values.sum() > 0.0 else 0.0


def least_reliability(scan: Records, held: Integers, walls: Records) -> float:
    """Return the reliability that the errors of the angles give parallel walls."""
    smaller, weight = most_parallel(int((held >= 0).sum())), _eigenvalues(scan, held, walls).sum()
    return 2.0 * math.sqrt(smaller * (weight - smaller)) / weight if smaller < 0.5 * weight else 1.0


def _eigenvalues(scan: Records, held: Integers, walls: Records) -> Floats:
    on = held >= 0
    chosen = walls[held[on]]
    normals = np.stack([-chosen["dy"], chosen["dx"]], axis=1)
    information = (scan["weight"] * scan["spread"])[on]
    values: Floats = np.linalg.eigvalsh((information[:, None] * normals).T @ normals)
    return values
