"""Compiled lists of the pairs of chains whose lines cross, by how a scan segment would lie on each.

Two scan segments fix where each of them lies, counted from the point where their lines cross. They may lie on the pairs
of chains that cross at the angle between them and reach both of these places. One list, or a few next to one another,
holds all these pairs. `looking_up` finds these lists.
"""

import math

import numpy as np

from compiled import kernel
from registration.layout import Floats, Record, Records

from ...layout import CROSSING, Integers
from ...tuning import CROSSING_ANGLES, MIN_CROSSING
from ..tuning import SWEEP_CELL

PER_HALF_TURN = CROSSING_ANGLES / math.pi
PER_CELL = 1.0 / SWEEP_CELL
STEPS = 127  # of a byte of a code


@kernel
def crossing_of(a: Record, b: Record) -> tuple[float, float, float, float]:
    """Return where the lines of two chains cross, as abscissae along each, and sine and cosine of their angle.

    ``n . c = offset`` holds for both; they may not be parallel.
    """
    sine = a.dx * b.dy - a.dy * b.dx
    cosine = a.dx * b.dx + a.dy * b.dy
    return (a.offset * cosine - b.offset) / sine, (a.offset - b.offset * cosine) / sine, sine, cosine


@kernel
def reach_to(a: Record, b: Record) -> float:
    """Return the distance from where two lines cross to the nearest point of a chain, the larger of both, or inf."""
    if abs(a.dx * b.dy - a.dy * b.dx) < MIN_CROSSING:
        return math.inf
    on_a, on_b, _, _ = crossing_of(a, b)
    return max(max(a.begin - on_a, on_a - a.end), max(b.begin - on_b, on_b - b.end))


@kernel
def cell_of(abscissa: float, reach: float, columns: int) -> int:
    """Return the cell of a place on a line, counted from the crossing."""
    return int(min(columns - 0.5, max(0.0, (abscissa + reach) * PER_CELL)))


@kernel
def cells_of(a: Record, b: Record, reach: float, columns: int) -> tuple[int, int, int, int]:
    """Return the first and last cell of a chain, and those of one that crosses it."""
    on_a, on_b, _, _ = crossing_of(a, b)
    return (
        cell_of(a.begin - on_a, reach, columns),
        cell_of(a.end - on_a, reach, columns),
        cell_of(b.begin - on_b, reach, columns),
        cell_of(b.end - on_b, reach, columns),
    )


@kernel
def step_of(abscissa: float, per_metre: float) -> int:
    """Return a place on a line in the steps of a code; a place beyond the lists is where they end."""
    return int(min(float(STEPS), max(0.0, abscissa * per_metre + 0.5 * STEPS)))


@kernel
def code_of(first_begin: float, first_end: float, second_begin: float, second_end: float, reach: float) -> int:
    """Return where two chains begin and end as a number of four bytes, each from 0 to 127.

    Each is the less the farther a chain reaches, so that those that reach far enough have no byte that is more.
    """
    per_metre = STEPS / (2.0 * reach)
    low = step_of(first_begin, per_metre) | step_of(second_begin, per_metre) << 16
    high = step_of(first_end, per_metre) | step_of(second_end, per_metre) << 16
    return low | (STEPS | STEPS << 16) - high << 8


@kernel
def away_from(band: Record, box: Record) -> float:
    """Return the least distance of the boxes of a band from a box in y; below 0 if their ranges of y overlap."""
    return max(band.low - box.y2, box.y1 - band.high)


@kernel
def first_from(boxes: Records, begin: int, end: int, at: int) -> int:
    """Return from where on the boxes of a band, in ascending order of x1, come after another: no pair comes twice."""
    low = begin
    high = end
    x = boxes[at].x1
    while low < high:
        middle = (low + high) // 2
        if boxes[middle].x1 < x or (boxes[middle].x1 == x and middle <= at):
            low = middle + 1
        else:
            high = middle
    return low


