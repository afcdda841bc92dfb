"""From a map's segments to walls: collinear pieces joined, one line through each group, sorted by direction.

Walls are joined where they are one line to rounding. Those that nearly are keep lines of their own, and are tied: how
much they are one wall falls smoothly with the step and the gap between them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from registration import Segments
from registration.layout import Records

from ..deadline import Deadline
from ..errors import IndexingEndedError
from ..layout import ENDS, POINT, WALL, Integers, as_records
from ..tables import JoinGates, Walls
from ..tuning import APART_STEP, BASE_SLACK, BASE_SLACK_SHARE, DIRECTION_BINS
from .kernels.walls import blend_walls, join_collinear, list_begins, tie_walls
from .tuning import (
    BEGIN_CELL,
    CHAIN_GAP,
    LEAST_DIFFERENCE,
    LINK_GAP,
    MERGE_ANGLE,
    MERGE_GAP,
    MERGE_LATERAL,
    PIECES_A_LOOK,
)

Floats = NDArray[np.float64]


def both_ways(segments: Segments) -> Segments:
    """Return the segments, and behind them the same with begin and end exchanged."""
    return Segments.derived(np.concatenate([segments.endpoints, segments.endpoints[:, [2, 3, 0, 1]]]))


def merge(local: Segments, gap: float, beside: float, deadline: Deadline | None = None) -> tuple[Walls, Integers]:
    """Put one line through each group of collinear pieces up to `gap` apart, and `beside` one another, metres.

    A group that is not straight stays apart.

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
    labels = collinear_groups(ends, directions, join_gates(gap, beside), deadline)
    wall = _numbered(labels)
    lines = _Lines.of(local, wall)
    both = local.endpoints.reshape(-1, 2, 2)
    lateral = np.abs(np.einsum("ij,ikj->ik", lines.normals[wall], both) - lines.offsets[wall, None]).max(axis=1)
    crooked = np.zeros(len(lines), dtype=bool)
    crooked[wall[lateral > beside]] = True
    if crooked.any():
        wall = _numbered(np.where(crooked[wall], np.arange(len(labels)) + len(labels), labels))
        lines = _Lines.of(local, wall)
    return _sorted(local, wall, lines)


def collinear_groups(ends: Records, directions: Records, gates: JoinGates, deadline: Deadline | None) -> Integers:
    """Label pieces that continue or repeat one another, see `join_collinear`: (n,) the lowest index of each group.

    Raises
    ------
    IndexingEndedError
        When the deadline passes first.
    """
    labels = np.arange(len(ends))
    heads = np.full(1 << (2 * len(ends) - 1).bit_length(), -1)
    following = list_begins(ends, gates.cell, heads)
    for first in range(0, len(ends), PIECES_A_LOOK):
        if deadline is not None and deadline.passed:
            raise IndexingEndedError
        last = min(first + PIECES_A_LOOK, len(ends))
        join_collinear(ends, directions, heads, following, gates, labels, first, last)
    while not np.array_equal(labels, upper := labels[labels]):
        labels = upper
    return labels


def join_gates(gap: float, lateral: float) -> JoinGates:
    """Return when pieces up to `gap` apart, and `lateral` next to one another, metres, are joined."""
    # Small, so that in a dense map there are few to compare; a begin is at most one cell away from where it is sought.
    cell = max(BEGIN_CELL, 1.01 * math.hypot(gap, lateral))
    return JoinGates(cell, float(gap), float(lateral), math.cos(MERGE_ANGLE))


@dataclass(frozen=True, slots=True)
class _Lines:
    """A line through each group of pieces: unit directions (m, 2), offsets along the left normals (m,)."""

    directions: Floats
    offsets: Floats

    def __len__(self) -> int:
        return len(self.offsets)

    @property
    def normals(self) -> Floats:
        """To the left, (m, 2)."""
        return np.column_stack([-self.directions[:, 1], self.directions[:, 0]])

    @classmethod
    def of(cls, local: Segments, wall: NDArray[np.intp]) -> _Lines:
        """Return the lines of pieces (n,), by their lengths; `wall` (n,): the group of each, counted from 0."""
        weights, count = local.lengths, int(wall.max()) + 1
        sums = np.column_stack([np.bincount(wall, weights * along, count) for along in local.directions.T])
        lines = cls(sums / np.linalg.norm(sums, axis=1)[:, None], np.zeros(count))
        offsets = np.einsum("ij,ij->i", lines.normals[wall], local.midpoints)
        return cls(lines.directions, np.bincount(wall, weights * offsets, count) / np.bincount(wall, weights, count))


def _numbered(labels: Integers) -> NDArray[np.intp]:
    """Return the group of each piece, counted from 0."""
    return np.unique(labels, return_inverse=True)[1]


def _sorted(local: Segments, wall: NDArray[np.intp], lines: _Lines) -> tuple[Walls, Integers]:
    """Order the lines by direction bin, the longest of a bin first, as far as their pieces reach.

    Lines whose lengths are equal to `LEAST_DIFFERENCE` keep their order. The last bits of a length differ between
    processors, and must not decide it.
    """
    m, d = len(lines), lines.directions
    begins, ends = np.full(m, np.inf), np.full(m, -np.inf)
    np.minimum.at(begins, wall, np.einsum("ij,ij->i", d[wall], local.endpoints[:, :2]))
    np.maximum.at(ends, wall, np.einsum("ij,ij->i", d[wall], local.endpoints[:, 2:]))
    angles = np.arctan2(d[:, 1], d[:, 0])
    bins = direction_bin(angles)
    order = np.lexsort((np.arange(m), -np.rint((ends - begins) / LEAST_DIFFERENCE), bins))
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


