"""Generalised least squares of scan lines on walls, solved from nothing: what kernels of a scan are compared with.

Each pair gives two residuals, the offset of its centroid and its direction times the root of its spread. Both have the
variance of the segment; the offsets of all pairs of a wall have the variance of the wall in common besides.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from association.layout import MODEL, Integers
from registration.layout import Floats, Record, Records

from .geometry import TURN, direction, normal, point, rotation


@dataclass(frozen=True)
class Pairs:
    """Scan lines on walls, and what their residuals are compared with.

    Attributes
    ----------
    scan : (n,) of `SCAN_LINE`
    walls : (n,) of `WALL`, that of each line
    covariance : (2 n, 2 n) of all offsets, m^2, and behind them of all directions times the root of the spread
    """

    scan: Records
    walls: Records
    covariance: Floats

    @classmethod
    def of(
        cls,
        scan: Records,
        held: Integers,
        walls: Records,
        wall_variance: float,
        ties: Floats | None = None,
        shifts: Floats | None = None,
    ) -> Pairs:
        """Take the scan lines on a wall; `held` (n,) is the wall of each or -1.

        The errors of walls are correlated by their ties; the line that a scan line lies on is off its wall by its
        shift, (n,).
        """
        on = np.asarray(held) >= 0
        chosen, wall = scan[on], held[on]
        own = np.diag(np.tile(1.0 / chosen["weight"], 2))
        common = np.zeros_like(own)
        common[: len(wall), : len(wall)] = wall_variance * correlations(wall, walls, ties)
        lines = walls[wall]
        if shifts is not None:
            lines["offset"] += shifts[on]
        return cls(chosen, lines, own + common)

    def derivatives(self, theta: float) -> Floats:
        """Return those of the residuals by x, y and theta, (2 n, 3)."""
        offsets, turns = [], []
        for one, wall in zip(self.scan, self.walls, strict=True):
            r, n = rotation(theta), normal(wall)
            offsets.append([*n, n @ TURN @ r @ point(one, "centroid_x", "centroid_y")])
            turns.append([0.0, 0.0, math.sqrt(one["spread"]) * (n @ TURN @ r @ direction(one))])
        return np.array(offsets + turns).reshape(-1, 3)

    def information(self, theta: float) -> Floats:
        """Return the information of (x, y, theta), (3, 3)."""
        j = self.derivatives(theta)
        return np.asarray(j.T @ np.linalg.solve(self.covariance, j))


def correlations(wall: Integers, walls: Records, ties: Floats | None) -> Floats:
    """Return how the errors of some walls (n,) are correlated, (n, n); without ties only with themselves."""
    places = (np.full(len(walls), -1.0) if ties is None else ties)[wall]
    apart = np.where(np.minimum.outer(places, places) < 0.0, np.inf, np.abs(places[:, None] - places))
    return np.exp(-np.where(wall[:, None] == wall, 0.0, apart))


def log_determinant(information: Floats, model: Record) -> float:
    """Return half of the logarithm of ``det(1 + F S)``."""
    s = np.diag([model["free_distance"] ** 2, model["free_distance"] ** 2, model["free_angle"] ** 2])
    return 0.5 * float(np.log(np.linalg.det(np.eye(3) + information @ s)))


def model_of(wall_variance: float, free_distance: float, free_angle: float) -> Records:
    """Return these, (1,) of `MODEL`."""
    model = np.zeros(1, MODEL)
    model[0] = wall_variance, free_distance, free_angle, 0.0, 0.0
    return model
