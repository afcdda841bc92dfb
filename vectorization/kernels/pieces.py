"""Segmentation of ordered points: gaps, splits, merges and breaks moved to their best place."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from compiled import kernel
from registration.layout import Floats, Record, Records

from .. import tuning

Indices = NDArray[np.int64]


@kernel
def find_gaps(points: Records, scanners: Records, sums: Records, starts: Indices) -> int:
    """Write the running totals (n + 1,) of points, and the first point of every stretch without a gap; count these.

    Element i of the totals is the sums of the first i points; the first has to be 0. Neighbouring rays may be as far
    from each other on a wall as where it is seen under `GRAZING`; without rays the scanner's `default_gap` decides. No
    gap is above its `max_gap`.
    """
    scanner = scanners[0]
    farthest = math.sin(min(0.5 * math.pi, tuning.MISSING_STEPS * scanner.increment))
    count = 0
    for i in range(len(points)):
        point = points[i]
        before = sums[i]
        after = sums[i + 1]
        isotropic = 1.0 if point.ray_x == 0.0 and point.ray_y == 0.0 else 0.0
        after.count = before.count + 1.0
        after.x = before.x + point.x
        after.y = before.y + point.y
        after.xx = before.xx + point.x * point.x
        after.xy = before.xy + point.x * point.y
        after.yy = before.yy + point.y * point.y
        after.ray_xx = before.ray_xx + isotropic + point.ray_x * point.ray_x
        after.ray_xy = before.ray_xy + point.ray_x * point.ray_y
        after.ray_yy = before.ray_yy + isotropic + point.ray_y * point.ray_y
        one = points[max(0, i - 1)]
        limit = scanner.default_gap
        if scanner.increment > 0.0:
            sine = abs(one.ray_x * point.ray_y - one.ray_y * point.ray_x)
            cosine = one.ray_x * point.ray_x + one.ray_y * point.ray_y
            nearer = min(one.ray_x * one.x + one.ray_y * one.y, point.ray_x * point.x + point.ray_y * point.y)
            # The wall's angle with the second ray, if it makes tuning.GRAZING with the first.
            grazing = math.sin(tuning.GRAZING) * cosine - math.cos(tuning.GRAZING) * sine
            limit = nearer * sine / max(grazing, math.sin(0.5 * tuning.GRAZING)) + tuning.GAP_NOISE * scanner.sigma
            if cosine <= 0.0 or sine > farthest:
                limit = 0.0
        limit = min(limit, scanner.max_gap)
        dx = point.x - one.x
        dy = point.y - one.y
        if i == 0 or dx * dx + dy * dy > limit * limit:
            starts[count] = i
            count += 1
    return count


@kernel
def add(one: Record, other: Record, sign: float, out: Record) -> None:
    """Write sums of points to `out`, with others added (`sign` 1) or removed (-1)."""
    out.count = one.count + sign * other.count
    out.x = one.x + sign * other.x
    out.y = one.y + sign * other.y
    out.xx = one.xx + sign * other.xx
    out.xy = one.xy + sign * other.xy
    out.yy = one.yy + sign * other.yy
    out.ray_xx = one.ray_xx + sign * other.ray_xx
    out.ray_xy = one.ray_xy + sign * other.ray_xy
    out.ray_yy = one.ray_yy + sign * other.ray_yy


@kernel
def line_cost(before: Record, after: Record, scanner: Record) -> float:
    """Return the chi-square of the total least squares line of the points between two running totals.

    The noise normal to the line is averaged over the points. Of sums that are no running totals, `before` is zero.
    """
    n = after.count - before.count
    if n < 3.0:
        return 0.0
    sx = after.x - before.x
    sy = after.y - before.y
    sxx = after.xx - before.xx
    sxy = after.xy - before.xy
    syy = after.yy - before.yy
    uxx = after.ray_xx - before.ray_xx
    uxy = after.ray_xy - before.ray_xy
    uyy = after.ray_yy - before.ray_yy
    difference = sxx - syy - (sx * sx - sy * sy) / n
    cross = 2.0 * (sxy - sx * sy / n)
    root = math.sqrt(difference * difference + cross * cross)
    squares = max(0.0, 0.5 * (sxx + syy - (sx * sx + sy * sy) / n - root))
    projected = uxx + uyy
    if root > 0.0:
        # (n.u)^2 summed, from the doubled angle of the line's direction.
        projected -= (difference * (uxx - uyy) + 2.0 * cross * uxy) / root
    return n * squares / (0.5 * scanner.variance * max(projected, 0.0) + n * scanner.floor)


@kernel
def split(points: Records, sums: Records, starts: Indices, scanners: Records, pieces: Records, stack: Records) -> int:
    """Split every stretch until each piece is straight; write the pieces (n,) and count them.

    A piece is split at the point that is farthest from its chord by standard deviations, or where two lines fit far
    better than one. `stack` (n,) is room to work in.
    """
    scanner = scanners[0]
    count = 0
    for s in range(len(starts)):
        stack[0].first = starts[s]
        stack[0].end = starts[s + 1] if s + 1 < len(starts) else len(points)
        top = 0
        while top >= 0:
            a = stack[top].first
            b = stack[top].end
            first = points[a]
            dx = points[b - 1].x - first.x
            dy = points[b - 1].y - first.y
            length = math.sqrt(dx * dx + dy * dy)
            nx = -dy / length if length > 0.0 else 0.0
            ny = dx / length if length > 0.0 else 0.0
            place = -1
            worst = 0.0
            least = 1.0
            for i in range(a + 1, b - 1):
                point = points[i]
                off = nx * (point.x - first.x) + ny * (point.y - first.y)
                cosine = nx * point.ray_x + ny * point.ray_y
                if point.ray_x == 0.0 and point.ray_y == 0.0:
                    cosine = 1.0
                v = scanner.variance * cosine * cosine + scanner.floor
                # off^2 / v above worst / least, without the division.
                if off * off * least > worst * v:
                    worst = off * off
                    least = v
                    place = i
            if worst / least <= tuning.CHORD_GATE * tuning.CHORD_GATE:
                place = -1
                least = line_cost(sums[a], sums[b], scanner) - tuning.BREAK_PENALTY
                stride = max(1, (b - a) // tuning.BREAK_TRIALS)
                for k in range(
                    a + tuning.LEAST_SIDE, b - tuning.LEAST_SIDE + 1 if b - a >= tuning.LEAST_BROKEN else a, stride
                ):
                    cost = line_cost(sums[a], sums[k], scanner) + line_cost(sums[k], sums[b], scanner)
                    if cost < least:
                        least = cost
                        place = k
            if place < 0:
                pieces[count] = stack[top]
                count += 1
                top -= 1
            else:
                # The left one on top, so that pieces come out in order.
                stack[top + 1].first = a
                stack[top + 1].end = place
                stack[top].first = place
                top += 1
    return count


@kernel
def merge(pieces: Records, sums: Records, gaps: Indices, scanners: Records, growth: Floats) -> int:
    """Join adjoining pieces in place, the cheapest joint first, as long as it costs less than `BREAK_PENALTY`.

    Pieces come in order, and those of one stretch without a gap adjoin: `gaps` are the first points of the stretches.
    Returns how many are left. `growth` (n,) is room to work in: what the chi-square grows by when a piece and the next
    share one line.
    """
    scanner = scanners[0]
    left = 0
    a = 0
    for g in range(len(gaps)):
        end = gaps[g + 1] if g + 1 < len(gaps) else len(sums) - 1
        first = left
        while a < len(pieces) and pieces[a].first < end:
            pieces[left] = pieces[a]
            growth[left] = math.nan
            left += 1
            a += 1
        while left - first > 1:
            k = first
            for j in range(first, left - 1):
                if math.isnan(growth[j]):
                    begin = sums[pieces[j].first]
                    middle = sums[pieces[j].end]
                    last = sums[pieces[j + 1].end]
                    apart = line_cost(begin, middle, scanner) + line_cost(middle, last, scanner)
                    growth[j] = line_cost(begin, last, scanner) - apart
                if growth[j] < growth[k]:
                    k = j
            if growth[k] >= tuning.BREAK_PENALTY:
                break
            pieces[k].end = pieces[k + 1].end
            left -= 1
            for j in range(k + 1, left):
                pieces[j] = pieces[j + 1]
                growth[j] = growth[j + 1]
            growth[k] = math.nan
            growth[max(first, k - 1)] = math.nan
    return left


@kernel
def move_breaks(pieces: Records, sums: Records, gaps: Indices, scanners: Records) -> bool:
    """Move every break between adjoining pieces, in place, to where they fit best; return whether any moved."""
    scanner = scanners[0]
    moved = False
    g = 0
    for k in range(len(pieces) - 1):
        a = pieces[k].first
        b = pieces[k].end
        c = pieces[k + 1].end
        while g < len(gaps) and gaps[g] < b:
            g += 1
        if (g < len(gaps) and gaps[g] == b) or b - a < 2 or c - b < 2:
            continue
        least = math.inf
        place = b
        for j in range(max(a + 2, b - tuning.BREAK_REACH), min(c - 2, b + tuning.BREAK_REACH) + 1):
            cost = line_cost(sums[a], sums[j], scanner) + line_cost(sums[j], sums[c], scanner)
            if cost < least:
                least = cost
                place = j
        if place != b:
            pieces[k].end = place
            pieces[k + 1].first = place
            moved = True
    return moved