@kernel
def sample_crossings(
    chains: Records, boxes: Records, order: Integers, bands: Records, reaches: Floats, every: int, most: int
) -> Floats:
    """Estimate how many crossings are listed up to each of some reaches, by those of every so many-th chain.

    `reaches` (k,) in descending order; the others as of `find_crossings`. Stops after `most` looks at a pair of chains.
    Returns for each reach (k, 3) crossings, their entries in all lists, and looks.
    """
    counts = np.zeros((len(reaches), 3), np.float64)
    sampled = 0
    looks = 0
    at = 0
    while at < len(chains) and looks < most:
        one = chains[order[at]]
        for g in range(len(bands)):
            band = bands[g]
            away = away_from(band, boxes[at])
            if away > 2.0 * reaches[0]:
                continue
            k = first_from(boxes, band.begin, band.end, at)
            while k < band.end and boxes[k].x1 <= boxes[at].x2 + 2.0 * reaches[0] and looks < most:
                looks += 1
                gap = boxes[k].x1 - boxes[at].x2
                above = max(boxes[k].y1 - boxes[at].y2, boxes[at].y1 - boxes[k].y2)
                other = chains[order[k]]
                least = reach_to(one, other) if above <= 2.0 * reaches[0] else math.inf
                for j in range(len(reaches)):
                    reach = reaches[j]
                    if gap > 2.0 * reach:
                        break
                    counts[j, 2] += 1.0 if away <= 2.0 * reach else 0.0
                    if least <= reach:
                        left, right, bottom, top = cells_of(one, other, reach, math.ceil(2.0 * reach * PER_CELL))
                        counts[j, 0] += 1.0
                        counts[j, 1] += (right - left + 1) * (top - bottom + 1)
                k += 1
        sampled += 1
        at += every
    return counts * (len(chains) / max(1, sampled))


@kernel
def find_crossings(
    chains: Records, boxes: Records, order: Integers, bands: Records, reach: float, most: int, out: Records
) -> tuple[int, int]:
    """Find the pairs of chains that cross within `reach` of both, and write as many to `out` (k,) as there is room for.

    `boxes` (m,) of `ENDS`: corners of the box around each chain, those of each of `bands` (b,) of `BAND` in ascending
    order of x1, which `order` (m,) gives. Pairs come in the order of their chains, so that those are together that are
    near one another. Stops after `most` looks at a pair. Returns how many there are, and looks.
    """
    m = len(chains)
    place = np.empty(m, np.int32)
    for k in range(m):
        place[order[k]] = k
    found = 0
    looks = 0
    for p in range(m):
        at = place[p]
        right = boxes[at].x2 + 2.0 * reach
        low = boxes[at].y1 - 2.0 * reach
        high = boxes[at].y2 + 2.0 * reach
        for g in range(len(bands)):
            band = bands[g]
            if away_from(band, boxes[at]) > 2.0 * reach:
                continue
            begin = first_from(boxes, band.begin, band.end, at)
            k = begin
            while k < band.end and boxes[k].x1 <= right:
                if boxes[k].y1 <= high and boxes[k].y2 >= low:
                    q = order[k]
                    if reach_to(chains[p], chains[q]) <= reach:
                        if found < len(out):
                            turned = chains[p].dx * chains[q].dy - chains[p].dy * chains[q].dx < 0.0
                            out[found].first = q if turned else p
                            out[found].second = p if turned else q
                        found += 1
                k += 1
            looks += k - begin
        if looks > most:
            break
    return found, looks


@kernel
def list_crossings(chains: Records, found: Records, shape: Records) -> tuple[Integers, Integers, Records]:
    """List crossings (k,) in the cells that their chains reach into; return bins, starts, entries as of `Crossings`."""
    reach = shape[0].reach
    columns = shape[0].columns
    bins = np.full(CROSSING_ANGLES, -1, dtype=np.int32)
    of_angle = np.empty(len(found), np.uint8)
    for k in range(len(found)):
        a = chains[found[k].first]
        b = chains[found[k].second]
        on_a, on_b, sine, cosine = crossing_of(a, b)
        found[k].code = code_of(a.begin - on_a, a.end - on_a, b.begin - on_b, b.end - on_b, reach)
        of_angle[k] = min(CROSSING_ANGLES - 1, int(math.atan2(sine, cosine) * PER_HALF_TURN))
        bins[of_angle[k]] = 0
    grids = 0
    for b in range(CROSSING_ANGLES):
        if bins[b] >= 0:
            bins[b] = grids
            grids += 1
    starts = np.zeros(grids * columns * columns + 1, np.int32)
    entries = np.empty(0, CROSSING)
    for counting in (True, False):
        if not counting:
            total = 0
            for c in range(len(starts)):
                here = starts[c]
                starts[c] = total
                total += here
            entries = np.empty(total, CROSSING)
        for k in range(len(found)):
            left, right, bottom, top = cells_of(chains[found[k].first], chains[found[k].second], reach, columns)
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
