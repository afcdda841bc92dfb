"""Compiled matching of a scan to the walls at a pose."""

import math

import numpy as np

from compiled import kernel
from registration.layout import Floats, Record, Records

from ...index.kernels.walls import fade
from ...layout import Integers
from ...tables import Place, Raster
from ...tuning import (
    APART_GAP,
    APART_STEP,
    DIRECTION_BINS,
    FLAT_GATE,
    FLAT_STEP,
    LONG_BRIDGE,
    MOST_BRIDGED,
    NARROW_REACH,
    OVERLAP_TAPER,
    SECTORS,
    SHORT_BRIDGE,
    WHOLE_GAP,
    WHOLE_WORTH,
)

PER_RADIAN = SECTORS / (2.0 * math.pi)
BINS_PER_RADIAN = DIRECTION_BINS / (2.0 * math.pi)
SUM_SLACK = 1e-9  # nats, rounding
GATE_MARGIN = 1.01  # over a gate: angles are tested by a cosine to the second order


@kernel
def wrap(angle: float) -> float:
    """Return the angle in [-pi, pi]."""
    return angle - 2.0 * math.pi * math.floor((angle + math.pi) / (2.0 * math.pi))


@kernel
def gap_counts(gap: float, length: float) -> tuple[float, float]:
    """Return how much of a gap counts as covered, metres, and how much what a segment covers behind it counts.

    What is open between two walls speaks against a segment that bridges it, unless it is hardly open; and a short
    segment does not bridge it.
    """
    whole = fade(gap, WHOLE_GAP, APART_GAP)
    bridges = min(1.0, max(0.0, (length - SHORT_BRIDGE) / (LONG_BRIDGE - SHORT_BRIDGE)))
    return gap * (2.0 * whole - 1.0), whole + (1.0 - whole) * bridges


