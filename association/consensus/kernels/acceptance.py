"""Pick the map's own segments, the pieces of walls, for a consensus set."""

import math

import numpy as np

from compiled import kernel
from registration.layout import Floats, Record, Records

from ...layout import BLOCKER, PAIR, Indices
from ...scan.kernels.ordering import ascending
from ...tables import Blockers, Lines, Pieces, PiecesAlong, Place, Sights, Workspace
from ..tuning import BLOCKING_RAYS, MAX_OTHERS, MIN_EXTENT, MOST_UNDER
from .sight import count_blockers


@kernel
def pieces_along(w: int, walls: Records, pieces: Pieces) -> PiecesAlong:
    """Order the pieces of a chain, of which `w` is the wall that begins first, by where they begin."""
    dx = walls[w].dx
    dy = walls[w].dy
    count = 0
    v = w
    while v >= 0:
        count += pieces.starts[v + 1] - pieces.starts[v]
        v = walls[v].after
    piece = np.empty(count, np.intp)
    wall = np.empty(count, np.intp)
    low = np.empty(count, np.float64)
    high = np.empty(count, np.float64)
    count = 0
    v = w
    while v >= 0:
        for k in range(pieces.starts[v], pieces.starts[v + 1]):
            p = pieces.items[k]
            one = pieces.ends[p].x1 * dx + pieces.ends[p].y1 * dy
            other = pieces.ends[p].x2 * dx + pieces.ends[p].y2 * dy
            piece[count] = p
            wall[count] = v
            low[count] = min(one, other)
            high[count] = max(one, other)
            count += 1
        v = walls[v].after
    place = ascending(low)
    farthest = np.empty(count, np.intp)
    gaps = np.zeros(count, np.float64)
    for k in range(count):
        farthest[k] = place[k]
        if k > 0:
            reach = farthest[k - 1]
            gaps[k] = gaps[k - 1] + max(0.0, low[place[k]] - high[reach])
            if high[place[k]] <= high[reach]:
                farthest[k] = reach
    return PiecesAlong(piece, wall, low, high, place, farthest, gaps)


@kernel
def begun(along: PiecesAlong, x: float) -> int:
    """Return how many pieces begin up to an abscissa."""
    first = 0
    last = len(along.place)
    while first < last:
        middle = (first + last) // 2
        if along.low[along.place[middle]] <= x:
            first = middle + 1
        else:
            last = middle
    return first


@kernel
def bare_up_to(along: PiecesAlong, x: float) -> float:
    """Return the length without pieces from the first of them to an abscissa, negative before it, metres."""
    k = begun(along, x)
    if k == 0:
        return x - along.low[along.place[0]]
    return along.gaps[k - 1] + max(0.0, x - along.high[along.farthest[k - 1]])


@kernel
def pieces_under(along: PiecesAlong, low: float, high: float, own: int, named: Indices) -> tuple[int, int]:
    """Find the pieces between two abscissae, and the one of them with the greatest overlap, of equal ones the first.

    One of the wall `own` on which more than half lies comes before those of others. Writes the first of them to `named`
    (`MAX_OTHERS` + 1,). Returns the place of the one with the greatest overlap, or of the nearest one where none
    overlaps, and how many are named. At most `MOST_UNDER` pieces are compared, and of those that begin before always
    the one that reaches farthest.
    """
    after = begun(along, high)
    before = begun(along, low)
    most = along.farthest[before - 1] if before > 0 else along.place[0]
    best = min(along.high[most], high) - max(along.low[most], low)
    if best < 0.0 and after < len(along.place) and high - along.low[along.place[after]] > best:
        most = along.place[after]
        best = high - along.low[most]
    half = 0.5 * (high - low)
    is_own = best > half and along.wall[most] == own
    count = 0
    # Backwards, as long as something before reaches so far.
    k = after - 1
    while k >= max(0, after - MOST_UNDER) and along.high[along.farthest[k]] > low:
        place = along.place[k]
        k -= 1
        overlap = min(along.high[place], high) - max(along.low[place], low)
        on_own = overlap > half and along.wall[place] == own
        longer = overlap > best or (overlap == best and along.piece[place] < along.piece[most])
        if (on_own and not is_own) or (on_own == is_own and longer):
            best = overlap
            most = place
            is_own = on_own
        if overlap > 0.0:
            count = insert(named, count, place)
    return most, count


@kernel
def insert(ascending_places: Indices, count: int, place: int) -> int:
    """Insert a place among the first `count` of some, in order; the last one is left out where there is no room."""
    if count == len(ascending_places):
        if place > ascending_places[count - 1]:
            return count
        count -= 1
    k = count
    while k > 0 and ascending_places[k - 1] > place:
        ascending_places[k] = ascending_places[k - 1]
        k -= 1
    ascending_places[k] = place
    return count + 1


@kernel
def chain_keys(matches: Records, lines: Lines, pieces: Pieces) -> Floats:
    """Return (n,) for each scan segment the first wall of the chain that it lies on, -1 for none."""
    keys = np.empty(len(lines.row_of), np.float64)
    for i in range(len(keys)):
        w = matches[lines.row_of[i]].wall
        keys[i] = pieces.firsts[w] if w >= 0 else -1.0
    return keys


