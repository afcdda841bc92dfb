"""From a map's segments to walls: collinear pieces joined, one line through each group, sorted by direction."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from registration import Segments
from registration.layout import Records

from .errors import IndexingEndedError
from .kernels.walls import join_collinear, label_groups, list_begins
from .layout import ENDS, POINT, WALL, Integers, as_records
from .options import Deadline
from .tables import Walls
from .tuning import BEGIN_CELL, DIRECTION_BINS, MERGE_ANGLE, MERGE_LATERAL, PIECES_A_LOOK

Floats = NDArray[np.float64]


def both_ways(segments: Segments) -> Segments:
    """Return the segments, and behind them the same with begin and end exchanged."""
    return Segments.derived(np.concatenate([segments.endpoints, segments.endpoints[:, [2, 3, 0, 1]]]))


def merge(local: Segments, gap: float, deadline: Deadline | None = None) -> tuple[Walls, Integers]:
    """Put one line through each group of collinear pieces up to `gap` apart; a group that is not straight stays apart.

    Returns
    -------
    Walls
    (n,) the wall that each piece is part of

    Raises
    ------
    IndexingEndedError
        When the deadline passes first.
    """
    ends, directions = as_records(ENDS, local.endpoints), as_records(POINT, local.directions)
    labels = collinear_groups(ends, directions, gap, MERGE_LATERAL, math.cos(MERGE_ANGLE), deadline)
    wall, lines = _lines(local, labels)
    lateral = np.maximum(
        np.abs(np.einsum("ij,ij->i", lines.normals[wall], local.endpoints[:, :2]) - lines.offsets[wall]),
        np.abs(np.einsum("ij,ij->i", lines.normals[wall], local.endpoints[:, 2:]) - lines.offsets[wall]),
    )
    crooked = np.zeros(len(lines), dtype=bool)
    np.logical_or.at(crooked, wall, lateral > MERGE_LATERAL)
    if crooked.any():
        wall, lines = _lines(local, np.where(crooked[wall], np.arange(len(labels)) + len(labels), labels))
    return _sorted(local, wall, lines)


def collinear_groups(
    ends: Records,
    directions: Records,
    max_gap: float,
    max_lateral: float,
    min_cos: float,
    deadline: Deadline | None = None,
) -> Integers:
    """Label pieces that continue or repeat one another, see `join_collinear`: (n,) the lowest index of each group.

    Raises
    ------
    IndexingEndedError
        When the deadline passes first.
    """
    labels = np.arange(len(ends))
    # Small, so that in a dense map there are few to compare; a begin is at most one cell away from where it is sought.
    cell = max(BEGIN_CELL, 1.01 * math.hypot(max_gap, max_lateral))
    heads, following = list_begins(ends, cell)
    gates = (cell, float(max_gap), float(max_lateral), float(min_cos))
    for first in range(0, len(ends), PIECES_A_LOOK):
        if deadline is not None and deadline.over:
            raise IndexingEndedError
        last = min(first + PIECES_A_LOOK, len(ends))
        join_collinear(ends, directions, heads, following, gates, labels, first, last)
    label_groups(labels)
    return labels


class _Lines:
    """A line through each group of pieces: unit directions (m, 2), left normals (m, 2), offsets (m,)."""

    def __init__(self, local: Segments, wall: NDArray[np.intp], count: int) -> None:
        d = np.zeros((count, 2))
        np.add.at(d, wall, local.directions * local.lengths[:, None])
        d /= np.linalg.norm(d, axis=1)[:, None]
        self.directions = d
        self.normals = np.stack([-d[:, 1], d[:, 0]], axis=1)
        weight = np.bincount(wall, local.lengths, count)
        offsets = np.einsum("ij,ij->i", self.normals[wall], local.midpoints)
        self.offsets = np.bincount(wall, local.lengths * offsets, count) / weight

    def __len__(self) -> int:
        return len(self.offsets)


def _lines(local: Segments, labels: Integers) -> tuple[NDArray[np.intp], _Lines]:
    """Return the group of each piece, counted from 0, and the groups' lines."""
    _, wall = np.unique(labels, return_inverse=True)
    return wall, _Lines(local, wall, int(wall.max()) + 1)


def _sorted(local: Segments, wall: NDArray[np.intp], lines: _Lines) -> tuple[Walls, Integers]:
    """Order the lines by direction bin, the longest of a bin first, as far as their pieces reach."""
    m, d = len(lines), lines.directions
    begins, ends = np.full(m, np.inf), np.full(m, -np.inf)
    np.minimum.at(begins, wall, np.einsum("ij,ij->i", d[wall], local.endpoints[:, :2]))
    np.maximum.at(ends, wall, np.einsum("ij,ij->i", d[wall], local.endpoints[:, 2:]))
    angles = np.arctan2(d[:, 1], d[:, 0])
    bins = direction_bin(angles)
    order = np.lexsort((np.arange(m), begins - ends, bins))
    rows = np.zeros(m, WALL)
    columns = (d[:, 0], d[:, 1], lines.offsets, begins, ends, angles)
    for name, values in zip(("dx", "dy", "offset", "begin", "end", "angle"), columns, strict=True):
        rows[name] = values[order]
    rows["before"] = rows["after"] = -1
    longest = (ends - begins)[order]
    place = np.empty(m, dtype=np.int32)
    place[order] = np.arange(m)
    starts = np.searchsorted(bins[order], np.arange(DIRECTION_BINS + 1))
    return Walls(rows, starts, longest, np.concatenate([[0.0], np.cumsum(longest)])), place[wall]


def link(walls: Walls, run: Integers) -> None:
    """Name in each wall its neighbours on its run, (m,)."""
    order = np.lexsort((walls.rows["begin"], run))
    before, after = order[:-1], order[1:]
    same = run[before] == run[after]
    walls.rows["before"][after[same]] = before[same]
    walls.rows["after"][before[same]] = after[same]


def direction_bin(angles: Floats) -> NDArray[np.intp]:
    """Return the direction bin of each angle, radians in (-pi, pi]."""
    return np.minimum(((angles + np.pi) * (DIRECTION_BINS / math.tau)).astype(np.intp), DIRECTION_BINS - 1)


def ends_of(walls: Walls) -> Floats:
    """Return (m, 4) begin and end, metres in the index frame."""
    return ends_of_rows(walls.rows)


def ends_of_rows(rows: Records) -> Floats:
    """Return the same of walls or runs, (m,) of `WALL`."""
    dx, dy, offset, begin, end = (rows[name] for name in ("dx", "dy", "offset", "begin", "end"))
    a = np.column_stack([dx * begin - dy * offset, dy * begin + dx * offset])
    b = np.column_stack([dx * end - dy * offset, dy * end + dx * offset])
    return np.hstack([a, b])
