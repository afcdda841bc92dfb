"""Segmentation of ordered points: gaps, splits, merges and breaks moved to their best place."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from compiled import kernel
from registration.kernels import keep_alive
from registration.layout import Record, Records

from ..layout import PIECE, SUMS
from ..tuning import (
    BREAK_PENALTY,
    BREAK_REACH,
    BREAK_TRIALS,
    CHORD_GATE,
    GAP_NOISE,
    GRAZING,
    LEAST_BROKEN,
    LEAST_SIDE,
    MISSING_STEPS,
)

Indices = NDArray[np.int64]


@kernel
def running_sums(points: Records) -> Records:
    """Return the running totals (n + 1,) of the points: element i is the sums of the first i."""
    sums = np.zeros(len(points) + 1, SUMS)
    for i in range(len(points)):
        point = points[i]
        before = sums[i]
        after = sums[i + 1]
        isotropic = point.ray_x == 0.0 and point.ray_y == 0.0
        after.count = before.count + 1.0
        after.x = before.x + point.x
        after.y = before.y + point.y
        after.xx = before.xx + point.x * point.x
        after.xy = before.xy + point.x * point.y
        after.yy = before.yy + point.y * point.y
        after.ray_xx = before.ray_xx + (1.0 if isotropic else point.ray_x * point.ray_x)
        after.ray_xy = before.ray_xy + point.ray_x * point.ray_y
        after.ray_yy = before.ray_yy + (1.0 if isotropic else point.ray_y * point.ray_y)
    return sums


@kernel
def add(one: Record, other: Record, out: Record) -> None:
    """Write the sums of two sets of points together to `out`."""
    out.count = one.count + other.count
    out.x = one.x + other.x
    out.y = one.y + other.y
    out.xx = one.xx + other.xx
    out.xy = one.xy + other.xy
    out.yy = one.yy + other.yy
    out.ray_xx = one.ray_xx + other.ray_xx
    out.ray_xy = one.ray_xy + other.ray_xy
    out.ray_yy = one.ray_yy + other.ray_yy


@kernel
def subtract(after: Record, before: Record, out: Record) -> None:
    """Write the sums of the points between two running totals to `out`."""
    out.count = after.count - before.count
    out.x = after.x - before.x
    out.y = after.y - before.y
    out.xx = after.xx - before.xx
    out.xy = after.xy - before.xy
    out.yy = after.yy - before.yy
    out.ray_xx = after.ray_xx - before.ray_xx
    out.ray_xy = after.ray_xy - before.ray_xy
    out.ray_yy = after.ray_yy - before.ray_yy


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
def find_gaps(points: Records, scanner: Record) -> Indices:
    """Return the first point of every stretch without a gap.

    Neighbouring rays may be as far from each other on a wall as where it is seen under `GRAZING`; without rays the
    scanner's `default_gap` decides. No gap is above its `max_gap`.
    """
    starts = np.empty(len(points), np.int64)
    farthest = math.sin(min(0.5 * math.pi, MISSING_STEPS * scanner.increment))
    count = 0
    for i in range(len(points)):
        gap = i == 0
        if not gap:
            one = points[i - 1]
            other = points[i]
            dx = other.x - one.x
            dy = other.y - one.y
            limit = min(widest_gap(one, other, farthest, scanner), scanner.max_gap)
            gap = dx * dx + dy * dy > limit * limit
        if gap:
            starts[count] = i
            count += 1
    return starts[:count]


@kernel
def widest_gap(one: Record, other: Record, farthest: float, scanner: Record) -> float:
    """Return how far apart two neighbours on one wall may be, metres; `farthest` is the sine between their rays."""
    if scanner.increment <= 0.0:
        return scanner.default_gap
    sine = abs(one.ray_x * other.ray_y - one.ray_y * other.ray_x)
    cosine = one.ray_x * other.ray_x + one.ray_y * other.ray_y
    if cosine <= 0.0 or sine > farthest:
        return 0.0
    r0 = one.ray_x * one.x + one.ray_y * one.y
    r1 = other.ray_x * other.x + other.ray_y * other.y
    # The wall's angle with the second ray, if it makes GRAZING with the first.
    grazing = math.sin(GRAZING) * cosine - math.cos(GRAZING) * sine
    return min(r0, r1) * sine / max(grazing, math.sin(0.5 * GRAZING)) + GAP_NOISE * scanner.sigma


@kernel
def farthest_point(points: Records, a: int, b: int, scanner: Record) -> tuple[int, float]:
    """Return the point between a and b - 1 farthest from their chord in standard deviations, and their square."""
    first = points[a]
    dx = points[b - 1].x - first.x
    dy = points[b - 1].y - first.y
    length = math.sqrt(dx * dx + dy * dy)
    best = a
    worst = 0.0
    least = 1.0
    if length <= 0.0:
        return best, worst
    nx = -dy / length
    ny = dx / length
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
            best = i
    return best, worst / least


@kernel
def best_break(sums: Records, a: int, b: int, low: int, high: int, stride: int, scanner: Record) -> tuple[int, float]:
    """Return the break k in low..high that fits lines through a..k-1 and k..b-1 best, and their chi-square."""
    best = -1
    least = math.inf
    for k in range(low, high + 1, stride):
        cost = line_cost(sums[a], sums[k], scanner) + line_cost(sums[k], sums[b], scanner)
        if cost < least:
            least = cost
            best = k
    return best, least


@kernel
def place_of_break(points: Records, sums: Records, piece: Record, scanner: Record) -> int:
    """Return where to split a piece that is not straight, -1 for one that is."""
    a = piece.first
    b = piece.end
    if b - a <= 2:
        return -1
    far, square = farthest_point(points, a, b, scanner)
    if square > CHORD_GATE * CHORD_GATE:
        return far
    if b - a < LEAST_BROKEN:
        return -1
    stride = max(1, (b - a) // BREAK_TRIALS)
    place, cost = best_break(sums, a, b, a + LEAST_SIDE, b - LEAST_SIDE, stride, scanner)
    return place if line_cost(sums[a], sums[b], scanner) - cost > BREAK_PENALTY else -1


@kernel
def split(points: Records, sums: Records, starts: Indices, scanner: Record) -> Records:
    """Split every stretch until each piece is straight; return the pieces."""
    n = len(points)
    pieces = np.empty(n, PIECE)
    stack = np.empty(2 * n + 2, PIECE)
    count = 0
    for s in range(len(starts)):
        stack[0].first = starts[s]
        stack[0].end = starts[s + 1] if s + 1 < len(starts) else n
        top = 0
        while top >= 0:
            k = place_of_break(points, sums, stack[top], scanner)
            if k < 0:
                pieces[count] = stack[top]
                count += 1
                top -= 1
            else:
                # The left one on top, so that pieces come out in order.
                stack[top + 1].first = stack[top].first
                stack[top + 1].end = k
                stack[top].first = k
                top += 1
    keep_alive(stack)
    return pieces[:count]


@kernel
def merge(pieces: Records, sums: Records, gaps: Indices, scanner: Record) -> Records:
    """Join adjoining pieces, the cheapest joint first, as long as it costs less than `BREAK_PENALTY`.

    Pieces come in order, and those of one stretch without a gap adjoin: `gaps` are the first points of the stretches.
    Returns the pieces that are left.
    """
    left = np.empty_like(pieces)
    count = 0
    joint = np.empty(len(pieces), np.float64)
    a = 0
    for g in range(len(gaps)):
        end = gaps[g + 1] if g + 1 < len(gaps) else len(sums) - 1
        first = count
        while a < len(pieces) and pieces[a].first < end:
            left[count] = pieces[a]
            count += 1
            a += 1
        for k in range(first, count - 1):
            joint[k] = joint_cost(left[k], left[k + 1], sums, scanner)
        while count - first > 1:
            k = first
            for j in range(first + 1, count - 1):
                if joint[j] < joint[k]:
                    k = j
            if joint[k] >= BREAK_PENALTY:
                break
            left[k].end = left[k + 1].end
            count -= 1
            for j in range(k + 1, count):
                left[j] = left[j + 1]
                joint[j] = joint[j + 1]
            if k < count - 1:
                joint[k] = joint_cost(left[k], left[k + 1], sums, scanner)
            if k > first:
                joint[k - 1] = joint_cost(left[k - 1], left[k], sums, scanner)
    return left[:count].copy()


@kernel
def joint_cost(one: Record, other: Record, sums: Records, scanner: Record) -> float:
    """Return what the chi-square grows by when two adjoining pieces share one line."""
    a = sums[one.first]
    b = sums[one.end]
    c = sums[other.end]
    apart = line_cost(a, b, scanner) + line_cost(b, c, scanner)
    return line_cost(a, c, scanner) - apart


@kernel
def settle_breaks(pieces: Records, sums: Records, gaps: Indices, scanner: Record) -> bool:
    """Move every break between adjoining pieces, in place, to where they fit best; return whether any moved."""
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
        low = max(a + 2, b - BREAK_REACH)
        high = min(c - 2, b + BREAK_REACH)
        place, _ = best_break(sums, a, c, low, high, 1, scanner)
        if place >= 0 and place != b:
            pieces[k].end = place
            pieces[k + 1].first = place
            moved = True
    return moved
