"""Compiled parts of building a map index: joining collinear pieces, tying walls, and the cells of a grid."""

import math

import numpy as np

from compiled import kernel
from registration.layout import Floats, Records

from ...layout import Integers
from ...tables import JoinGates
from ...tuning import APART_GAP, WHOLE_GAP
from ..tuning import BLENDED_WALLS, MOST_LOOKS, MOST_STEPS, TIE_FREE, TIES_BEFORE


@kernel
def fade(value: float, whole: float, apart: float) -> float:
    """Return 1 up to `whole`, 0 from `apart` on, and smoothly less between (Tukey's biweight)."""
    share = min(1.0, max(0.0, (value - whole) / (apart - whole)))
    return (1.0 - share * share) ** 2


@kernel
def tie_walls(walls: Records, order: Integers, group: Integers, apart: float) -> Floats:
    """Return where in its group each wall is, (m,), as of `Place.ties`; in `order` they are group by group, by begin.

    Each is tied to that of the walls before it to which it is tied best. Their correlation falls with the gap
    between them and with the step, up to `apart`, metres. The step is the farthest that the shorter one is off the line
    of the other, so that walls that bend are not one either.
    """
    ties = np.empty(len(walls), np.float64)
    at = 0.0
    for k in range(len(order)):
        w = order[k]
        after = walls[w]
        place = at + TIE_FREE
        grouped = k + 1 < len(order) and group[order[k + 1]] == group[w]
        for back in range(1, min(k, TIES_BEFORE) + 1):
            v = order[k - back]
            if group[v] != group[w]:
                break
            grouped = True
            before = walls[v]
            x = after.dx * after.begin - after.dy * after.offset
            y = after.dy * after.begin + after.dx * after.offset
            gap = before.dx * x + before.dy * y - before.end
            longer, shorter = before, after
            if before.end - before.begin < after.end - after.begin:
                longer, shorter = after, before
            step = 0.0
            for along in (shorter.begin, shorter.end):
                x = shorter.dx * along - shorter.dy * shorter.offset
                y = shorter.dy * along + shorter.dx * shorter.offset
                step = max(step, abs(longer.dx * y - longer.dy * x - longer.offset))
            correlation = fade(step, 0.0, apart) * fade(gap, WHOLE_GAP, APART_GAP)
            if correlation > math.exp(-TIE_FREE) and ties[v] - math.log(correlation) < place:
                place = ties[v] - math.log(correlation)
        # One alone keeps the place it would have, for those after it.
        ties[w] = place if grouped else -1.0
        at = max(at, place)
    return ties


@kernel
def blend_walls(
    walls: Records, lengths: Floats, order: Integers, group: Integers, ties: Floats
) -> tuple[Floats, Floats, Floats]:
    """Return the line of each wall with those that it is tied to: their means, by length and tie.

    `order` as of `tie_walls`. Returns the unit directions, by x and y, and the offsets, (m,) each.
    """
    lines = np.empty((3, len(walls)), np.float64)
    for k in range(len(order)):
        w = order[k]
        dx, dy, x, y, total = 0.0, 0.0, 0.0, 0.0, 0.0
        for way in (0, -1, 1):
            j = k + way
            while 0 <= j < len(order) and abs(j - k) <= BLENDED_WALLS and group[order[j]] == group[w]:
                other = walls[order[j]]
                part = lengths[order[j]] * math.exp(-abs(ties[order[j]] - ties[w]))
                middle = 0.5 * (other.begin + other.end)
                dx += part * other.dx
                dy += part * other.dy
                x += part * (other.dx * middle - other.dy * other.offset)
                y += part * (other.dy * middle + other.dx * other.offset)
                total += part
                if way == 0:
                    break
                j += way
        size = math.hypot(dx, dy)
        lines[0, w] = dx / size
        lines[1, w] = dy / size
        lines[2, w] = (dx / size * y - dy / size * x) / total
    return lines[0], lines[1], lines[2]


@kernel
def cell_hash(column: int, row: int, buckets: int) -> int:
    """Return the list of a cell among a power of two of lists."""
    return (int(column) * 73856093 ^ int(row) * 19349663) & (buckets - 1)


@kernel
def list_begins(ends: Records, cell: float, heads: Integers) -> Integers:
    """List where pieces (n,) of `ENDS` begin, by a hash of their cell, so that memory does not grow with the extent.

    Writes the last piece of each list to `heads`, a power of two of -1. Returns (n,) the piece before each, or -1.
    """
    following = np.empty(len(ends), np.int64)
    for i in range(len(ends)):
        key = cell_hash(math.floor(ends[i].x1 / cell), math.floor(ends[i].y1 / cell), len(heads))
        following[i] = heads[key]
        heads[key] = i
    return following


@kernel
def root_of(parent: Integers, one: int) -> int:
    """Return the root of one of a union-find forest, and shorten the way there."""
    while parent[one] != one:
        parent[one] = parent[parent[one]]
        one = parent[one]
    return one


