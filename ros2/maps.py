"""The maps that are searched, with their names and frames."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

import linefix

SAME = 0.1  # m; two cells of most grids: a wall that is nearer is the same one
UNNAMED = ""  # the name of a map that came over a topic


@dataclass(frozen=True, slots=True, eq=False)
class Maps:
    """One map, or several that are searched together.

    Attributes
    ----------
    index : MapIndex or MapSet
    frames : mapping of str to str
        The frame of each map by its name, in the order of the index; `UNNAMED` from a topic.
    """

    index: linefix.MapIndex | linefix.MapSet
    frames: Mapping[str, str]

    @property
    def several(self) -> bool:
        """Return whether an answer names its map."""
        return isinstance(self.index, linefix.MapSet)

    def name_of(self, map_id: str | None) -> str:
        """Return the name of the map of an answer; `map_id` is None for a single map."""
        return next(iter(self.frames)) if map_id is None else map_id

    def frame_of(self, map_id: str | None) -> str:
        """Return the frame of the map of an answer."""
        return self.frames[self.name_of(map_id)]

    def walls_of(self, map_id: str | None) -> linefix.Segments:
        """Return the segments of the map of an answer, in its frame."""
        if isinstance(self.index, linefix.MapSet):
            return self.index.parts[self.index.ids.index(self.name_of(map_id))].segments
        return self.index.segments.take(np.arange(self.index.directed))

    def similarity(self, before: Maps | None) -> float:
        """Return which fraction of the walls is where walls were before, or the other way round; the lesser one."""
        if before is None or self.several or before.several or [*self.frames.values()] != [*before.frames.values()]:
            return 0.0
        mine, theirs = (one.walls_of(None).points(SAME) for one in (self, before))
        return float(min(np.mean(cKDTree(b).query(a)[0] <= SAME) for a, b in ((mine, theirs), (theirs, mine))))
