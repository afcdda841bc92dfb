"""Points of a map: things that are too small for a wall, such as legs, posts and clutter."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from registration.layout import Floats

from ..errors import InvalidMapError
from .tuning import MAX_MAP_SIGMA

MAX_POINTS = 200_000  # of a map; the contract
POINT_SIGMA = 0.05  # m, if a map does not state it; the contract
POINTS_REACH = 40.0  # m; less than half the gap between two maps of a joint index


@dataclass(frozen=True, slots=True)
class MapPoints:
    """Objects that a map shows as points: evidence for single beams, never part of a hypothesis.

    A beam that ends at a point reads it, as it would read a wall. A beam that passes a point is no evidence, because an
    error of some centimetres suffices.

    Attributes
    ----------
    positions : (n, 2)
        Metres in the map frame.
    sigma : float
        Standard deviation of a position, metres; also half the width that stops a beam.
    """

    positions: Floats
    sigma: float = POINT_SIGMA

    @classmethod
    def of(cls, positions: ArrayLike, sigma: float | None = None, *, path: str = "map.") -> MapPoints:
        """Check the points of a map document.

        Parameters
        ----------
        positions : array-like of shape (n, 2)
            Metres in the map frame.
        sigma : float or None
            Metres, above 0; None: 0.05.
        path : str
            Names of arguments in errors begin with it.

        Raises
        ------
        InvalidMapError
            When they are no such array, not finite or too many, or sigma is out of range.
        """
        argument = f"{path}points"
        try:
            rows = np.array(positions, dtype=np.float64)
        except (TypeError, ValueError):
            raise InvalidMapError(
                "expected rows [x, y] of two numbers, found rows of other lengths or types", argument=argument
            ) from None
        rows = rows.reshape(0, 2) if rows.size == 0 else rows
        if rows.ndim != 2 or rows.shape[1] != 2:
            raise InvalidMapError(f"expected rows [x, y], found an array of shape {rows.shape}", argument=argument)
        if len(rows) > MAX_POINTS:
            raise InvalidMapError(f"expected at most {MAX_POINTS} points, found {len(rows)}", argument=argument)
        if not np.isfinite(rows).all():
            k = int(np.flatnonzero(~np.isfinite(rows).all(axis=1))[0])
            raise InvalidMapError("expected finite numbers", argument=f"{argument}.{k}")
        deviation = POINT_SIGMA if sigma is None else float(sigma)
        if not 0.0 < deviation <= MAX_MAP_SIGMA or not math.isfinite(deviation):
            raise InvalidMapError(
                f"expected a number above 0 and up to {MAX_MAP_SIGMA:g} m, found {deviation:g}",
                argument=f"{path}points_sigma",
            )
        return cls(rows, deviation)

    def __len__(self) -> int:
        return len(self.positions)

    def near(self, low: Floats, high: Floats) -> MapPoints:
        """Return the points within `POINTS_REACH` of the box of the walls, whose corners are (2,) metres.

        Others would make the grid of obstacles coarse, and lie on the other maps of a joint index.
        """
        inside = (self.positions >= low - POINTS_REACH) & (self.positions <= high + POINTS_REACH)
        kept = inside.all(axis=1)
        return self if kept.all() else MapPoints(self.positions[kept], self.sigma)

    def shifted(self, offset: Floats) -> MapPoints:
        """Return the points moved by an offset, (2,) metres."""
        return MapPoints(self.positions + offset, self.sigma)

    def scaled(self, factor: float) -> MapPoints:
        """Return the points of the map with all lengths times a factor."""
        return MapPoints(self.positions * factor, self.sigma)

    def arms(self) -> Floats:
        """Return a cross for each point, (2 n, 4) endpoints, metres: from each side it stops beams that come near."""
        x, y = self.positions.T
        half = self.sigma
        return np.concatenate(
            [np.column_stack([x - half, y, x + half, y]), np.column_stack([x, y - half, x, y + half])]
        )


NO_POINTS = MapPoints(np.zeros((0, 2)))