def chains_of(walls: Walls, deadline: Deadline | None = None) -> Walls:
    """Return the lines that a segment of a base may lie on, though it lies on several walls.

    These are lines through walls that nearly continue one another, across doorways, too. In addition to them there are
    lines through walls that do so with larger steps, so that a wall with a step is still found.
    """
    nearly, _ = merge(Segments.derived(ends_of(walls)), MERGE_GAP, MERGE_LATERAL, deadline)
    chains, _ = merge(Segments.derived(ends_of(nearly)), CHAIN_GAP, MERGE_LATERAL, deadline)
    stepped, line = merge(Segments.derived(ends_of(chains)), CHAIN_GAP, APART_STEP, deadline)
    longest = np.zeros(len(stepped.rows))
    np.maximum.at(longest, line, chains.longest)
    # As much as a segment may stick out it may lie on one of them.
    joined = stepped.rows[longest < (1.0 - BASE_SLACK_SHARE) * stepped.longest - BASE_SLACK]
    if not len(joined):
        return chains
    both = np.vstack([ends_of(chains), ends_of_rows(joined)])
    local, each = Segments.derived(both), np.arange(len(both))
    every, _ = _sorted(local, each, _Lines.of(local, each))
    return every


class _Linked:
    """Walls that continue one another: the group of each, (m,), and their order group by group, by begin and by end."""

    def __init__(self, walls: Walls, deadline: Deadline | None) -> None:
        ends = ends_of(walls)
        directions = np.column_stack([walls.rows["dx"], walls.rows["dy"]])
        records = as_records(ENDS, ends), as_records(POINT, directions)
        for one in records:
            one.flags.writeable = False  # as those of segments: a kernel is compiled for each kind
        self.of_wall = collinear_groups(*records, join_gates(LINK_GAP, APART_STEP), deadline)
        # Along the common direction of the walls of a group, for their own directions differ.
        common = np.zeros((len(ends), 2))
        np.add.at(common, self.of_wall, directions * walls.longest[:, None])
        common = common[self.of_wall]
        begins, stops = np.einsum("ij,ij->i", common, ends[:, :2]), np.einsum("ij,ij->i", common, ends[:, 2:])
        self.by_begin, self.by_end = np.lexsort((begins, self.of_wall)), np.lexsort((stops, self.of_wall))


def tie(walls: Walls, deadline: Deadline | None = None) -> tuple[Floats, Integers]:
    """Name in each wall the next ones of its group.

    The wall before another is that which ends next before it, the one after it that which begins next.

    Returns
    -------
    (m,) how the walls are tied: see `Place.ties`
    (m,) of the group of each, the wall that begins first
    """
    linked = _Linked(walls, deadline)
    for name, order in (("after", linked.by_begin), ("before", linked.by_end[::-1])):
        one, other = order[:-1], order[1:]
        same = linked.of_wall[one] == linked.of_wall[other]
        walls.rows[name][one[same]] = other[same]
    begins = linked.of_wall[linked.by_begin]
    firsts = linked.by_begin[np.searchsorted(begins, linked.of_wall)]
    return np.asarray(tie_walls(walls.rows, linked.by_begin, linked.of_wall, APART_STEP)), firsts


def blended(
    local: Segments, walls: Walls, wall_of_piece: NDArray[np.intp], apart: float, deadline: Deadline | None = None
) -> tuple[Walls, Integers]:
    """Return the walls on lines that they have in common with those that continue or repeat them.

    The more so the smaller the step is; with one of `apart`, metres, not at all.

    Returns
    -------
    Walls
    (n,) the wall that each piece is part of
    """
    linked = _Linked(walls, deadline)
    ties = tie_walls(walls.rows, linked.by_begin, linked.of_wall, apart)
    dx, dy, offsets = blend_walls(walls.rows, walls.longest, linked.by_begin, linked.of_wall, ties)
    return _sorted(local, wall_of_piece, _Lines(np.column_stack([dx, dy]), offsets))


def direction_bin(angles: Floats) -> NDArray[np.intp]:
    """Return the direction bin of each angle, radians in (-pi, pi]."""
    return np.minimum(((angles + np.pi) * (DIRECTION_BINS / math.tau)).astype(np.intp), DIRECTION_BINS - 1)


def ends_of(walls: Walls) -> Floats:
    """Return (m, 4) begin and end, metres in the index frame."""
    return ends_of_rows(walls.rows)


def ends_of_rows(rows: Records) -> Floats:
    """Return the same of walls or chains, (m,) of `WALL`."""
    dx, dy, offset, begin, end = (rows[name] for name in ("dx", "dy", "offset", "begin", "end"))
    a = np.column_stack([dx * begin - dy * offset, dy * begin + dx * offset])
    b = np.column_stack([dx * end - dy * offset, dy * end + dx * offset])
    return np.hstack([a, b])