@kernel
def follow_chain(
    walls: Records, w: int, laid: tuple[float, float, float, float, float, float], way: float, reach: float, most: int
) -> tuple[float, float, float, float, int]:
    """Add up what a segment covers of the walls that follow wall `w` on its chain, as far as that is to the good.

    `laid` is the segment on the map: midpoint, direction, length, and how far it may be off a wall. `way` is 1 along
    the walls, -1 against them; that way the segment is covered up to `reach` metres from its midpoint. What lies off a
    wall counts less, at the gate nothing, and so does what is on a wall that is beside `w`. Returns by how many metres
    more the segment counts as covered; the length it covers; sums over that of how far the walls are beside `w`, and of
    the square; and how many walls are left to look at, of `most`.
    """
    middle_x, middle_y, dx, dy, length, gate = laid
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
            gap, share = gap_counts(begin - reach, length)
            counts *= share
            net += counts * gap
        start = max(begin, reach)
        stop = min(end, half)
        if stop > start:
            middle = way * 0.5 * (start + stop)
            x = middle_x + middle * dx
            y = middle_y + middle * dy
            off = wall.dx * y - wall.dy * x - wall.offset
            beside = base.dx * y - base.dy * x - base.offset - off
            part = counts * fade(abs(off), FLAT_GATE * gate, gate) * (stop - start)
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
def match_scan(
    scan: Records, estimate: Record, place: Place, gates: Record, possible: Floats, threshold: float, matches: Records
) -> float:
    """Find for every scan segment the wall that it lies on best, the most telling segments first.

    Gated by the innovation: ``offset^2`` against ``sigma^2 + g' C g`` with the pose's covariance C. Best is least in
    offset over gate plus what the overlap lacks. `possible` (n,) is what each segment can add at most, nats, as of
    `may_score` or `allow_all`; those below 0 lie on no wall. Writes wall or -1 and the rest to `matches`, but for
    the worth, and returns the sum of the gains; -1 as soon as `threshold` is out of reach.

    One loop with hardly a call: handing arrays on costs more than the work, Numba counts references to each.
    """
    walls = place.walls
    bin_starts = place.bin_starts
    starts = place.grid.starts
    items = place.grid.items
    shape = place.grid.shape[0]
    c = math.cos(estimate.theta)
    s = math.sin(estimate.theta)
    per_cell = 1.0 / shape.cell
    overlap_taper = min(OVERLAP_TAPER, 1.0 - gates.least_overlap)
    total = 0.0
    left = SUM_SLACK
    for i in range(len(scan)):
        left += max(0.0, possible[i])
    for i in range(len(scan)):
        match = matches[i]
        match.wall = -1
        match.overlap = 0.0
        match.gain = 0.0
        if possible[i] < 0.0:
            continue
        left -= possible[i]
        gx = c * scan[i].x - s * scan[i].y
        gy = s * scan[i].x + c * scan[i].y
        dx = c * scan[i].dx - s * scan[i].dy
        dy = s * scan[i].dx + c * scan[i].dy
        length = scan[i].length
        half = 0.5 * length
        x = gx + estimate.x
        y = gy + estimate.y
        fx = (x - shape.x0) * per_cell
        fy = (y - shape.y0) * per_cell
        best_cost = 1e300
        begin = 0
        end = 0
        if fx >= 0.0 and fy >= 0.0 and fx < shape.columns and fy < shape.rows:
            here = int(fy) * shape.columns + int(fx)
            begin = starts[here]
            end = starts[here + 1]
        if begin < end:
            # g = (n, n . J R m) with the normal n across the segment.
            lever = dx * gx + dy * gy
            var = (
                dy * dy * estimate.xx
                - 2.0 * dx * dy * estimate.xy
                + dx * dx * estimate.yy
                + 2.0 * lever * (dx * estimate.yt - dy * estimate.xt)
                + lever * lever * estimate.tt
            )
            deviation = math.sqrt(scan[i].offset_variance + max(var, 0.0))
            offset_gate = min(gates.greatest_offset, max(gates.least_offset, gates.sigmas * deviation))
            deviation = math.sqrt(scan[i].angle_variance + estimate.tt)
            angle_gate = min(gates.greatest_angle, max(gates.least_angle, gates.sigmas * deviation))
            cos_gate = 1.0 - 0.5 * angle_gate * angle_gate
            # Walls are numbered by direction: those that may be near it are some in a row, from `first` on.
            turned = (estimate.theta + scan[i].angle + math.pi) * BINS_PER_RADIAN
            spread = GATE_MARGIN * angle_gate * BINS_PER_RADIAN
            lowest = math.floor(turned - spread) % DIRECTION_BINS
            highest = math.floor(turned + spread) % DIRECTION_BINS
            first = bin_starts[lowest]
            span = bin_starts[highest + 1] - first
            if highest < lowest:
                span += len(walls)
            left_to_follow = MOST_BRIDGED
            for k in range(begin, end):
                w = items[k]
                place_in_row = w - first
                if place_in_row < 0:
                    place_in_row += len(walls)
                if place_in_row >= span:
                    continue
                wx = walls[w].dx
                wy = walls[w].dy
                offset = wx * y - wy * x - walls[w].offset
                if abs(offset) > offset_gate or wx * dx + wy * dy < cos_gate:
                    continue
                along = wx * x + wy * y
                low = max(walls[w].begin - along, -half)
                high = min(walls[w].end - along, half)
                covered = high - low
                if covered <= 0.0:
                    continue
                # What is on several walls lies on what they make up, each by what is on it.
                on = covered
                aside = 0.0
                squared = 0.0
                if low > -half and walls[w].before >= 0:
                    laid = (x, y, dx, dy, length, offset_gate)
                    more, there, beside, squares, left_to_follow = follow_chain(
                        walls, w, laid, -1.0, -low, left_to_follow
                    )
                    covered += more
                    on += there
                    aside += beside
                    squared += squares
                if high < half and walls[w].after >= 0:
                    laid = (x, y, dx, dy, length, offset_gate)
                    more, there, beside, squares, left_to_follow = follow_chain(
                        walls, w, laid, 1.0, high, left_to_follow
                    )
                    covered += more
                    on += there
                    aside += beside
                    squared += squares
                overlap = min(1.0, covered / length)
                shift = aside / on
                cost = abs(offset - shift) / offset_gate + 1.0 - overlap
                if overlap >= gates.least_overlap and cost < best_cost:
                    best_cost = cost
                    sine = dx * wy - dy * wx
                    match.wall = w
                    match.offset = offset - shift
                    match.sine = sine
                    match.overlap = overlap
                    match.shift = shift
                    match.uneven = max(0.0, squared / on - shift * shift)
                    match.gain = scan[i].gain * overlap
                    # Nothing at a gate, so that none decides.
                    match.gain *= min(1.0, (overlap - gates.least_overlap) / overlap_taper)
                    match.gain *= fade(abs(offset), FLAT_GATE * offset_gate, offset_gate)
                    match.gain *= fade(abs(sine), FLAT_GATE * angle_gate, angle_gate)
        total += match.gain
        if total + left < threshold:
            break
    return -1.0 if total < threshold else total


@kernel
def part_of_match(match: Record) -> float:
    """Return how much of a match there is, 0 to 1, by what it is worth."""
    return min(1.0, match.worth / WHOLE_WORTH) if match.wall >= 0 else 0.0


@kernel
def allow_all(scan: Records, possible: Floats) -> None:
    """Write that every scan segment may lie on a wall."""
    for i in range(len(scan)):
        possible[i] = scan[i].gain


