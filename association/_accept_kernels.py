"""Compiled report of a consensus set in the map's own pieces. See `_match_kernels` for the arrays.

Wall w consists of ``pieces[piece_starts[w]:piece_starts[w + 1]]``, whose `endpoints` (n, 4) are in the index frame.
"""

import math

import numpy as np

from registration.compiling import inlined, kernel

from ._match_kernels import BRIDGING
from ._sight_kernels import BLOCKING_RAYS, SIGHT_TOLERANCE, count_blockers

MAX_RIVALS = 8  # of one pair
MIN_EXTENT = 1e-9  # m; what a segment along a wall counts as at least


@kernel
def union_length(lows, highs, count):
    """Return the length of the union of the first `count` intervals."""
    if count == 1:
        return highs[0] - lows[0]
    total = 0.0
    reach = -math.inf
    for k in np.argsort(lows[:count]):
        start = max(lows[k], reach)
        if highs[k] > start:
            total += highs[k] - start
            reach = highs[k]
    return total


@inlined
def first_wall(walls, w, bridging):
    """Return the first wall of the run that wall `w` is on, or itself where nothing may bridge a doorway."""
    while bridging and walls[w, 6] >= 0:
        w = int(walls[w, 6])
    return w


@kernel
def accept_matches(matches, order, scan_endpoints, theta, x, y, walls, pieces, piece_starts, endpoints):
    """Pick for every matched scan segment the piece of its wall that it lies on most, of equal ones the first.

    `order` (n,) is the scan index of each row of `matches`; the pose is in the index frame. Returns, by scan index,
    pairs (k, 2) of scan index and piece; the share of each segment that lies on pieces of its wall, or of its run where
    it may bridge doorways (k,); and the other pieces that it lies on: of pair i
    ``rivals[rival_starts[i]:rival_starts[i + 1]]``.
    """
    n = len(order)
    wall_of = np.full(n, -1)
    bridging = np.zeros(n, dtype=np.bool_)
    most_pieces = 0
    found = 0
    for row in range(n):
        w = int(matches[row, 0])
        if w >= 0:
            i = order[row]
            length = math.hypot(
                scan_endpoints[i, 2] - scan_endpoints[i, 0], scan_endpoints[i, 3] - scan_endpoints[i, 1]
            )
            bridging[i] = length > BRIDGING
            w = first_wall(walls, w, bridging[i])
            wall_of[i] = w
            under = 0
            while w >= 0:
                under += piece_starts[w + 1] - piece_starts[w]
                w = int(walls[w, 7]) if bridging[i] else -1
            most_pieces = max(most_pieces, under)
            found += 1
    pairs = np.empty((found, 2), dtype=np.intp)
    overlaps = np.empty(found)
    rivals = np.empty(found * MAX_RIVALS, dtype=np.intp)
    rival_starts = np.zeros(found + 1, dtype=np.intp)
    lows = np.empty(most_pieces)
    highs = np.empty(most_pieces)
    covering = np.empty(most_pieces, dtype=np.intp)
    c = math.cos(theta)
    s = math.sin(theta)
    pair = 0
    for i in range(n):
        w = wall_of[i]
        if w < 0:
            continue
        dx = walls[w, 0]
        dy = walls[w, 1]
        begin = (c * scan_endpoints[i, 0] - s * scan_endpoints[i, 1] + x) * dx
        begin += (s * scan_endpoints[i, 0] + c * scan_endpoints[i, 1] + y) * dy
        end = (c * scan_endpoints[i, 2] - s * scan_endpoints[i, 3] + x) * dx
        end += (s * scan_endpoints[i, 2] + c * scan_endpoints[i, 3] + y) * dy
        low = min(begin, end)
        high = max(begin, end)
        best = -math.inf
        most = -1
        count = 0
        while w >= 0:
            for k in range(piece_starts[w], piece_starts[w + 1]):
                p = pieces[k]
                first = endpoints[p, 0] * dx + endpoints[p, 1] * dy
                last = endpoints[p, 2] * dx + endpoints[p, 3] * dy
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
            w = int(walls[w, 7]) if bridging[i] else -1
        pairs[pair, 0] = i
        pairs[pair, 1] = most
        overlaps[pair] = min(1.0, union_length(lows, highs, count) / max(high - low, MIN_EXTENT))
        stop_at = rival_starts[pair]
        for k in range(count):
            if covering[k] != most and stop_at < rival_starts[pair] + MAX_RIVALS:
                rivals[stop_at] = covering[k]
                stop_at += 1
        rival_starts[pair + 1] = stop_at
        pair += 1
    return pairs, overlaps, rivals[: rival_starts[found]], rival_starts


@kernel
def missing_pieces(
    scan, matches, viewpoint_x, viewpoint_y, theta, x, y, walls, starts, items, shape, pieces, piece_starts
):
    """List the pieces of walls that rays to the consensus set pass through, of which nothing was seen."""
    viewpoint = np.empty(2)
    viewpoint[0] = viewpoint_x
    viewpoint[1] = viewpoint_y
    pose = np.empty(3)
    pose[0] = theta
    pose[1] = x
    pose[2] = y
    to_matched = np.zeros(len(walls), dtype=np.int64)
    to_clutter = np.zeros(len(walls), dtype=np.int64)
    touched = np.empty(len(walls), dtype=np.int64)
    blockers = count_blockers(
        scan, matches, viewpoint, pose, walls, starts, items, shape, SIGHT_TOLERANCE, to_matched, to_clutter, touched
    )
    # A wall that holds part of the consensus set was seen, and at a grazing angle rays to its neighbour pass its end.
    for i in range(len(scan)):
        w = int(matches[i, 0])
        if w >= 0:
            to_matched[w] = 0
    count = 0
    for k in range(blockers):
        w = touched[k]
        if 2 * to_matched[w] >= BLOCKING_RAYS:
            count += piece_starts[w + 1] - piece_starts[w]
    missing = np.empty(count, dtype=np.intp)
    count = 0
    for k in range(blockers):
        w = touched[k]
        if 2 * to_matched[w] >= BLOCKING_RAYS:
            for place in range(piece_starts[w], piece_starts[w + 1]):
                missing[count] = pieces[place]
                count += 1
    return missing
