"""Several maps in one index: each is shifted to a place of its own, so far from the others that nothing crosses.

One search then finds the best pose of all maps, and one verdict weighs alternatives on all of them. Wall chains and
rays end within a map, because the gap between two maps is longer than any of them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

from registration import Segments
from registration.layout import Floats

from ..deadline import Deadline
from ..errors import InvalidMapError
from ..layout import Integers
from ..tuning import EXCEEDING, FAR, FARTHER, MODEL_OFFSET, REACH
from .map_index import MapIndex, tables_of
from .map_points import NO_POINTS, MapPoints
from .merging import both_ways
from .tuning import CELL

MOST_MAPS = 256  # the contract
LEAST_MAP_GAP = 100.0  # m, geometry; between two maps, for scans that are up to 65 m wide
# By which the places of neighbouring maps differ across their row: a pose that is free along a corridor of one map is
# no pose of the next one.
STAGGER = 3.0  # m, geometry
POSES_A_MAP = 2  # geometry; so many poses are kept for each map at least, so that each map can be listed


@dataclass(frozen=True, slots=True)
class MapPart:
    """One of several maps.

    Attributes
    ----------
    segments : Segments
        As sent, in the map's own frame.
    sigma : float or None
        Standard deviation of its lines normal to themselves, metres; None: unknown.
    oriented : bool
        True if free space lies on the left of its segments.
    points : MapPoints
        Objects too small for a wall.
    frame_id : str or None
        Name of the map's own frame.
    """

    segments: Segments
    sigma: float | None = None
    oriented: bool = True
    points: MapPoints = NO_POINTS
    frame_id: str | None = None

    @classmethod
    def of(cls, index: MapIndex) -> MapPart:
        """Return the map of an index."""
        segments = index.segments if index.oriented else index.segments.take(np.arange(index.directed))
        return cls(segments, index.sigma, index.oriented, index.points, index.frame_id)

    def indexed(self, deadline: Deadline | None = None) -> MapIndex:
        """Return the index of this map alone; raises `InvalidMapError` and `IndexingEndedError` as `MapIndex.build`."""
        how, points, frame = self.oriented, self.points, self.frame_id
        return MapIndex.build(self.segments, self.sigma, oriented=how, points=points, frame_id=frame, deadline=deadline)


@dataclass(frozen=True)
class JointIndex(MapIndex):
    """The index of several maps together, in a joint frame; immutable, shared between threads.

    Build with :meth:`of_parts`.

    Attributes
    ----------
    parts : tuple of MapPart
    gap : float
        Least distance between the boxes of two maps, metres.
    shifts : (k, 2)
        Joint frame less the map's own frame, whole metres.
    starts : (k + 1,)
        Segments ``starts[m]`` to ``starts[m + 1]`` are those of map m.
    boxes : (k, 4)
        Around each map in the joint frame: min_x, min_y, max_x, max_y; metres.
    """

    parts: tuple[MapPart, ...]
    gap: float
    shifts: Floats
    starts: Integers
    boxes: Floats

    @classmethod
    def of_parts(
        cls, parts: Sequence[MapPart], gap: float, *, oriented: bool = True, deadline: Deadline | None = None
    ) -> Self:
        """Index several maps, each at its own place.

        Parameters
        ----------
        parts : sequence of MapPart
            At least one, each with a segment; see `checked_parts`.
        gap : float
            Least distance between two maps, metres.
        oriented : bool
            False lists every segment in both directions.
        deadline : Deadline, optional
            Looked at every few tenths of a second.

        Raises
        ------
        IndexingEndedError
            When the deadline passes, or is cancelled, first.
        """
        own = np.array([_box(part.segments) for part in parts])
        shifts = places_of(own, gap) - np.round(0.5 * (own[:, :2] + own[:, 2:]))
        counts = [len(part.segments) for part in parts]
        shifted = [part.segments.shifted(by).endpoints for part, by in zip(parts, shifts, strict=True)]
        segments = Segments.derived(np.concatenate(shifted))
        directed, sigma = len(segments), joint_sigma([part.sigma for part in parts])
        either = segments if oriented else both_ways(segments)
        tables, points = tables_of(either, sigma, deadline), joint_points(parts, own, shifts)
        starts = np.concatenate([[0], np.cumsum(counts)])
        boxes = own + np.tile(shifts, 2)
        together = tuple(parts), float(gap), shifts, starts, boxes
        return cls(either, sigma, np.zeros(2), directed, points, parts[0].frame_id, *tables, *together).warmed()

    def _undirected(self, deadline: Deadline | None) -> JointIndex:
        return JointIndex.of_parts(self.parts, self.gap, oriented=False, deadline=deadline)

    @cached_property
    def area(self) -> float:
        """Of the maps' boxes with their margins together, without the gaps, m^2: so many poses there are to confuse."""
        width, height = np.ceil(np.ptp(self.boxes.reshape(-1, 2, 2), axis=1) + 2.0 * (REACH + CELL)).T
        return float((width * height).sum())

    @cached_property
    def diagonal(self) -> float:
        """Of the box around the largest map, metres."""
        return largest_diagonal(self.parts)

    @property
    def across(self) -> float:
        """Return the number of cells of the grid that a ray passes at most: it ends in the gap around its map."""
        sizes = np.ptp(self.boxes.reshape(-1, 2, 2), axis=1).sum(axis=1)
        return min(super().across, float(sizes.max() + 2.0 * self.gap) / float(self.grid.shape["cell"][0]))

    @property
    def least_kept(self) -> int:
        """Return the number of poses that are kept at least, so that each map can be listed."""
        return POSES_A_MAP * len(self.parts)

    def map_of(self, segments: Integers) -> Integers:
        """Return the map of each segment of the joint index, (n,)."""
        found: Integers = np.searchsorted(self.starts, segments, side="right") - 1
        return found

    def map_at(self, points: Floats) -> Integers:
        """Return the map whose box is nearest to each point (n, 2) of the joint frame, (n,)."""
        outside = np.maximum(self.boxes[:, :2] - points[:, None], points[:, None] - self.boxes[:, 2:])
        found: Integers = np.hypot(*np.moveaxis(np.maximum(outside, 0.0), 2, 0)).argmin(axis=1)
        return found


