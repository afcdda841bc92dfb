"""Kernels of the corners: where lines cross, which corners fit each other, and how much of a scan a pose explains."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from compiled import kernel
from registration.layout import Floats

Indices = NDArray[np.int64]

LEAST_SINE = math.sin(math.radians(20.0))  # of lines that make a corner


@kernel
def cross_lines(ends: Floats, reach: float) -> Floats:
    """Return the corners of directed segments that come within `reach` of where their lines cross.

    Rows: x, y, heading of the first segment, turn to the second (0 to pi), where the first begins and ends along its
    direction as seen from the corner, the same of the second, and the greater distance of the two from the corner.
    """
    count = len(ends)
    span = ends[:, 2:] - ends[:, :2]
    lengths = np.sqrt(span[:, 0] ** 2 + span[:, 1] ** 2)
    found = np.empty((max(16, 4 * count), 9))
    filled = 0
    for i in range(count):
        ux, uy = span[i, 0] / lengths[i], span[i, 1] / lengths[i]
        for j in range(count):
            vx, vy = span[j, 0] / lengths[j], span[j, 1] / lengths[j]
            sine = ux * vy - uy * vx
            if sine < LEAST_SINE:  # each pair once: the second is turned to the left
                continue
            dx, dy = ends[j, 0] - ends[i, 0], ends[j, 1] - ends[i, 1]
            s = (dx * vy - dy * vx) / sine  # from the first one's begin
            t = (dx * uy - dy * ux) / sine
            away = max(max(-s, s - lengths[i], 0.0), max(-t, t - lengths[j], 0.0))
            if away > reach:
                continue
            if filled == len(found):
                grown = np.empty((2 * filled, 9))
                grown[:filled] = found
                found = grown
            row = found[filled]
            row[0], row[1] = ends[i, 0] + s * ux, ends[i, 1] + s * uy
            row[2], row[3] = math.atan2(uy, ux), math.atan2(sine, ux * vx + uy * vy)
            row[4], row[5], row[6], row[7] = -s, lengths[i] - s, -t, lengths[j] - t
            row[8] = away
            filled += 1
    return found[:filled].copy()


@kernel
def fit_corners(seen: Floats, known: Floats, order: Indices, gates: Floats) -> Indices:
    """Return pairs of corners, of the scan and of the map, with like turns whose segments contain each other.

    `known` is sorted by its turn; `order` lists the scan's corners; `gates` are the radians that the turns and the
    metres that the segments' ends may be off, and the greatest number of pairs.
    """
    turn, slack, most = gates[0], gates[1], int(gates[2])
    turns = np.ascontiguousarray(known[:, 3])
    pairs = np.empty((most, 2), np.int64)
    filled = 0
    for a in order:
        low = np.searchsorted(turns, seen[a, 3] - turn)
        high = np.searchsorted(turns, seen[a, 3] + turn)
        for b in range(low, high):
            if (
                seen[a, 4] > known[b, 4] - slack
                and seen[a, 5] < known[b, 5] + slack
                and seen[a, 6] > known[b, 6] - slack
                and seen[a, 7] < known[b, 7] + slack
            ):
                if filled == most:
                    return pairs
                pairs[filled, 0], pairs[filled, 1] = a, b
                filled += 1
    return pairs[:filled]


@kernel
def explained(scan: Floats, known: Floats, pose: Floats, gates: Floats) -> float:
    """Return how many metres of the scan lie on the map at a pose; `gates` are metres and radians."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    total = 0.0
    for i in range(len(scan)):
        ax, ay = c * scan[i, 0] - s * scan[i, 1] + pose[0], s * scan[i, 0] + c * scan[i, 1] + pose[1]
        bx, by = c * scan[i, 2] - s * scan[i, 3] + pose[0], s * scan[i, 2] + c * scan[i, 3] + pose[1]
        dx, dy = bx - ax, by - ay
        length = math.sqrt(dx * dx + dy * dy)
        for j in range(len(known)):
            ex, ey = known[j, 2] - known[j, 0], known[j, 3] - known[j, 1]
            size = math.sqrt(ex * ex + ey * ey)
            ex, ey = ex / size, ey / size
            if dx * ex + dy * ey <= 0.0 or abs(dx * ey - dy * ex) > gates[1] * length:
                continue
            mx, my = 0.5 * (ax + bx) - known[j, 0], 0.5 * (ay + by) - known[j, 1]
            if abs(mx * ey - my * ex) > gates[0]:
                continue
            p, q = (ax - known[j, 0]) * ex + (ay - known[j, 1]) * ey, (bx - known[j, 0]) * ex + (by - known[j, 1]) * ey
            if min(q, size) - max(p, 0.0) > 0.7 * length:
                total += length
                break
    return total


@kernel
def affinities(seen: Floats, known: Floats, pairs: Indices, widths: Floats) -> Floats:
    """Return how well pairs of corners agree with each other: distances and headings; ``(k, k)``, 0 for not at all."""
    count = len(pairs)
    found = np.zeros((count, count))
    reach, turn = widths[0], widths[1]
    for i in range(count):
        found[i, i] = 1.0
        a, b = pairs[i]
        for j in range(i):
            c, d = pairs[j]
            if a == c or b == d:
                continue
            one = math.hypot(seen[a, 0] - seen[c, 0], seen[a, 1] - seen[c, 1])
            two = math.hypot(known[b, 0] - known[d, 0], known[b, 1] - known[d, 1])
            if abs(one - two) > 3.0 * reach:
                continue
            off = (known[b, 2] - seen[a, 2]) - (known[d, 2] - seen[c, 2])
            off = abs(off - math.tau * round(off / math.tau))
            if off > 3.0 * turn:
                continue
            # The bearing of one corner from the other, measured from the first one's heading.
            e = math.atan2(seen[c, 1] - seen[a, 1], seen[c, 0] - seen[a, 0]) - seen[a, 2]
            f = math.atan2(known[d, 1] - known[b, 1], known[d, 0] - known[b, 0]) - known[b, 2]
            g = f - e
            g = abs(g - math.tau * round(g / math.tau))
            if g * one > 3.0 * (reach + turn * one):
                continue
            found[i, j] = found[j, i] = math.exp(-0.5 * ((one - two) / reach) ** 2 - 0.5 * (off / turn) ** 2)
    return found
