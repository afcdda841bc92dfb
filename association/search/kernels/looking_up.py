"""Compiled look-up of the crossings on which a base may lie, in the lists that `crossings` makes."""

import math

import numpy as np

from compiled import kernel
from registration.layout import Record, Records

from ...consensus.kernels.matching import GATE_MARGIN
from ...index.kernels.crossings import PER_HALF_TURN, cell_of, code_of, crossing_of
from ...tables import Crossings
from ...tuning import CROSSING_ANGLES, CROSSING_MARGIN, MOST_LISTS

# Of the angles where bins begin; of the first and the last one those are far beyond what is listed.
EDGES = np.clip(np.arange(CROSSING_ANGLES + 1) / PER_HALF_TURN, 1e-3, math.pi - 1e-3)
COTANGENTS, COSECANTS = 1.0 / np.tan(EDGES), 1.0 / np.sin(EDGES)
TOP_BITS = 0x80808080  # of the four bytes of a code
LEAST_AT_ONCE = 64  # entries; where there is less room the crossings that were met are gone on with first


@kernel
def asked_for(low: float, high: float, half: float, reach: float) -> float:
    """Return which place of a segment is asked for, from its midpoint, which lies between two abscissae.

    What is far from the crossing is rare: the far end, or else the near one. Where that is beyond the lists, inf.
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
    where not all crossings that matter are listed. Where there is no room for lists the entries are counted.
    """
    reach = crossings.shape[0].reach
    columns = crossings.shape[0].columns
    bins = crossings.bins
    starts = crossings.starts
    turn = figure.turn - 2.0 * math.pi * math.floor(figure.turn / (2.0 * math.pi))
    spread = GATE_MARGIN * figure.tolerance
    # A little more than what it may stick out at the ends of a run.
    beyond_a = max(0.0, -figure.half_a) + CROSSING_MARGIN
    beyond_b = max(0.0, -figure.half_b) + CROSSING_MARGIN
    n = 0
    most = 0
    entries = 0
    last = min(CROSSING_ANGLES - 1, int((turn + spread) * PER_HALF_TURN))
    for k in range(int(max(0.0, turn - spread) * PER_HALF_TURN), last + 1):
        # The midpoints of a and b lie beside cot(phi) - ahead and beside / sin(phi) from the crossing, phi the angle.
        one = figure.beside * COTANGENTS[k] - figure.ahead
        other = figure.beside * COTANGENTS[k + 1] - figure.ahead
        a1 = min(one, other) - beyond_a
        a2 = max(one, other) + beyond_a
        near = figure.beside * COSECANTS[k]
        far = figure.beside * COSECANTS[k + 1]
        across = figure.beside if 2 * k + 1 == CROSSING_ANGLES else near  # the bin about a right angle
        b1 = min(near, far, across) - beyond_b
        b2 = max(near, far, across) + beyond_b
        from_first = asked_for(a1, a2, figure.half_a, reach)
        from_second = asked_for(b1, b2, figure.half_b, reach)
        if from_first == math.inf or from_second == math.inf:
            return 0, -1
        if bins[k] < 0:
            continue
        left = cell_of(a1 + from_first, reach, columns)
        right = cell_of(a2 + from_first, reach, columns)
        bottom = cell_of(b1 + from_second, reach, columns)
        top = cell_of(b2 + from_second, reach, columns)
        most += (right - left + 1) * (top - bottom + 1)
        if most > MOST_LISTS:
            return 0, -1
        code = 0
        for column in range(left, right + 1):
            here = (bins[k] * columns + column) * columns
            entries += starts[here + top + 1] - starts[here + bottom]
            for row in range(bottom, top + 1 if len(lists) > 0 else bottom):
                if starts[here + row] == starts[here + row + 1]:
                    continue
                if code == 0:
                    code = TOP_BITS | code_of(
                        a2 - figure.half_a, a1 + figure.half_a, b2 - figure.half_b, b1 + figure.half_b, reach
                    )
                listed = lists[n]
                listed.begin = starts[here + row]
                listed.end = starts[here + row + 1]
                listed.column = column
                listed.row = row
                listed.from_first = from_first
                listed.from_second = from_second
                listed.code = code
                n += 1
    return n, entries


@kernel
def on_crossings(
    figure: Record, crossings: Crossings, runs: Records, lists: Records, count: int, first: int, met: Records
) -> tuple[int, int]:
    """Write the crossings of the first `count` lists on which a base lies, to `met` (k,) of `MET`.

    From the entry `first` of all of them on. Returns at which entry it left off because `met` was full, or how many
    there are, and how many crossings these are. Loosely, for the final angle is not known.
    """
    entries = crossings.entries
    reach = crossings.shape[0].reach
    columns = crossings.shape[0].columns
    half_a = figure.half_a - CROSSING_MARGIN
    half_b = figure.half_b - CROSSING_MARGIN
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
        code = one.code
        while begin < one.end:
            # Some at a time: those whose codes fit, without a branch, and then those of them that do.
            some = min(one.end - begin, len(met) - n)
            if some < min(one.end - begin, LEAST_AT_ONCE):
                return at, n
            fitting = 0
            for k in range(begin, begin + some):
                near[fitting] = k
                fitting += 1 if (code - entries[k].code) & TOP_BITS == TOP_BITS else 0
            for f in range(fitting):
                k = near[f]
                wa = runs[entries[k].first]
                wb = runs[entries[k].second]
                on_a, on_b, sine, cosine = crossing_of(wa, wb)
                a = figure.beside * cosine / sine - figure.ahead
                b = figure.beside / sine
                a_begin = wa.begin - on_a
                a_end = wa.end - on_a
                b_begin = wb.begin - on_b
                b_end = wb.end - on_b
                fits = (a_begin <= a - half_a) & (a_end >= a + half_a) & (b_begin <= b - half_b) & (b_end >= b + half_b)
                # It may be on several of these lists, and counts on the one where what is asked for comes to lie.
                x = min(max(a + one.from_first, a_begin), a_end)
                y = min(max(b + one.from_second, b_begin), b_end)
                fits &= cell_of(x, reach, columns) == one.column
                fits &= cell_of(y, reach, columns) == one.row
                met[n].run = k
                met[n].entry = at + k - begin + 1
                n += 1 if fits else 0
            begin += some
            at += some
    return at, n