def checked_parts(parts: Sequence[MapPart]) -> tuple[MapPart, ...]:
    """Return maps that can be searched together.

    Raises
    ------
    InvalidMapError
        When there are none or more than `MOST_MAPS`, or one is empty, too wide, or has a sigma out of range; its
        argument is ``maps`` or, of one map, ``maps.3.segments``.
    """
    if not 1 <= len(parts) <= MOST_MAPS:
        raise InvalidMapError(f"expected 1 to {MOST_MAPS} maps, found {len(parts)}", argument="maps")
    for number, part in enumerate(parts):
        MapIndex.require(part.segments, part.sigma, f"maps.{number}.")
    return tuple(parts)


def joint_sigma(sigmas: Sequence[float | None]) -> float | None:
    """Return the standard deviation of the walls of several maps, metres; None: it is estimated for each answer.

    All maps are searched with the same gates, so that no map has an advantage: those of the least exact one. Maps
    whose error is unknown count as `MODEL_OFFSET`, which every map is allowed anyway.
    """
    if len(set(sigmas)) == 1:
        return sigmas[0]
    known = [sigma for sigma in sigmas if sigma is not None]
    largest = max(known)
    return None if len(known) < len(sigmas) and largest <= MODEL_OFFSET else largest


def joint_points(parts: Sequence[MapPart], boxes: Floats, shifts: Floats) -> MapPoints:
    """Return the points of several maps, near their boxes (k, 4), moved by their shifts (k, 2), metres.

    All have the sigma of the least exact of these maps.
    """
    near = [part.points.near(box[:2], box[2:]) for part, box in zip(parts, boxes, strict=True)]
    moved = [points.shifted(shift) for points, shift in zip(near, shifts, strict=True) if len(points)]
    if not moved:
        return NO_POINTS
    together = np.concatenate([points.positions for points in moved])
    return MapPoints(together, max(points.sigma for points in moved))


def gap_of(extent: float) -> float:
    """Return the least gap between maps for a scan of some extent, metres: no ray from one map reaches another."""
    return max(LEAST_MAP_GAP, float(math.ceil(max(FAR, FARTHER * extent))))


def usual_gap(parts: Sequence[MapPart]) -> float:
    """Return the gap that suffices for each scan that is no wider than the largest of the maps, metres."""
    return gap_of(EXCEEDING * largest_diagonal(parts))


def largest_diagonal(parts: Sequence[MapPart]) -> float:
    """Return the diagonal of the box around the largest map, metres."""
    boxes = np.array([_box(part.segments) for part in parts])
    return float(np.hypot(*(boxes[:, 2:] - boxes[:, :2]).T).max())


def places_of(boxes: Floats, gap: float) -> NDArray[np.float64]:
    """Lay boxes (k, 4) out in rows, the highest first; return their centres about the origin, (k, 2) whole metres.

    Neighbours are staggered, so that no wall of a map continues one of another map, however far.
    """
    sizes = np.ceil(boxes[:, 2:] - boxes[:, :2])
    order = np.lexsort((np.arange(len(boxes)), -sizes[:, 0], -sizes[:, 1]))
    widest = max(float(sizes[:, 0].max() + gap), math.sqrt(float((sizes + gap).prod(axis=1).sum())))
    corners = np.zeros((len(boxes), 2))
    x = y = height = 0.0
    row = column = 0
    for m in order.tolist():
        if column and x + sizes[m, 0] > widest:
            row, column, y = row + 1, 0, y + height + gap
            x, height = STAGGER * row, 0.0
        corners[m] = x, y + STAGGER * column
        height = max(height, sizes[m, 1] + STAGGER * column)
        x += sizes[m, 0] + gap
        column += 1
    centres = np.round(corners + 0.5 * sizes)
    return np.asarray(centres - np.round(0.5 * (corners.min(axis=0) + (corners + sizes).max(axis=0))))


def _box(segments: Segments) -> Floats:
    corners = segments.endpoints.reshape(-1, 2)
    return np.concatenate([corners.min(axis=0), corners.max(axis=0)])
