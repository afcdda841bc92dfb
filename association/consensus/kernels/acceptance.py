"""From matches on walls to the map's own segments, and the evidence that pairs have in common."""

from __future__ import annotations

import math

import numpy as np

from compiled import kernel
from registration.layout import Floats, Records

from ...layout import Indices, Integers
from ...scan.kernels.joining import insert, union
from ...tables import Pieces
from ..tuning import LEAST_KNOWN_VARIANCE, MAX_OTHERS, MIN_EXTENT, MOST_UNDER


@kernel
def lay_segments(
    endpoints: Floats, on: Indices, pose: Records, walls: Records, pieces: Pieces, overlaps: Floats, others: Integers
) -> None:
    """Pick for scan segments on walls the piece of the wall, or of those that continue it, that each lies on most.

    One that covers over half of it and is of its own wall comes first; of equal ones the first of the map.

    Parameters
    ----------
    endpoints : (n, 4)
    on : (n,)
        The wall of each; changed to the piece.
    pose : (1,) of `POSE`
    walls : (m,) of `WALL`
    pieces : Pieces
    overlaps : (n,)
        Written: the fraction of each that lies on pieces.
    others : (n, MAX_OTHERS)
        Written: other pieces that each lies on, by their begins; -1 behind them.
    """
    starts, items, ends, firsts = pieces.starts, pieces.items, pieces.ends, pieces.firsts
    c, s, x, y = math.cos(pose[0].theta), math.sin(pose[0].theta), pose[0].x, pose[0].y
    lows, highs, under = np.empty(MOST_UNDER), np.empty(MOST_UNDER), np.empty(MOST_UNDER, np.int64)
    for i in range(len(on)):
        own = on[i]
        v = firsts[own]
        dx, dy = walls[v].dx, walls[v].dy
        ex, ey = dx * c + dy * s, dy * c - dx * s  # that direction in the scan frame
        shift = dx * x + dy * y
        one = ex * endpoints[i, 0] + ey * endpoints[i, 1] + shift
        other = ex * endpoints[i, 2] + ey * endpoints[i, 3] + shift
        low, high = min(one, other), max(one, other)
        count = 0
        most, most_overlap, most_first = -1, -math.inf, False
        while v >= 0:
            for k in range(starts[v], starts[v + 1]):
                piece = items[k]
                one = dx * ends[piece].x1 + dy * ends[piece].y1
                other = dx * ends[piece].x2 + dy * ends[piece].y2
                overlap = min(max(one, other), high) - max(min(one, other), low)
                first = v == own and overlap > 0.5 * (high - low)
                better = overlap > most_overlap or (overlap == most_overlap and piece < most)
                if (first and not most_first) or (first == most_first and better):
                    most, most_overlap, most_first = piece, overlap, first
                if overlap > 0.0 and count < MOST_UNDER:
                    place = insert(lows, highs, count, min(one, other), max(one, other))
                    for j in range(count, place, -1):
                        under[j] = under[j - 1]
                    under[place] = piece
                    count += 1
            v = walls[v].after
        on[i] = most
        overlaps[i] = min(1.0, union(lows, highs, count, low, high) / max(high - low, MIN_EXTENT))
        listed = 0
        others[i] = -1
        for k in range(count):
            if under[k] != most and listed < MAX_OTHERS:
                others[i, listed] = under[k]
                listed += 1


@kernel
def weigh_pairs(
    rows: Indices, walls: Indices, ties: Floats, ends: Floats, variances: Floats, wall_variance: float, weights: Floats
) -> bool:
    """Write the weights of pairs, and return whether any have evidence in common.

    Of a scan segment only that part counts that no longer one of its line covers, of equal ones the first. Pairs on the
    same wall, or on tied walls, see the same error of it.

    Parameters
    ----------
    rows, walls : (n,)
        The line of the scan and the wall that each is on.
    ties : (n,)
        As of `Place.ties`.
    ends : (n, 4)
        Of the scan segments.
    variances : (n,)
        Of their offsets, m^2.
    wall_variance : float
        Of the error of a wall, m^2.
    weights : (n,)
        Written, 1/m^2.
    """
    n = len(rows)
    alone, lengths = np.empty(n), np.empty(n)
    lows, highs = np.empty(n), np.empty(n)
    shared = False
    for i in range(n):
        lengths[i] = math.hypot(ends[i, 2] - ends[i, 0], ends[i, 3] - ends[i, 1])
    for i in range(n):
        longest = i
        for j in range(n):
            if rows[j] == rows[i] and (
                lengths[j] > lengths[longest] or (lengths[j] == lengths[longest] and j < longest)
            ):
                longest = j
        dx, dy = ends[longest, 2] - ends[longest, 0], ends[longest, 3] - ends[longest, 1]
        size = max(math.hypot(dx, dy), MIN_EXTENT)
        count = 0
        for j in range(n):
            longer = lengths[j] > lengths[i] or (lengths[j] == lengths[i] and j < i)
            if rows[j] == rows[i] and longer:
                middle = 0.5 * ((ends[j, 0] + ends[j, 2]) * dx + (ends[j, 1] + ends[j, 3]) * dy) / size
                insert(lows, highs, count, middle - 0.5 * lengths[j], middle + 0.5 * lengths[j])
                count += 1
        middle = 0.5 * ((ends[i, 0] + ends[i, 2]) * dx + (ends[i, 1] + ends[i, 3]) * dy) / size
        free = lengths[i] - union(lows, highs, count, middle - 0.5 * lengths[i], middle + 0.5 * lengths[i])
        alone[i] = max(0.0, free) / max(lengths[i], MIN_EXTENT) / max(variances[i], LEAST_KNOWN_VARIANCE)
    for i in range(n):
        together = 0.0
        for j in range(n):
            if walls[j] == walls[i]:
                together += alone[j]
                shared = shared or i != j
            elif ties[i] >= 0.0 and ties[j] >= 0.0:
                together += math.exp(-abs(ties[i] - ties[j])) * alone[j]
        shared = shared or ties[i] >= 0.0
        weights[i] = alone[i] / (1.0 + wall_variance * together)
    return shared
