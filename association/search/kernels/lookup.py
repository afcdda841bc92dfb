"""Compiled look-up of the crossings on which a base may lie, in the lists of `association.index.kernels.crossings`."""

import math

import numpy as np

from compiled import kernel
from registration.layout import Record, Records

from ...consensus.kernels.geometry import GATE_MARGIN
from ...index.kernels.crossings import PER_HALF_TURN, cell_of, code_of, crossing_of
from ...layout import Integers
from ...tables import Crossings
from ...tuning import CROSSING_ANGLES
from ..tuning import CROSSING_MARGIN, MOST_LISTS

# Of the angles where bins begin; of the first and the last one those are far beyond what is listed.
EDGES = np.clip(np.arange(CROSSING_ANGLES + 1) / PER_HALF_TURN, 1e-3, math.pi - 1e-3)
COTANGENTS, COSECANTS = 1.0 / np.tan(EDGES), 1.0 / np.sin(EDGES)
TOP_BITS = 0x80808080  # of the four bytes of a code
LEAST_AT_ONCE = 64  # entries; where there is less room the crossings that were met are gone on with first


@kernel
def deciding_place(low: float, high: float, half: float, reach: float) -> float:
    """Return which place of a segment decides its cell, from its midpoint, which lies between two abscissae.

    Few chains reach far from where they cross: the far end, or else the near one. Returns inf if that is beyond the
    lists.
    """
    if half <= 0.0:
        return 0.0 if max(-low, high) <= reach else math.inf
    far = half if low + high >= 0.0 else -half
    if max(-low - far, high + far) <= reach:
        return far
    return -far if max(far - low, high - far) <= reach else math.inf


@kernel
def look_up(figure: Record, crossings: Crossings, lists: Records) -> tuple[int, int]:
    """Write the lists that hold the crossings on which a base may lie, to `lists` (k,) of `LISTED`.

    Its first segment has the second one to its left. Returns how many lists and how many entries there are; 0 and -1
    where not all crossings that matter are listed. If `lists` has no room, the entries are counted.
    """
    reach = crossings.shape[0].reach
    columns = crossings.shape[0].columns
    bins = crossings.bins
    starts = crossings.starts
    n = 0
    cells = 0
    entries = 0
    first, last = angle_bins(figure)
    for k in range(first, last + 1):
        a1, a2, b1, b2 = midpoints_in(k, figure)
        from_first = deciding_place(a1, a2, figure.half_a, reach)
        from_second = deciding_place(b1, b2, figure.half_b, reach)
        if from_first == math.inf or from_second == math.inf:
            return 0, -1
        if bins[k] < 0:
            continue
        left = cell_of(a1 + from_first, reach, columns)
        right = cell_of(a2 + from_first, reach, columns)
        bottom = cell_of(b1 + from_second, reach, columns)
        top = cell_of(b2 + from_second, reach, columns)
        cells += (right - left + 1) * (top - bottom + 1)
        if cells > MOST_LISTS:
            return 0, -1
        code = TOP_BITS | code_of(a2 - figure.half_a, a1 + figure.half_a, b2 - figure.half_b, b1 + figure.half_b, reach)
        for column in range(left, right + 1):
            here = (bins[k] * columns + column) * columns
            entries += starts[here + top + 1] - starts[here + bottom]
            for row in range(bottom, top + 1 if len(lists) > 0 else bottom):
                if starts[here + row] < starts[here + row + 1]:
                    write_list(lists[n], starts[here + row], starts[here + row + 1], column, row)
                    lists[n].from_first = from_first
                    lists[n].from_second = from_second
                    lists[n].code = code
                    n += 1
    return n, entries


@kernel
def angle_bins(figure: Record) -> tuple[int, int]:
    """Return the first and last bin of the angles that two chains under a base may make."""
    turn = figure.turn - 2.0 * math.pi * math.floor(figure.turn / (2.0 * math.pi))
    spread = GATE_MARGIN * figure.tolerance
    last = min(CROSSING_ANGLES - 1, int((turn + spread) * PER_HALF_TURN))
    return int(max(0.0, turn - spread) * PER_HALF_TURN), last


