"""Compiled parts of building a map index: merging collinear pieces, and the grid over the walls."""

import math

import numpy as np

from compiled import kernel
from registration.layout import Floats, Record, Records

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
def tie_between(before: Record, after: Record, apart: float) -> float:
    """Return minus the log of how much two linked walls are one, up to `TIE_FREE`; with a step of `apart`, m, none.

    The second one begins behind the begin of the first one. The step is the farthest that the shorter one is off the
    line of the other, so that walls that bend are not one either.
    """
    begin, first = seen_from(before, after, after.begin)
    _, last = seen_from(before, after, after.end)
    if before.end - before.begin < after.end - after.begin:
        _, first = seen_from(after, before, before.begin)
        _, last = seen_from(after, before, before.end)
    step = max(abs(first), abs(last))
    correlation = fade(step, 0.0, apart) * fade(begin - before.end, WHOLE_GAP, APART_GAP)
    return -math.log(correlation) if correlation > math.exp(-TIE_FREE) else TIE_FREE


@kernel
def seen_from(wall: Record, other: Record, at: float) -> tuple[float, float]:
    """Return the abscissa on a wall of the place at an abscissa of another, and how far that is to its left, metres."""
    x = other.dx * at - other.dy * other.offset
    y = other.dy * at + other.dx * other.offset
    return wall.dx * x + wall.dy * y, wall.dx * y - wall.dy * x - wall.offset


@kernel
def tie_walls(walls: Records, order: Integers, group: Integers, apart: float) -> Floats:
    """Return where in its group each wall is, (m,), as of `Place.ties`; in `order` they are group by group, by begin.

    Each is tied to that of the walls before it to which it is tied best; with a step of `apart`, metres, to none.
    """
    ties = np.empty(len(walls), np.float64)
    at = 0.0
    for k in range(len(order)):
        w = order[k]
        place = at + TIE_FREE
        for back in range(1, min(k, TIES_BEFORE) + 1):
            v = order[k - back]
            if group[v] != group[w]:
                break
            here = tie_between(walls[v], walls[w], apart)
            if here < TIE_FREE and ties[v] + here < place:
                place = ties[v] + here
        ties[w] = place
        at = max(at, place)
    for k in range(len(order)):
        first = k == 0 or group[order[k - 1]] != group[order[k]]
        if first and (k + 1 == len(order) or group[order[k + 1]] != group[order[k]]):
            ties[order[k]] = -1.0
    return ties


@kernel
def _find(parent: Integers, i: int) -> int:
    while parent[i] != i:
        parent[i] = parent[parent[i]]
        i = parent[i]
    return i


