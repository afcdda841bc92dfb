"""Compiled branch and bound over the poses of a map, after Hess et al., ICRA 2016; see `index.likelihood_field`.

The value of a pose is the sum of the likelihoods of the scan's points, in 255ths. A block of 2^k by 2^k positions at
one heading has the sum of the maxima of level k of the pyramid as its bound.
"""

import math

import numpy as np

from compiled import kernel
from registration.layout import Floats, Record, Records

from ...layout import Integers
from ...scan.kernels.ordering import ascending
from ..layout import BLOCK


@kernel
def greatest_mean(field: Integers, shape: Records, points: Floats, poses: Records) -> float:
    """Return the greatest mean likelihood of points (n, 2) at poses (k,) of `FOUND`, 0 to 1; 0 without poses."""
    rows, columns = field.shape
    best = 0
    for k in range(len(poses)):
        c = math.cos(poses[k].theta)
        s = math.sin(poses[k].theta)
        total = 0
        for i in range(len(points)):
            fx = (c * points[i, 0] - s * points[i, 1] + poses[k].x - shape[0].x0) / shape[0].cell
            fy = (s * points[i, 0] + c * points[i, 1] + poses[k].y - shape[0].y0) / shape[0].cell
            if fx >= 0.0 and fy >= 0.0 and fx < columns and fy < rows:
                total += field[int(fy), int(fx)]
        best = max(best, total)
    return best / (255.0 * len(points))


@kernel
def bound_of(level: Integers, cells: Integers, row: int, column: int, size: int, needed: int) -> int:
    """Return the greatest value that a pose of a block may have, or -1 where it is at most `needed`.

    `cells` (n, 2) are those of the points from the sensor's; the block has `size` by `size` positions.
    """
    rows, columns = level.shape
    missing = needed - 255 * len(cells)
    for k in range(len(cells)):
        r = row + cells[k, 0]
        c = column + cells[k, 1]
        # Of a block that begins left of the map or below it, the first cells inside bound the rest.
        if r < 0 and r + size > 0:
            r = 0
        if c < 0 and c + size > 0:
            c = 0
        missing += 255
        if r >= 0 and c >= 0 and r < rows and c < columns:
            missing -= level[r, c]
        if missing >= 0:
            return -1
    return needed - missing


@kernel
def branch_and_bound(
    pyramid: Integers,
    turned: Integers,
    least: int,
    gap: int,
    cells_apart: int,
    headings_apart: int,
    found: Records,
    stop: Integers,
) -> int:
    """Find the poses of the greatest values, depth first, the blocks of the highest level by their bounds.

    Parameters
    ----------
    pyramid : (levels, rows, columns) uint8
    turned : (h, n, 2) int32
        Row and column of each point from the sensor's, by heading.
    least : int
        Value that a pose has to exceed.
    gap : int
        The greatest distance of a value from the greatest one.
    cells_apart, headings_apart : int
        Poses up to so many cells either way and so many headings apart are one.
    found : (k,) of `CELL_POSE`
        Written to, in no order.
    stop : (1,) uint8
        Not 0 once the search has to end; another thread may write it.

    Returns
    -------
    int
        The number of poses that were found.
    """
    levels = len(pyramid)
    size = 1 << (levels - 1)
    blocks, losses = whole_blocks(pyramid[levels - 1], turned, size, least, stop)
    stack = np.zeros(4 * levels, BLOCK)
    count = 0
    best = least
    for place in ascending(losses):
        if stop[0] != 0 or blocks[place].bound <= max(least, best - gap):
            break
        stack[0] = blocks[place]
        filled = 1
        while filled > 0:
            filled -= 1
            floor = max(least, best - gap)
            if stack[filled].bound <= floor:
                continue
            if stack[filled].level == 0:
                count = keep(found, count, stack[filled], cells_apart, headings_apart, len(turned))
                best = max(best, stack[filled].bound)
                continue
            filled = divide(pyramid, turned, stack, filled, floor)
    return count


@kernel
def whole_blocks(top: Integers, turned: Integers, size: int, least: int, stop: Integers) -> tuple[Records, Floats]:
    """Return the blocks of the highest level whose bounds exceed `least`, (m,) of `BLOCK`, and minus their bounds."""
    rows, columns = top.shape
    down = (rows + size - 1) // size
    across = (columns + size - 1) // size
    level = 0
    while 1 << level < size:
        level += 1
    blocks = np.zeros(len(turned) * down * across, BLOCK)
    count = 0
    for heading in range(len(turned)):
        if stop[0] != 0:
            break
        for place in range(down * across):
            row = place // across * size
            column = place % across * size
            bound = bound_of(top, turned[heading], row, column, size, least)
            if bound > least:
                put(blocks[count], bound, level, heading, row, column)
                count += 1
    losses = np.empty(count, np.float64)
    for k in range(count):
        losses[k] = -blocks[k].bound
    return blocks[:count], losses


@kernel
def divide(pyramid: Integers, turned: Integers, stack: Records, place: int, floor: int) -> int:
    """Put the quarters of a block on the stack in its place, the greatest bound last; return how many lie there now."""
    _, rows, columns = pyramid.shape
    heading = stack[place].heading
    level = stack[place].level - 1
    row = stack[place].row
    column = stack[place].column
    half = 1 << level
    filled = place
    for quarter in range(4):
        r = row + quarter // 2 * half
        c = column + quarter % 2 * half
        if r >= rows or c >= columns:
            continue
        bound = bound_of(pyramid[level], turned[heading], r, c, half, floor)
        if bound <= floor:
            continue
        at = filled
        while at > place and stack[at - 1].bound > bound:
            stack[at] = stack[at - 1]
            at -= 1
        put(stack[at], bound, level, heading, r, c)
        filled += 1
    return filled


@kernel
def put(block: Record, bound: int, level: int, heading: int, row: int, column: int) -> None:
    """Write a block."""
    block.bound = bound
    block.level = level
    block.heading = heading
    block.row = row
    block.column = column


@kernel
def keep(found: Records, count: int, one: Record, cells_apart: int, headings_apart: int, headings: int) -> int:
    """Store a pose, at most one of those that are near each other; return how many there are. Ties keep the earlier."""
    near = -1
    worst = 0
    for k in range(count):
        turned = abs(found[k].heading - one.heading)
        turned = min(turned, headings - turned)
        beside = max(abs(found[k].row - one.row), abs(found[k].column - one.column))
        if beside <= cells_apart and turned <= headings_apart:
            near = k
        if found[k].value < found[worst].value:
            worst = k
    place = near if near >= 0 else (count if count < len(found) else worst)
    if place < count and one.bound <= found[place].value:
        return count
    found[place].value = one.bound
    found[place].heading = one.heading
    found[place].row = one.row
    found[place].column = one.column
    return max(count, place + 1)
