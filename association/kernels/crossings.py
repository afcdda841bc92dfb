"""Compiled listing of where the lines of two runs cross near both."""

import math

import numpy as np

from registration.compiling import inlined, kernel
from registration.layout import Record, Records

from ..layout import CROSSING, CROSSING_BLOCK, Grid, Integers
from ..tuning import CROSSING_BINS, CROSSING_BLOCK_SIZE, CROSSING_LEVELS, MIN_CROSSING


@inlined
def distance_from(run: Record, along: float) -> float:
    """Return how far an abscissa on the line of a run is from the run."""
    return max(0.0, run.begin - along, along - run.end)


@kernel
def list_crossings(runs: Records, grid: Grid, reach: float, most: int) -> tuple[int, Records]:
    """List all pairs of `runs` whose lines cross within `reach` metres of both, at no less than `MIN_CROSSING`.

    `grid` lists in each cell the runs, drawn out by `reach` at both ends, that come to it. Returns how many pairs there
    are, and them, (k,) of `CROSSING`: the second is turned to the left of the first. Where there are more than `most`
    it returns most + 1 and none.
    """
    starts = grid.starts
    items = grid.items
    shape = grid.shape[0]
    per_cell = 1.0 / shape.cell
    x0 = shape.x0
    y0 = shape.y0
    columns = shape.columns
    rows = np.empty(min(most, 8 * len(runs)), dtype=CROSSING)
    count = 0
    for here in range(columns * shape.rows):
        for k in range(starts[here], starts[here + 1]):
            p = runs[items[k]]
            for m in range(k + 1, starts[here + 1]):
                q = runs[items[m]]
                sine = p.dx * q.dy - p.dy * q.dx
                if abs(sine) < MIN_CROSSING:
                    continue
                cosine = p.dx * q.dx + p.dy * q.dy
                u = (p.offset * cosine - q.offset) / sine
                if distance_from(p, u) > reach:
                    continue
                v = (p.offset - q.offset * cosine) / sine
                if distance_from(q, v) > reach:
                    continue
                # Two runs come to several cells: they count where they cross.
                column = math.floor((p.dx * u - p.dy * p.offset - x0) * per_cell)
                row = math.floor((p.dy * u + p.dx * p.offset - y0) * per_cell)
                if row * columns + column != here:
                    continue
                if count == len(rows):
                    if count == most:
                        return most + 1, rows[:0]
                    more = np.empty(min(most, 2 * count), dtype=CROSSING)
                    more[:count] = rows
                    rows = more
                one = rows[count]
                left = sine > 0.0
                one.first = items[k] if left else items[m]
                one.second = items[m] if left else items[k]
                one.angle = math.atan2(abs(sine), cosine)
                one.first_begin = p.begin - u if left else q.begin - v
                one.first_end = p.end - u if left else q.end - v
                one.second_begin = q.begin - v if left else p.begin - u
                one.second_end = q.end - v if left else p.end - u
                count += 1
    return count, rows[:count]


@inlined
def level(value: float) -> int:
    """Return into which of `CROSSING_LEVELS` a distance falls, by whole metres."""
    return int(min(CROSSING_LEVELS - 1.0, max(0.0, math.floor(value + 0.5 * CROSSING_LEVELS))))


@kernel
def crossing_keys(rows: Records) -> Integers:
    """Return by what crossings are sorted, (k,): the angle, then the four ends interleaved, alike ones near.

    The last 32 bits are the place of the crossing, so that there are no ties.
    """
    keys = np.empty(len(rows), dtype=np.int64)
    for k in range(len(rows)):
        levels = (
            level(rows[k].first_begin), level(-rows[k].first_end), level(rows[k].second_begin),
            level(-rows[k].second_end),
        )  # fmt: skip
        key = min(CROSSING_BINS - 1, int(rows[k].angle * (CROSSING_BINS / math.pi)))
        half = CROSSING_LEVELS // 2
        while half > 0:
            for one in levels:
                key = 2 * key + (1 if one & half else 0)
            half //= 2
        keys[k] = (key << 32) + k
    return keys


@kernel
def block_crossings(rows: Records) -> tuple[Records, Records]:
    """Return what the crossings of each block come to at best, (blocks,) of `CROSSING_BLOCK`, and blocks of these."""
    size = CROSSING_BLOCK_SIZE
    blocks = np.empty((len(rows) + size - 1) // size, dtype=CROSSING_BLOCK)
    tops = np.empty((len(blocks) + size - 1) // size, dtype=CROSSING_BLOCK)
    for some, stride in ((blocks, size), (tops, size * size)):
        for k in range(len(rows)):
            row = rows[k]
            block = some[k // stride]
            new = k % stride == 0
            block.least_angle = row.angle if new else min(block.least_angle, row.angle)
            block.greatest_angle = row.angle if new else max(block.greatest_angle, row.angle)
            block.first_begin = row.first_begin if new else min(block.first_begin, row.first_begin)
            block.first_end = row.first_end if new else max(block.first_end, row.first_end)
            block.second_begin = row.second_begin if new else min(block.second_begin, row.second_begin)
            block.second_end = row.second_end if new else max(block.second_end, row.second_end)
    return blocks, tops