@kernel
def gates_about(scan: Records, figure: Record, gates: Record, spreads: Floats, shifts: Integers, later: Floats) -> None:
    """Write what gates scan segments have at a pose that turns about the pin of `figure`, with the variance there.

    For the angle in sectors, a little wider than `match_scan` has it: see `GATE_MARGIN`; for the offset which bits of
    the raster are to be looked at, those of what is near where the gate is narrow. The covariance of the pose may be
    that of one that is turned by up to the ``slip``. What the segments after each of them can add goes to `later`.
    """
    theta_var = figure.angle_variance
    x = figure.pin_x
    y = figure.pin_y
    away = GATE_MARGIN * figure.slip * math.hypot(x, y)
    for i in range(len(scan)):
        later[i] = scan[i].later_gain
        deviation = math.sqrt(scan[i].angle_variance + theta_var)
        gate = GATE_MARGIN * min(gates.greatest_angle, max(gates.least_angle, gates.sigmas * deviation))
        spreads[i] = gate * PER_RADIAN
        lever = abs(scan[i].dx * (scan[i].x - x) + scan[i].dy * (scan[i].y - y)) + away
        deviation = math.sqrt(scan[i].offset_variance + theta_var * lever * lever)
        gate = GATE_MARGIN * min(gates.greatest_offset, max(gates.least_offset, gates.sigmas * deviation))
        shifts[i] = SECTORS if gate <= NARROW_REACH else 0


@kernel
def may_score(
    scan: Records,
    posed: Records,
    count: int,
    spreads: Floats,
    shifts: Integers,
    later: Floats,
    raster: Raster,
    near: Integers,
) -> None:
    """Tell of poses whether the scan may score there: no segment counts where no wall of its direction is near.

    Of the first `count` of `posed`, (k,) of `HYPOTHESIS`, against the ``floor`` of each. Writes to `near` (n, k) which
    segments may lie on a wall, as far as it takes to tell.

    Never wrong when it says no, as long as half of a segment at least has to lie on walls, so that its midpoint does or
    is between two; and a tenth of the price of `match_scan`. `spreads`, `shifts` and `later` as of `gates_about`; a
    segment whose shift is below 0 is not looked up, and counts for nothing here.

    Line by line, for all poses that are left: so it does not wait for one place of the raster before the next. What it
    goes by is in columns, which stay in the cache where the records would not.
    """
    shape = raster.shape[0]
    bits = raster.bits
    columns = shape.columns
    rows = shape.rows
    per_cell = 1.0 / shape.cell
    cosines = np.empty(count, np.float64)
    sines = np.empty(count, np.float64)
    lefts = np.empty(count, np.float64)
    bottoms = np.empty(count, np.float64)
    turned = np.empty(count, np.float64)
    lacking = np.empty(count, np.float64)
    open_ones = np.empty(count, np.int32)
    for p in range(count):
        one = posed[p]
        cosines[p] = one.cosine * per_cell
        sines[p] = one.sine * per_cell
        lefts[p] = (one.x - shape.x0) * per_cell
        bottoms[p] = (one.y - shape.y0) * per_cell
        turned[p] = (one.theta + math.pi) * PER_RADIAN + 0.5
        lacking[p] = one.floor
        one.possible = 0
        open_ones[p] = p
    left = count
    for i in range(len(scan)):
        near_it = near[i]
        if shifts[i] < 0:
            for k in range(left):
                near_it[open_ones[k]] = True
            continue
        x = scan[i].x
        y = scan[i].y
        gain = scan[i].gain
        angle = scan[i].angle * PER_RADIAN
        spread = spreads[i]
        shift = shifts[i]
        after = later[i]
        kept = 0
        for k in range(left):
            p = open_ones[k]
            fx = cosines[p] * x - sines[p] * y + lefts[p]
            fy = sines[p] * x + cosines[p] * y + bottoms[p]
            # Without a branch, which would wait for the raster.
            inside = (fx >= 0.0) & (fy >= 0.0) & (fx < columns) & (fy < rows)
            cell = int(fy) * columns + int(fx) if inside else 0
            here = bits[cell] >> shift
            fits = inside & ((here & sectors_about(turned[p] + angle, spread)) != 0)
            near_it[p] = fits
            lack = lacking[p] - (gain if fits else 0.0)
            lacking[p] = lack
            open_ones[kept] = p
            kept += 1 if after >= lack else 0
        left = kept
    for k in range(left):
        posed[open_ones[k]].possible = 1


@kernel
def sectors_about(middle: float, spread: float) -> int:
    """Return which sectors there are within `spread` of `middle`, both in sectors, as bits."""
    first = math.floor(middle - spread)
    more = min(SECTORS - 1, math.floor(middle + spread) - first)
    found = ((2 << more) - 1) << (first & (SECTORS - 1))
    return (found | (found >> SECTORS)) & ((1 << SECTORS) - 1)
