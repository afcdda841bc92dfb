"""Compiled report of a consensus set in the map's own pieces."""

import math

import numpy as np

from registration.allocating import empty, zeros
from registration.compiling import inlined, internal, kernel
from registration.layout import Floats, Records

from ..layout import BLOCKER, Indices
from ..tables import Blockers, Lines, Pieces, Place, Sights, Workspace
from ..tuning import BLOCKING_RAYS, BRIDGING, MAX_RIVALS, MIN_EXTENT
from .ordering import ascending
from .sight import count_blockers


@kernel
def union_length(lows: Floats, highs: Floats, count: int) -> float:
    """Return the length of the union of the first `count` intervals."""
    if count == 1:
        return highs[0] - lows[0]
    total = 0.0
    reach = -math.inf
    for k in ascending(lows[:count]):
        start = max(lows[k], reach)
        if highs[k] > start:
            total += highs[k] - start
            reach = highs[k]
    return total


@inlined
def first_wall(walls: Records, w: int, bridging: bool) -> int:
    """Return the first wall of the run that wall `w` is on, or itself where nothing may bridge a doorway."""
    while bridging and walls[w].before >= 0:
        w = walls[w].before
    return w


@internal
@kernel
def accept_matches(
    matches: Records, lines: Lines, scan_ends: Records, pose: Records, walls: Records, pieces: Pieces
) -> tuple[Indices, Floats, Indices, Indices]:
    """Pick for every matched scan segment the piece of its wall that it lies on most, of equal ones the first.

    `pose` (1,). Of a line of several segments those count of which enough lies on the wall. Returns, by scan index,
    pairs (k, 2) of scan index and piece; the share of each segment that lies on pieces of its wall, or of its run where
    it may bridge doorways (k,); and the other pieces that it lies on: of pair i
    ``rivals[rival_starts[i]:rival_starts[i + 1]]``.
    """
    items = pieces.items
    piece_starts = pieces.starts
    ends = pieces.ends
    at = pose[0]
    row_of = lines.row_of
    n = len(row_of)
    members = zeros(len(matches), np.int64)
    wall_of = np.full(n, -1)
    bridging = zeros(n, np.bool_)
    most_pieces = 0
    found = 0
    for i in range(n):
        members[row_of[i]] += 1
        w = matches[row_of[i]].wall
        if w >= 0:
            bridging[i] = lines.rows[row_of[i]].length > BRIDGING
            w = first_wall(walls, w, bridging[i])
            wall_of[i] = w
            under = 0
            while w >= 0:
                under += piece_starts[w + 1] - piece_starts[w]
                w = walls[w].after if bridging[i] else -1
            most_pieces = max(most_pieces, under)
            found += 1
    pairs = empty((found, 2), np.intp)
    overlaps = empty(found, np.float64)
    rivals = empty(found * MAX_RIVALS, np.intp)
    rival_starts = zeros(found + 1, np.intp)
    lows = empty(most_pieces, np.float64)
    highs = empty(most_pieces, np.float64)
    covering = empty(most_pieces, np.intp)
    c = math.cos(at.theta)
    s = math.sin(at.theta)
    pair = 0
    for i in range(n):
        w = wall_of[i]
        if w < 0:
            continue
        dx = walls[w].dx
        dy = walls[w].dy
        begin = (c * scan_ends[i].x1 - s * scan_ends[i].y1 + at.x) * dx
        begin += (s * scan_ends[i].x1 + c * scan_ends[i].y1 + at.y) * dy
        end = (c * scan_ends[i].x2 - s * scan_ends[i].y2 + at.x) * dx
        end += (s * scan_ends[i].x2 + c * scan_ends[i].y2 + at.y) * dy
        low = min(begin, end)
        high = max(begin, end)
        best = -math.inf
        most = -1
        count = 0
        while w >= 0:
            for k in range(piece_starts[w], piece_starts[w + 1]):
                p = items[k]
                first = ends[p].x1 * dx + ends[p].y1 * dy
                last = ends[p].x2 * dx + ends[p].y2 * dy
                start = max(min(first, last), low)
                stop = min(max(first, last), high)
                if stop - start > best or (stop - start == best and p < most):
                    best = stop - start
                    most = p
                if stop > start:
                    lows[count] = start
                    highs[count] = stop
                    covering[count] = p
                    count += 1
            w = walls[w].after if bridging[i] else -1
        overlap = 0.0
        if count > 0:
            overlap = min(1.0, union_length(lows, highs, count) / max(high - low, MIN_EXTENT))
        if overlap < lines.least_overlap and members[row_of[i]] > 1:
            continue
        pairs[pair, 0] = i
        pairs[pair, 1] = most
        overlaps[pair] = overlap
        stop_at = rival_starts[pair]
        for k in range(count):
            if covering[k] != most and stop_at < rival_starts[pair] + MAX_RIVALS:
                rivals[stop_at] = covering[k]
                stop_at += 1
        rival_starts[pair + 1] = stop_at
        pair += 1
    return pairs[:pair], overlaps[:pair], rivals[: rival_starts[pair]], rival_starts[: pair + 1]


@internal
@kernel
def missing_pieces(
    sights: Sights, matches: Records, pose: Records, place: Place, pieces: Pieces, work: Workspace
) -> Indices:
    """List the pieces of walls that rays to the consensus set pass through, of which nothing was seen.

    `pose` (1,).
    """
    items = pieces.items
    piece_starts = pieces.starts
    blockers = Blockers(zeros(len(place.walls), BLOCKER), empty(len(place.walls), np.int64))
    counts = blockers.counts
    touched = blockers.touched
    passed = count_blockers(sights, matches, pose[0], place, blockers, work.scratch[0].ray)
    # A wall that holds part of the consensus set was seen, and at a grazing angle rays to its neighbour pass its end.
    for i in range(len(matches)):
        w = matches[i].wall
        if w >= 0:
            counts[w].to_matched = 0
    count = 0
    for k in range(passed):
        w = touched[k]
        if 2 * counts[w].to_matched >= BLOCKING_RAYS:
            count += piece_starts[w + 1] - piece_starts[w]
    missing = empty(count, np.intp)
    count = 0
    for k in range(passed):
        w = touched[k]
        if 2 * counts[w].to_matched >= BLOCKING_RAYS:
            for at in range(piece_starts[w], piece_starts[w + 1]):
                missing[count] = items[at]
                count += 1
    return missing