@kernel
def list_begins(ends: Records, cell: float) -> tuple[Integers, Integers]:
    """List where pieces begin, by a hash of their cell: memory does not grow with the extent.

    `ends` (n,) of `ENDS`, `cell` metres. Returns (buckets,) the last piece of each hash, and (n,) the one before each
    piece in the same list; -1 where there is none.
    """
    n = len(ends)
    buckets = 1
    while buckets < 2 * n:
        buckets *= 2
    heads = np.full(buckets, -1)
    following = np.full(n, -1)
    for i in range(n):
        key = _cell_hash(math.floor(ends[i].x1 / cell), math.floor(ends[i].y1 / cell), buckets)
        following[i] = heads[key]
        heads[key] = i
    return heads, following


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

    Around each piece the begins of others are looked up. Some are not merged if more than `MOST_LOOKS` begin about one
    piece, or beyond `MOST_STEPS` places before its end. No map of a building has so many. `ends` (n,) of `ENDS`,
    `directions` (n,) of `POINT`; `heads` and `following` of `list_begins`.
    """
    buckets = len(heads)
    spacing = 1.98 * (gates.cell - gates.lateral)
    for i in range(first, last):
        length = math.hypot(ends[i].x2 - ends[i].x1, ends[i].y2 - ends[i].y1)
        looks = 0
        # At places from the end backwards, evenly spread, the last of them the begin.
        steps = math.ceil(length / spacing)
        for step in range(min(steps, MOST_STEPS) + 1):
            back = step * length / steps if step < MOST_STEPS else length
            column = math.floor((ends[i].x2 - back * directions[i].x) / gates.cell)
            row = math.floor((ends[i].y2 - back * directions[i].y) / gates.cell)
            for a in range(-1, 2):
                for b in range(-1, 2):
                    j = heads[_cell_hash(column + a, row + b, buckets)]
                    while j >= 0 and looks < MOST_LOOKS:
                        looks += 1
                        if j != i and continues(ends[i], directions[i], length, ends[j], directions[j], gates):
                            _join(parent, i, j)
                        j = following[j]


@kernel
def continues(
    piece: Record, direction: Record, length: float, other: Record, other_direction: Record, gates: JoinGates
) -> bool:
    """Return whether another piece continues or repeats a piece of some length.

    It begins along the piece, or within the gap of its end. If it begins along it, it has to end near its line, too.
    """
    dx = direction.x
    dy = direction.y
    gx = other.x1 - piece.x2
    gy = other.y1 - piece.y2
    along = gx * dx + gy * dy
    return (
        -length - gates.gap <= along <= gates.gap
        and abs(gy * dx - gx * dy) <= gates.lateral
        and other_direction.x * dx + other_direction.y * dy >= gates.least_cosine
        and (abs(along) <= gates.gap or abs((other.y2 - piece.y2) * dx - (other.x2 - piece.x2) * dy) <= gates.lateral)
    )


@kernel
def _join(parent: Integers, i: int, j: int) -> None:
    """Join two trees of a union-find forest; the lower index becomes the root."""
    one = _find(parent, i)
    other = _find(parent, j)
    if one < other:
        parent[other] = one
    else:
        parent[one] = other


@kernel
def label_groups(parent: Integers) -> None:
    """Turn a union-find forest (n,) into labels, the lowest index of each group."""
    for i in range(len(parent)):
        parent[i] = _find(parent, i)


@kernel
def blend_walls(
    walls: Records, lengths: Floats, order: Integers, group: Integers, ties: Floats, lines: Records
) -> None:
    """Write the line of each wall with those that it is tied to, (m,) of `LINE`: their means, by length and tie.

    `order` as of `tie_walls`.
    """
    for k in range(len(order)):
        w = order[k]
        dx = lengths[w] * walls[w].dx
        dy = lengths[w] * walls[w].dy
        x, y = middle_of(walls[w])
        x *= lengths[w]
        y *= lengths[w]
        total = lengths[w]
        for way in (-1, 1):
            j = k + way
            while 0 <= j < len(order) and abs(j - k) <= BLENDED_WALLS and group[order[j]] == group[w]:
                v = order[j]
                part = lengths[v] * math.exp(-abs(ties[v] - ties[w]))
                dx += part * walls[v].dx
                dy += part * walls[v].dy
                at_x, at_y = middle_of(walls[v])
                x += part * at_x
                y += part * at_y
                total += part
                j += way
        size = math.hypot(dx, dy)
        line = lines[w]
        line.dx = dx / size
        line.dy = dy / size
        line.offset = (line.dx * y - line.dy * x) / total


@kernel
def middle_of(wall: Record) -> tuple[float, float]:
    """Return the midpoint of a wall, metres."""
    middle = 0.5 * (wall.begin + wall.end)
    return wall.dx * middle - wall.dy * wall.offset, wall.dy * middle + wall.dx * wall.offset


@kernel
def _cell_hash(column: int, row: int, buckets: int) -> int:
    return (int(column) * 73856093 ^ int(row) * 19349663) & (buckets - 1)


@kernel
def _column_span(
    x1: float, y1: float, x2: float, y2: float, radius: float, low: float, high: float
) -> tuple[float, float]:
    """Return the span of y that a segment dilated by `radius` may have between two values of x."""
    left = max(low - radius, min(x1, x2))
    right = min(high + radius, max(x1, x2))
    if left > right:
        # Beyond the ends: the disc around the nearer one.
        left = min(max(left, min(x1, x2)), max(x1, x2))
        right = left
    if abs(x2 - x1) < 1e-9:
        ya = min(y1, y2)
        yb = max(y1, y2)
    else:
        ya = y1 + (left - x1) / (x2 - x1) * (y2 - y1)
        yb = y1 + (right - x1) / (x2 - x1) * (y2 - y1)
    return min(ya, yb) - radius, max(ya, yb) + radius


@kernel
def grid_cells(ends: Records, radius: float, shape: Records) -> tuple[Integers, Integers]:
    """List for every cell of a uniform grid the walls that come within `radius` of the cell.

    `shape` (1,) of `GRID_SHAPE`. Returns ``(starts, items)``: cell ``c = row * columns + column``
    holds ``items[starts[c]:starts[c + 1]]``, in ascending order.
    """
    x0, y0, cell = shape[0].x0, shape[0].y0, shape[0].cell
    columns, rows = shape[0].columns, shape[0].rows
    places = columns * rows
    starts = np.zeros(places + 1, np.int32)
    items = np.zeros(0, np.int32)
    for counting in (True, False):
        if not counting:
            total = 0
            for c in range(places + 1):
                here = starts[c]
                starts[c] = total
                total += here
            items = np.zeros(total, np.int32)
        for i in range(len(ends)):
            x1 = ends[i].x1
            y1 = ends[i].y1
            x2 = ends[i].x2
            y2 = ends[i].y2
            first = max(0, int((min(x1, x2) - radius - x0) / cell))
            last = min(columns - 1, int((max(x1, x2) + radius - x0) / cell))
            for column in range(first, last + 1):
                low = x0 + column * cell
                ya, yb = _column_span(x1, y1, x2, y2, radius, low, low + cell)
                bottom = max(0, int((ya - y0) / cell))
                top = min(rows - 1, int((yb - y0) / cell))
                for row in range(bottom, top + 1):
                    c = row * columns + column
                    if not counting:
                        items[starts[c]] = i
                    starts[c] += 1
    # The second pass moved every start to the next one's place.
    for c in range(places, 0, -1):
        starts[c] = starts[c - 1]
    starts[0] = 0
    return starts, items


@kernel
def direction_raster(ends: Records, radius: float, shape: Records, sectors: Integers, bits: Integers) -> None:
    """Set bit ``sectors[i]`` of every cell that wall i comes within `radius` of, in `bits` (rows * columns,)."""
    x0, y0, cell = shape[0].x0, shape[0].y0, shape[0].cell
    columns, rows = shape[0].columns, shape[0].rows
    for i in range(len(ends)):
        x1 = ends[i].x1
        y1 = ends[i].y1
        x2 = ends[i].x2
        y2 = ends[i].y2
        bit = np.uint32(1 << sectors[i])
        first = max(0, int((min(x1, x2) - radius - x0) / cell))
        last = min(columns - 1, int((max(x1, x2) + radius - x0) / cell))
        for column in range(first, last + 1):
            low = x0 + column * cell
            ya, yb = _column_span(x1, y1, x2, y2, radius, low, low + cell)
            bottom = max(0, int((ya - y0) / cell))
            top = min(rows - 1, int((yb - y0) / cell))
            for row in range(bottom, top + 1):
                bits[row * columns + column] |= bit
