"""Rays through a map: which wall is met first, and from which side."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from association.consensus.kernels.sight import first_hit
from association.index.map_index import MapIndex
from association.layout import RAY
from registration.layout import Records


@dataclass(frozen=True, slots=True)
class Looker:
    """Follows rays from places in the index frame; some 5 microseconds each.

    Attributes
    ----------
    index : MapIndex
    """

    index: MapIndex
    _ray: Records = field(default_factory=lambda: np.zeros(1, RAY), repr=False)

    def first(self, x: float, y: float, angle: float, limit: float) -> tuple[float, int]:
        """Return how far away the first wall is along an angle, metres, and which; ``(limit, -1)`` where none is."""
        ray, place = self._ray[0], self.index.tables.place
        ray["x"], ray["y"], ray["limit"] = x, y, limit
        ray["dx"], ray["dy"] = math.cos(angle), math.sin(angle)
        reach, wall = first_hit(ray, place.walls, place.grid.starts, place.grid.items, place.grid.shape[0])
        return float(reach), int(wall)

    def is_within(self, x: float, y: float) -> bool:
        """Tell whether a place lies in the box around the walls, as far as cells list them."""
        shape = self.index.tables.place.grid.shape[0]
        right, top = shape["columns"] * shape["cell"], shape["rows"] * shape["cell"]
        return bool(0.0 <= x - shape["x0"] <= right and 0.0 <= y - shape["y0"] <= top)

    def is_front(self, wall: int, angle: float) -> bool:
        """Tell whether a ray along an angle meets a wall on its left, where free space is."""
        row = self.index.walls.rows[wall]
        return bool(row["dx"] * math.sin(angle) < row["dy"] * math.cos(angle))


def segments_of(index: MapIndex, walls: NDArray[np.bool_] | NDArray[np.intp]) -> tuple[int, ...]:
    """Return the segments, as sent, that some walls consist of; `walls` are flags or indices."""
    chosen = np.zeros(len(index.walls.rows), dtype=bool)
    chosen[walls] = True
    pieces = np.flatnonzero(chosen[index.wall_of_piece]) % index.directed
    return tuple(np.unique(pieces).tolist())
