"""The cells that can be reached from a point without crossing a wall."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from registration import Segments

from ..views import AnalysisError

CELL = 0.1  # m; fine enough for doors
MOST_CELLS = 4_000_000
MOST_STEPS = 20_000_000  # along the walls

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Reach:
    """The cells of a raster that hang together with that of a point.

    Attributes
    ----------
    low : (2,) metres; the raster's lower left corner
    cell : float
        Metres.
    inside : (columns, rows) bool
    """

    low: Floats
    cell: float
    inside: NDArray[np.bool_]

    @classmethod
    def from_point(cls, segments: Segments, point: Sequence[float]) -> Reach:
        """Flood a map from a point, ``(x, y)`` metres.

        Raises
        ------
        AnalysisError
            When the point lies outside the box around the map, or on a wall, or the map has too much wall for it.
        """
        corners = segments.endpoints.reshape(-1, 2)
        low, high = corners.min(axis=0), corners.max(axis=0)
        cell = max(CELL, math.sqrt(float(np.prod(high - low)) / MOST_CELLS))
        low = low - cell
        shape = np.ceil((high - low) / cell).astype(int) + 2
        walls = np.zeros(shape, dtype=bool)
        counts = np.ceil(segments.lengths / (0.5 * cell)).astype(np.int64) + 1
        if counts.sum() > MOST_STEPS:
            raise AnalysisError(
                f"expected a smaller map for an analysis from a point: its walls cover {counts.sum()} cells of at most "
                f"{MOST_STEPS}; omit the point, or cut the map",
                argument="point",
            )
        which = np.repeat(np.arange(len(segments)), counts)
        first = np.cumsum(counts) - counts
        share = (np.arange(len(which)) - first[which]) / np.maximum(counts[which] - 1, 1)
        begin, end = segments.endpoints[which, :2], segments.endpoints[which, 2:]
        columns, rows = _cells(begin + share[:, None] * (end - begin), low, cell).T
        walls[columns, rows] = True
        start = np.asarray(point, dtype=np.float64)
        if not ((start >= low) & (start <= high)).all():
            away = float(np.linalg.norm(np.maximum(0.0, np.maximum(low - start, start - high))))
            raise AnalysisError(f"expected a place on the map, found one {away:.2f} m outside", argument="point")
        from scipy import ndimage  # takes a twentieth of a second to load, and only this needs it

        labels, _ = ndimage.label(~walls)
        label = labels[tuple(_cells(start[None], low, cell)[0])]
        if label == 0:
            raise AnalysisError(
                f"expected a free place, found one on a wall; choose one {cell:.2f} m away", argument="point"
            )
        return cls(low, cell, labels == label)

    def includes(self, places: Floats) -> NDArray[np.bool_]:
        """Return which of ``(n, 2)`` places on the map can be reached."""
        columns, rows = _cells(places, self.low, self.cell).T
        found: NDArray[np.bool_] = self.inside[columns, rows]
        return found


def _cells(places: Floats, low: Floats, cell: float) -> NDArray[np.int64]:
    return np.floor((places - low) / cell).astype(np.int64)