@kernel
def midpoints_in(k: int, figure: Record) -> tuple[float, float, float, float]:
    """Return between which abscissae, from the crossing, the midpoints of a and of b lie at the angles of a bin.

    At the angle phi these are `cot(phi) beside - ahead` and `beside / sin(phi)`. The margin is a little more than the
    length by which the segments may stick out at the ends of their chains.
    """
    beyond_a = max(0.0, -figure.half_a) + CROSSING_MARGIN
    beyond_b = max(0.0, -figure.half_b) + CROSSING_MARGIN
    one = figure.beside * COTANGENTS[k] - figure.ahead
    other = figure.beside * COTANGENTS[k + 1] - figure.ahead
    near = figure.beside * COSECANTS[k]
    far = figure.beside * COSECANTS[k + 1]
    across = figure.beside if 2 * k + 1 == CROSSING_ANGLES else near  # the bin about a right angle
    return (
        min(one, other) - beyond_a,
        max(one, other) + beyond_a,
        min(near, far, across) - beyond_b,
        max(near, far, across) + beyond_b,
    )


@kernel
def write_list(listed: Record, begin: int, end: int, column: int, row: int) -> None:
    """Write where a list of crossings is."""
    listed.begin = begin
    listed.end = end
    listed.column = column
    listed.row = row


@kernel
def on_crossings(
    figure: Record, crossings: Crossings, chains: Records, lists: Records, count: int, first: int, met: Records
) -> tuple[int, int]:
    """Write the crossings of the first `count` lists on which a base lies, to `met` (k,) of `MET`.

    From the entry `first` of all of them on. Returns at which entry it stopped because `met` was full, or how many
    there are, and the number of crossings written.
    """
    entries = crossings.entries
    near = np.empty(len(met), np.int32)
    n = 0
    at = 0
    for j in range(count):
        one = lists[j]
        begin = one.begin
        if at + one.end - begin <= first:
            at += one.end - begin
            continue
        if at < first:
            begin += first - at
            at = first
        while begin < one.end:
            # Some at a time: those whose codes fit, and then those of them that do.
            some = min(one.end - begin, len(met) - n)
            if some < min(one.end - begin, LEAST_AT_ONCE):
                return at, n
            fitting = near_by_code(entries, begin, begin + some, one.code, near)
            for f in range(fitting):
                met[n].number = near[f]
                crossing = entries[near[f]]
                fits = lies_on(figure, chains[crossing.first], chains[crossing.second], one, crossings.shape[0])
                n += 1 if fits else 0
            begin += some
            at += some
    return at, n


@kernel
def near_by_code(entries: Records, begin: int, end: int, code: int, near: Integers) -> int:
    """Write to `near` which entries, from `begin` to `end`, reach far enough by their codes; return how many."""
    fitting = 0
    for k in range(begin, end):
        near[fitting] = k
        # Without a branch, which would be as often one way as the other.
        fitting += 1 if (code - entries[k].code) & TOP_BITS == TOP_BITS else 0
    return fitting


@kernel
def lies_on(figure: Record, wa: Record, wb: Record, listed: Record, shape: Record) -> bool:
    """Return whether a base lies on two chains that cross, and is to be found on this list of those that hold them.

    Loosely, for the final angle is not known.
    """
    on_a, on_b, sine, cosine = crossing_of(wa, wb)
    half_a = figure.half_a - CROSSING_MARGIN
    half_b = figure.half_b - CROSSING_MARGIN
    a = figure.beside * cosine / sine - figure.ahead
    b = figure.beside / sine
    a_begin = wa.begin - on_a
    a_end = wa.end - on_a
    b_begin = wb.begin - on_b
    b_end = wb.end - on_b
    fits = (a_begin <= a - half_a) & (a_end >= a + half_a) & (b_begin <= b - half_b) & (b_end >= b + half_b)
    # The place of a segment that decides the cell lies in one cell, though the crossing may be on several lists.
    x = min(max(a + listed.from_first, a_begin), a_end)
    y = min(max(b + listed.from_second, b_begin), b_end)
    fits &= cell_of(x, shape.reach, shape.columns) == listed.column
    fits &= cell_of(y, shape.reach, shape.columns) == listed.row
    return fits
