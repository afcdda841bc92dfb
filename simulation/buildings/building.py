"""A building for the simulation: its fixed walls, its movable things, and its doors."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from registration import Segments

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

FIXED = -1  # in `Building.things`


@dataclass(frozen=True, slots=True)
class Building:
    """A building on the day when its map was made: all doors open, their leaves out of sight.

    Attributes
    ----------
    name : str
        Of its family.
    segments : Segments
        Metres, n of them, with free space on the left.
    things : (n,) int64
        Which thing that can be moved each segment is part of, `FIXED` for none.
    kinds : tuple of str
        The kind of each of those things: "car", "bed", "pallet".
    doors : (k, 4)
        The doorways' leaves when closed: the side of the axis, then the other jamb; metres. An open leaf swings to
        the left of that.
    """

    name: str
    segments: Segments
    things: Indices = field(repr=False)
    kinds: tuple[str, ...] = field(repr=False)
    doors: Floats = field(repr=False)

    @property
    def fixed(self) -> Segments:
        """The segments that are no thing's."""
        return self.segments.take(np.flatnonzero(self.things == FIXED))
