"""Compiled lists of the pairs of runs whose lines cross, by how a scan segment would lie on each.

Two scan segments fix where each of them lies, counted from the point where their lines cross. So the pairs of runs on
which they may lie are those that cross at the angle between them and have something at both of these places: one list,
or a few next to one another, holds them all.
"""

import math

import numpy as np

from registration.compiling import inlined, kernel
from registration.layout import Floats, Record, Records

from ..layout import CROSSING, Integers
from ..tables import Crossings
from ..tuning import CROSSING_ANGLES, CROSSING_CELL, CROSSING_MARGIN, MIN_CROSSING, MOST_LISTS
from .matching import GATE_MARGIN

PER_HALF_TURN = CROSSING_ANGLES / math.pi
# Of the angles where bins begin; of the first and the last one those are far beyond what is listed.
EDGES = np.clip(np.arange(CROSSING_ANGLES + 1) / PER_HALF_TURN, 1e-3, math.pi - 1e-3)
COTANGENTS, COSECANTS = 1.0 / np.tan(EDGES), 1.0 / np.sin(EDGES)
PER_CELL = 1.0 / CROSSING_CELL
STEPS = 127  # of a byte of a code
TOP_BITS = 0x80808080
LEAST_AT_ONCE = 64  # entries; where there is less room the crossings that were met are gone on with first


@inlined
def crossing_of(a: Record, b: Record) -> tuple[float, float, float, float]:
    """Return where the lines of two runs cross, as abscissae along each, and sine and cosine of the angle between them.

    ``n . c = offset`` holds for both; they may not be parallel.
    """
    sine = a.dx * b.dy - a.dy * b.dx
    cosine = a.dx * b.dx + a.dy * b.dy
    return (a.offset * cosine - b.offset) / sine, (a.offset - b.offset * cosine) / sine, sine, cosine


@inlined
def reach_to(a: Record, b: Record) -> float:
    """Return how far from where two lines cross the nearest point of a run is, the farther of both; inf if parallel."""
    if abs(a.dx * b.dy - a.dy * b.dx) < MIN_CROSSING:
        return math.inf
    on_a, on_b, _, _ = crossing_of(a, b)
    return max(max(a.begin - on_a, on_a - a.end), max(b.begin - on_b, on_b - b.end))


@inlined
def cell_of(abscissa: float, reach: float, columns: int) -> int:
    """Return the cell of a place on a line, counted from the crossing."""
    return int(min(columns - 0.5, max(0.0, (abscissa + reach) * PER_CELL)))


@inlined
def cells_of(a: Record, b: Record, reach: float, columns: int) -> tuple[int, int, int, int]:
    """Return the first and last cell of a run, and those of one that crosses it."""
    on_a, on_b, _, _ = crossing_of(a, b)
    return (
        cell_of(a.begin - on_a, reach, columns),
        cell_of(a.end - on_a, reach, columns),
        cell_of(b.begin - on_b, reach, columns),
        cell_of(b.end - on_b, reach, columns),
    )


@inlined
def step_of(abscissa: float, per_metre: float) -> int:
    """Return a place on a line in the steps of a code; what is beyond the lists is where they end."""
    return int(min(float(STEPS), max(0.0, abscissa * per_metre + 0.5 * STEPS)))


@inlined
def code_of(first_begin: float, first_end: float, second_begin: float, second_end: float, reach: float) -> int:
    """Return where two runs begin and end as a number of four bytes, each from 0 to 127.

    Each is the less the farther a run reaches, so that those that reach far enough have no byte that is more.
    """
    per_metre = STEPS / (2.0 * reach)
    low = step_of(first_begin, per_metre) | step_of(second_begin, per_metre) << 16
    high = step_of(first_end, per_metre) | step_of(second_end, per_metre) << 16
    return low | (STEPS | STEPS << 16) - high << 8