@kernel
def accept_matches(
    matches: Records, lines: Lines, scan_ends: Records, pose: Records, walls: Records, pieces: Pieces
) -> tuple[Indices, Floats, Indices, Indices]:
    """Pick for every matched scan segment the piece of its wall that it lies on most, of equal ones the first.

    Or of the walls of its chain that it lies on. `pose` (1,). Of a line of several segments those count of which enough
    lies on the wall.

    Returns, by scan index, pairs (k, 2) of scan index and piece; the fraction of each segment that lies on pieces of
    these walls (k,); and the other pieces that it lies on: of pair i ``others[other_starts[i]:other_starts[i + 1]]``.

    The pieces of each wall are ordered once. So the time grows with their number and that of the segments, not with the
    product of both.
    """
    row_of = lines.row_of
    n = len(row_of)
    members = np.zeros(len(matches), np.int64)
    found = np.empty(n, PAIR)
    others_of = np.empty((n, MAX_OTHERS), np.intp)
    for i in range(n):
        members[row_of[i]] += 1
        found[i].piece = -1
    keys = chain_keys(matches, lines, pieces)
    order = ascending(keys)
    k = 0
    while k < n and keys[order[k]] < 0.0:
        k += 1
    while k < n:
        first = int(keys[order[k]])
        along = pieces_along(first, walls, pieces)
        while k < n and keys[order[k]] == first:
            i = order[k]
            found[i].piece = matches[row_of[i]].wall
            lay_on(scan_ends[i], pose[0], walls[first], along, found[i], others_of[i])
            if found[i].overlap < lines.least_overlap and members[row_of[i]] > 1:
                found[i].piece = -1
            k += 1
    return by_scan_index(found, others_of)


@kernel
def lay_on(segment: Record, pose: Record, wall: Record, along: PiecesAlong, out: Record, others: Indices) -> None:
    """Write to `out`, of `PAIR`, and `others` (`MAX_OTHERS`,) on which pieces a scan segment lies at a pose.

    The piece of `out` comes as the wall that is matched, of the chain whose first wall is `wall`.
    """
    c = math.cos(pose.theta)
    s = math.sin(pose.theta)
    begin = (c * segment.x1 - s * segment.y1 + pose.x) * wall.dx
    begin += (s * segment.x1 + c * segment.y1 + pose.y) * wall.dy
    end = (c * segment.x2 - s * segment.y2 + pose.x) * wall.dx
    end += (s * segment.x2 + c * segment.y2 + pose.y) * wall.dy
    low = min(begin, end)
    high = max(begin, end)
    named = np.empty(MAX_OTHERS + 1, np.intp)
    most, count = pieces_under(along, low, high, out.piece, named)
    out.piece = along.piece[most]
    out.overlap = 0.0
    if min(along.high[most], high) > max(along.low[most], low):
        bare = bare_up_to(along, high) - bare_up_to(along, low)
        out.overlap = max(0.0, 1.0 - bare / max(high - low, MIN_EXTENT))
    out.others = 0
    for k in range(count):
        if named[k] != most and out.others < MAX_OTHERS:
            others[out.others] = along.piece[named[k]]
            out.others += 1


@kernel
def by_scan_index(found: Records, others_of: Indices) -> tuple[Indices, Floats, Indices, Indices]:
    """Put pairs (n,) of `PAIR`, with the other pieces of each, into arrays, as `accept_matches` returns them."""
    count = 0
    total = 0
    for i in range(len(found)):
        if found[i].piece >= 0:
            count += 1
            total += found[i].others
    pairs = np.empty((count, 2), np.intp)
    overlaps = np.empty(count, np.float64)
    others = np.empty(total, np.intp)
    other_starts = np.zeros(count + 1, np.intp)
    pair = 0
    for i in range(len(found)):
        one = found[i]
        if one.piece >= 0:
            pairs[pair, 0] = i
            pairs[pair, 1] = one.piece
            overlaps[pair] = one.overlap
            for k in range(one.others):
                others[other_starts[pair] + k] = others_of[i, k]
            other_starts[pair + 1] = other_starts[pair] + one.others
            pair += 1
    return pairs, overlaps, others, other_starts


@kernel
def missing_pieces(
    sights: Sights, matches: Records, pose: Records, place: Place, pieces: Pieces, work: Workspace
) -> Indices:
    """List the pieces of walls that rays to the consensus set pass through, of which nothing was seen.

    `pose` (1,).
    """
    items = pieces.items
    piece_starts = pieces.starts
    blockers = Blockers(np.zeros(len(place.walls), BLOCKER), np.empty(len(place.walls), np.int64))
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
    missing = np.empty(count, np.intp)
    count = 0
    for k in range(passed):
        w = touched[k]
        if 2 * counts[w].to_matched >= BLOCKING_RAYS:
            for at in range(piece_starts[w], piece_starts[w + 1]):
                missing[count] = items[at]
                count += 1
    return missing