@kernel
def join_collinear(
    ends: Records,
    directions: Records,
    heads: Integers,
    following: Integers,
    gates: JoinGates,
    parent: Integers,
    first: int,
    last: int,
) -> None:
    """Join pieces `first` to `last` with those that they continue or repeat, in `parent` (n,), a union-find forest.

    A piece continues another if it begins within the gap of its end. It repeats it if it begins along it and ends near
    its line. The lower index becomes the root. Around each piece the begins of others are looked up. Some are not
    joined if more than `MOST_LOOKS` begin about one piece, or beyond `MOST_STEPS` places before its end. No map of a
    building has so many. `ends` (n,) of `ENDS`; `directions` (n,) of `POINT`; `heads` and `following` of `list_begins`.
    """
    cell, gap, lateral, least_cosine = gates.cell, gates.gap, gates.lateral, gates.least_cosine
    buckets = len(heads)
    spacing = 1.98 * (cell - lateral)
    for i in range(first, last):
        x1, y1, x2, y2 = ends[i].x1, ends[i].y1, ends[i].x2, ends[i].y2
        dx, dy = directions[i].x, directions[i].y
        length = math.hypot(x2 - x1, y2 - y1)
        looks = 0
        # At places from the end backwards, evenly spread, the last of them the begin.
        steps = math.ceil(length / spacing)
        for step in range(min(steps, MOST_STEPS) + 1):
            back = step * length / steps if step < MOST_STEPS else length
            column = math.floor((x2 - back * dx) / cell)
            row = math.floor((y2 - back * dy) / cell)
            for around in range(9):
                later = heads[cell_hash(column + around // 3 - 1, row + around % 3 - 1, buckets)]
                while later >= 0 and looks < MOST_LOOKS:
                    looks += 1
                    j = later
                    later = following[j]
                    gx = ends[j].x1 - x2
                    gy = ends[j].y1 - y2
                    along = gx * dx + gy * dy
                    if j == i or not -length - gap <= along <= gap or abs(gy * dx - gx * dy) > lateral:
                        continue
                    if directions[j].x * dx + directions[j].y * dy < least_cosine:
                        continue
                    if abs(along) > gap and abs((ends[j].y2 - y2) * dx - (ends[j].x2 - x2) * dy) > lateral:
                        continue
                    one, other = root_of(parent, i), root_of(parent, j)
                    parent[max(one, other)] = min(one, other)


@kernel
def grid_cells(
    ends: Records, sectors: Integers, radius: float, shape: Records, listing: bool
) -> tuple[Integers, Integers, Integers]:
    """List for every cell of a uniform grid the walls that come within `radius` of the cell, and their directions.

    `ends` (m,) of `ENDS`; `sectors` (m,) of the directions; `shape` (1,) of `GRID_SHAPE`. Returns ``(starts, items,
    bits)``: cell ``c = row * columns + column`` holds ``items[starts[c]:starts[c + 1]]``, in ascending order, and bit
    ``sectors[i]`` of ``bits[c]`` is set for each wall i of these. Unless `listing`, only the bits are of use.
    """
    x0, y0, cell, columns, rows = shape[0].x0, shape[0].y0, shape[0].cell, shape[0].columns, shape[0].rows
    places = columns * rows
    starts = np.zeros(places + 1, np.int32)
    bits = np.zeros(places, np.uint16)
    items = np.zeros(0, np.int32)
    for counting in (True, False):
        if not counting:
            if not listing:
                break
            total = 0
            for c in range(places + 1):
                here = starts[c]
                starts[c] = total
                total += here
            items = np.zeros(total, np.int32)
        for i in range(len(ends)):
            x1, y1, x2, y2 = ends[i].x1, ends[i].y1, ends[i].x2, ends[i].y2
            least, most = min(x1, x2), max(x1, x2)
            bit = np.uint16(1 << sectors[i])
            first = max(0, int((least - radius - x0) / cell))
            last = min(columns - 1, int((most + radius - x0) / cell))
            for column in range(first, last + 1):
                # The part of the wall that lies within `radius` of the column; beyond its ends, the nearer one.
                left = max(x0 + column * cell - radius, least)
                right = min(x0 + column * cell + cell + radius, most)
                if left > right:
                    left = right = min(max(left, least), most)
                ya, yb = y1, y2
                if most - least >= 1e-9:
                    ya = y1 + (left - x1) / (x2 - x1) * (y2 - y1)
                    yb = y1 + (right - x1) / (x2 - x1) * (y2 - y1)
                bottom = max(0, int((min(ya, yb) - radius - y0) / cell))
                top = min(rows - 1, int((max(ya, yb) + radius - y0) / cell))
                for row in range(bottom, top + 1):
                    c = row * columns + column
                    if counting:
                        bits[c] |= bit
                    else:
                        items[starts[c]] = i
                    starts[c] += 1
    if listing:
        # The second pass moved every start to the next one's place.
        for c in range(places, 0, -1):
            starts[c] = starts[c - 1]
        starts[0] = 0
    return starts, items, bits