@kernel
def sample_crossings(runs: Records, boxes: Records, order: Integers, reaches: Floats, every: int, most: int) -> Floats:
    """Estimate how many crossings are listed up to each of some reaches, by those of every so many-th run.

    `reaches` (k,) in descending order; `boxes` and `order` as of `find_crossings`. Stops after `most` looks at a pair
    of runs. Returns for each reach (k, 3) crossings, their entries in all lists, and looks.
    """
    counts = np.zeros((len(reaches), 3))
    sampled = 0
    looks = 0
    at = 0
    while at < len(runs) and looks < most:
        one = runs[order[at]]
        k = at + 1
        while k < len(runs) and boxes[k].x1 <= boxes[at].x2 + 2.0 * reaches[0] and looks < most:
            looks += 1
            gap = boxes[k].x1 - boxes[at].x2
            above = max(boxes[k].y1 - boxes[at].y2, boxes[at].y1 - boxes[k].y2)
            other = runs[order[k]]
            least = reach_to(one, other) if above <= 2.0 * reaches[0] else math.inf
            for j in range(len(reaches)):
                reach = reaches[j]
                if gap > 2.0 * reach:
                    break
                counts[j, 2] += 1.0
                if least <= reach:
                    left, right, bottom, top = cells_of(one, other, reach, math.ceil(2.0 * reach * PER_CELL))
                    counts[j, 0] += 1.0
                    counts[j, 1] += (right - left + 1) * (top - bottom + 1)
            k += 1
        sampled += 1
        at += every
    return counts * (len(runs) / max(1, sampled))


@kernel
def find_crossings(
    runs: Records, boxes: Records, order: Integers, reach: float, most: int, out: Records
) -> tuple[int, int]:
    """Find the pairs of runs that cross within `reach` of both, and write as many to `out` (k,) as there is room for.

    `boxes` (m,) of `ENDS`: corners of the box around each run, in ascending order of x1, which `order` (m,) gives.
    Pairs come in the order of their runs, so that those are together that are near one another. Stops after `most`
    looks at a pair. Returns how many there are, and looks.
    """
    m = len(runs)
    place = np.empty(m, dtype=np.int32)
    for k in range(m):
        place[order[k]] = k
    found = 0
    looks = 0
    for p in range(m):
        at = place[p]
        right = boxes[at].x2 + 2.0 * reach
        low = boxes[at].y1 - 2.0 * reach
        high = boxes[at].y2 + 2.0 * reach
        k = at + 1
        while k < m and boxes[k].x1 <= right:
            if boxes[k].y1 <= high and boxes[k].y2 >= low:
                q = order[k]
                if reach_to(runs[p], runs[q]) <= reach:
                    if found < len(out):
                        turned = runs[p].dx * runs[q].dy - runs[p].dy * runs[q].dx < 0.0
                        out[found].first = q if turned else p
                        out[found].second = p if turned else q
                    found += 1
            k += 1
        looks += k - at
        if looks > most:
            break
    return found, looks


@kernel
def list_crossings(runs: Records, found: Records, shape: Records) -> tuple[Integers, Integers, Records]:
    """List crossings (k,) in the cells that their runs reach into; return bins, starts, entries as of `Crossings`."""
    reach = shape[0].reach
    columns = shape[0].columns
    bins = np.full(CROSSING_ANGLES, -1, dtype=np.int32)
    of_angle = np.empty(len(found), dtype=np.uint8)
    for k in range(len(found)):
        a = runs[found[k].first]
        b = runs[found[k].second]
        on_a, on_b, sine, cosine = crossing_of(a, b)
        found[k].code = code_of(a.begin - on_a, a.end - on_a, b.begin - on_b, b.end - on_b, reach)
        of_angle[k] = min(CROSSING_ANGLES - 1, int(math.atan2(sine, cosine) * PER_HALF_TURN))
        bins[of_angle[k]] = 0
    grids = 0
    for b in range(CROSSING_ANGLES):
        if bins[b] >= 0:
            bins[b] = grids
            grids += 1
    starts = np.zeros(grids * columns * columns + 1, dtype=np.int32)
    entries = np.empty(0, dtype=CROSSING)
    for counting in (True, False):
        if not counting:
            total = 0
            for c in range(len(starts)):
                here = starts[c]
                starts[c] = total
                total += here
            entries = np.empty(total, dtype=CROSSING)
        for k in range(len(found)):
            left, right, bottom, top = cells_of(runs[found[k].first], runs[found[k].second], reach, columns)
            for column in range(left, right + 1):
                cells = (bins[of_angle[k]] * columns + column) * columns
                for row in range(bottom, top + 1):
                    if not counting:
                        entries[starts[cells + row]] = found[k]
                    starts[cells + row] += 1
    # The second pass moved every start to the next one's place.
    for c in range(len(starts) - 1, 0, -1):
        starts[c] = starts[c - 1]
    starts[0] = 0
    return bins, starts, entries


@inlined
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
    near = np.empty(len(met), dtype=np.int32)
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
