"""Compiled matching of a scan to the walls at a pose."""

import math

import numpy as np

from registration.allocating import empty
from registration.compiling import inlined, kernel
from registration.layout import Floats, Record, Records

from ..layout import Integers
from ..tables import Place, Raster
from ..tuning import BRIDGING, DIRECTION_BINS, MOST_BRIDGED, NARROW_REACH, SECTORS

PER_RADIAN = SECTORS / (2.0 * math.pi)
BINS_PER_RADIAN = DIRECTION_BINS / (2.0 * math.pi)
SUM_SLACK = 1e-9  # nats, rounding
GATE_MARGIN = 1.01  # over a gate: angles are tested by a cosine to the second order


@inlined
def wrap(angle: float) -> float:
    """Return the angle in [-pi, pi]."""
    return angle - 2.0 * math.pi * math.floor((angle + math.pi) / (2.0 * math.pi))


@kernel
def match_scan(
    scan: Records, estimate: Record, place: Place, gates: Record, possible: Floats, threshold: float, matches: Records
) -> float:
    """Find for every scan segment the wall that it lies on best, the most telling segments first.

    Gated by the innovation: ``offset^2`` against ``sigma^2 + g' C g`` with the pose's covariance C. Best is least in
    offset over gate plus what the overlap lacks. `possible` (n,) is what each segment can add at most, nats, as of
    `may_score` or `allow_all`; those below 0 lie on no wall. Writes wall or -1, offset, sine and overlap to `matches`
    and returns the sum of the gains, weighted by overlap; -1 as soon as `threshold` is out of reach. Of the neighbours
    on their runs that the walls of a segment have, `MOST_BRIDGED` are looked at.

    One loop without calls: handing arrays on costs more than the work, Numba counts references to each.
    """
    walls = place.walls
    bin_starts = place.bin_starts
    starts = place.grid.starts
    items = place.grid.items
    shape = place.grid.shape[0]
    c = math.cos(estimate.theta)
    s = math.sin(estimate.theta)
    per_cell = 1.0 / shape.cell
    total = 0.0
    left = SUM_SLACK
    for i in range(len(scan)):
        left += max(0.0, possible[i])
    for i in range(len(scan)):
        matches[i].wall = -1
        matches[i].overlap = 0.0
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
            bridged = 0
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
                # What bridges a doorway lies on the walls on both sides of it; the gap between speaks against that.
                bridging = length > BRIDGING and covered > 0.0
                v = walls[w].before if low > -half and bridging else -1
                while v >= 0 and bridged < MOST_BRIDGED:
                    bridged += 1
                    along = walls[v].dx * x + walls[v].dy * y
                    edge = walls[v].end - along
                    if edge <= -half:
                        break
                    covered -= low - edge
                    low = max(walls[v].begin - along, -half)
                    covered += edge - low
                    v = walls[v].before if low > -half else -1
                v = walls[w].after if high < half and bridging else -1
                while v >= 0 and bridged < MOST_BRIDGED:
                    bridged += 1
                    along = walls[v].dx * x + walls[v].dy * y
                    edge = walls[v].begin - along
                    if edge >= half:
                        break
                    covered -= edge - high
                    high = min(walls[v].end - along, half)
                    covered += high - edge
                    v = walls[v].after if high < half else -1
                overlap = min(1.0, covered / length)
                cost = abs(offset) / offset_gate + 1.0 - overlap
                if overlap >= gates.least_overlap and cost < best_cost:
                    best_cost = cost
                    matches[i].wall = w
                    matches[i].offset = offset
                    matches[i].sine = dx * wy - dy * wx
                    matches[i].overlap = overlap
        total += scan[i].gain * matches[i].overlap
        if total + left < threshold:
            return -1.0
    return -1.0 if total < threshold else total


@inlined
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

    Of the first `count` of `posed`, (k,) of `POSED`, against the ``floor`` of each. Writes to `near` (n, k) which
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
    cosines = empty(count, np.float64)
    sines = empty(count, np.float64)
    lefts = empty(count, np.float64)
    bottoms = empty(count, np.float64)
    turned = empty(count, np.float64)
    lacking = empty(count, np.float64)
    open_ones = empty(count, np.int32)
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


@inlined
def sectors_about(middle: float, spread: float) -> int:
    """Return which sectors there are within `spread` of `middle`, both in sectors, as bits."""
    first = math.floor(middle - spread)
    more = min(SECTORS - 1, math.floor(middle + spread) - first)
    found = ((2 << more) - 1) << (first & (SECTORS - 1))
    return (found | (found >> SECTORS)) & ((1 << SECTORS) - 1)
