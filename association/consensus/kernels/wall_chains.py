"""Measure the part of a wall chain, of walls that continue one another, that a scan line covers."""

from compiled import kernel
from registration.layout import Record, Records

from ...index.kernels.walls import fade
from ...tuning import APART_GAP, APART_STEP, WHOLE_GAP
from ..tuning import FLAT_GATE, FLAT_STEP, LONG_BRIDGE, SHORT_BRIDGE

# A scan line on the map: x and y of its midpoint, its direction, its length, and how far it may be off a wall, m.
Line = tuple[float, float, float, float, float, float]
# The part of a scan line that a wall and its neighbours on the chain cover: the metres that count as covered; the
# length that is covered, m; sums over that length of the walls' steps from the wall, and of their squares.
Cover = tuple[float, float, float, float]


@kernel
def gap_counts(gap: float, length: float) -> tuple[float, float]:
    """Return how much of a gap counts as covered, metres, and how much what a segment covers behind it counts.

    A gap between two walls is evidence against a segment that bridges it, unless the gap is very narrow. A short
    segment does not bridge it.
    """
    whole = fade(gap, WHOLE_GAP, APART_GAP)
    bridges = min(1.0, max(0.0, (length - SHORT_BRIDGE) / (LONG_BRIDGE - SHORT_BRIDGE)))
    return gap * (2.0 * whole - 1.0), whole + (1.0 - whole) * bridges


@kernel
def wall_under(wall: Record, base: Record, line: Line, way: float, start: float, stop: float) -> tuple[float, float]:
    """Return how much a wall counts under a scan line between two abscissae, 0 to 1, and its step from `base`, m.

    A line that lies off a wall counts less, at the gate nothing.
    """
    middle_x, middle_y, dx, dy, _, gate = line
    middle = way * 0.5 * (start + stop)
    x = middle_x + middle * dx
    y = middle_y + middle * dy
    off = wall.dx * y - wall.dy * x - wall.offset
    beside = base.dx * y - base.dy * x - base.offset - off
    return fade(abs(off), FLAT_GATE * gate, gate), beside


@kernel
def follow_chain(
    walls: Records, w: int, line: Line, way: float, reach: float, most: int
) -> tuple[float, float, float, float, int]:
    """Add up what a scan line covers of the walls that follow wall `w` on its chain, as far as that is to the good.

    `way` is 1 along the walls, -1 against them; that way the line is covered up to `reach` metres from its midpoint. A
    part on a wall with a lateral step from `w` counts less. Returns by how many metres more the line counts as covered;
    the length that it covers; sums over that length of the walls' steps from `w`, and of their squares; and how many
    walls are left to look at, of `most`.
    """
    middle_x, middle_y, _, _, length, _ = line
    base = walls[w]
    half = 0.5 * length
    counts = 1.0
    net = 0.0
    covered = 0.0
    first = 0.0
    second = 0.0
    best = (0.0, 0.0, 0.0, 0.0)
    v = base.after if way > 0.0 else base.before
    while v >= 0 and reach < half and most > 0:
        most -= 1
        wall = walls[v]
        along = wall.dx * middle_x + wall.dy * middle_y
        begin = wall.begin - along if way > 0.0 else along - wall.end
        end = wall.end - along if way > 0.0 else along - wall.begin
        if begin >= half:
            break
        if begin > reach:
            gap, counted = gap_counts(begin - reach, length)
            counts *= counted
            net += counts * gap
        start = max(begin, reach)
        stop = min(end, half)
        if stop > start:
            near, beside = wall_under(wall, base, line, way, start, stop)
            part = counts * near * (stop - start)
            part *= fade(abs(beside), FLAT_STEP, APART_STEP)
            net += part
            covered += part
            first += part * beside
            second += part * beside * beside
            if net > best[0]:
                best = (net, covered, first, second)
            reach = end
        v = wall.after if way > 0.0 else wall.before
    return best[0], best[1], best[2], best[3], most


@kernel
def follow_both_ways(walls: Records, w: int, line: Line, low: float, high: float, most: int) -> tuple[Cover, int]:
    """Add up what a scan line covers of wall `w`, on it between `low` and `high`, and of its neighbours on the chain.

    Also returns how many walls are left to look at, of `most`.
    """
    half = 0.5 * line[4]
    counted = high - low
    covered = counted
    first = 0.0
    second = 0.0
    if low > -half and walls[w].before >= 0:
        more, there, beside, squares, most = follow_chain(walls, w, line, -1.0, -low, most)
        counted += more
        covered += there
        first += beside
        second += squares
    if high < half and walls[w].after >= 0:
        more, there, beside, squares, most = follow_chain(walls, w, line, 1.0, high, most)
        counted += more
        covered += there
        first += beside
        second += squares
    return (counted, covered, first, second), most
