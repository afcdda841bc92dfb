"""Reject poses at which a scan cannot score, by the raster of directions: a tenth of the price of matching."""

import math
from typing import NamedTuple

import numpy as np

from compiled import kernel
from registration.layout import Floats, Record, Records

from ...layout import Integers
from ...tables import Raster
from ...tuning import NARROW_REACH, SECTORS
from .geometry import GATE_MARGIN, angle_gate

PER_RADIAN = SECTORS / (2.0 * math.pi)


class Columns(NamedTuple):
    """Poses to be tried in columns, which stay in the cache where records would not.

    Attributes
    ----------
    cosines, sines : (k,) of the headings, over the size of a cell
    lefts, bottoms : (k,) positions in the raster, in cells
    turned : (k,) headings in sectors
    lacking : (k,) the gains that are still needed, nats
    open_ones : (k,) which of them may score, as many as there are
    """

    cosines: Floats
    sines: Floats
    lefts: Floats
    bottoms: Floats
    turned: Floats
    lacking: Floats
    open_ones: Integers


@kernel
def gates_about(scan: Records, figure: Record, gates: Record, spreads: Floats, shifts: Integers, later: Floats) -> None:
    """Write the gates of scan lines at a pose that turns about the pin of `figure`, with the variance there.

    The angle gate is in sectors, a little wider than in `match_scan`: see `GATE_MARGIN`. The offset gate is given by
    the bits of the raster to look at; a narrow gate has those of the nearer walls. The covariance of the pose may be
    that of one that is turned by up to the ``slip``. The possible gain of the lines after each one goes to `later`.
    """
    theta_var = figure.angle_variance
    x = figure.pin_x
    y = figure.pin_y
    away = GATE_MARGIN * figure.slip * math.hypot(x, y)
    for i in range(len(scan)):
        later[i] = scan[i].later_gain
        spreads[i] = GATE_MARGIN * angle_gate(scan[i], theta_var, gates) * PER_RADIAN
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
    """Decide at which poses the scan may score: no line counts where no wall of its direction is near.

    Of the first `count` of `posed`, (k,) of `HYPOTHESIS`, against the ``floor`` of each. Writes to `near` (n, k) which
    lines may lie on a wall, as far as it takes to decide.

    A rejection is never wrong, as long as at least half of a line has to lie on walls: its midpoint then does, or is
    between two. `spreads`, `shifts` and `later` as of `gates_about`; a line whose shift is below 0 is not looked
    up, and counts for nothing here.

    Line by line, for all poses that are left: so it does not wait for one place of the raster before the next.
    """
    shape = raster.shape[0]
    bits = raster.bits
    columns = shape.columns
    rows = shape.rows
    poses = in_columns(posed, count, shape)
    cosines = poses.cosines
    sines = poses.sines
    lefts = poses.lefts
    bottoms = poses.bottoms
    turned = poses.turned
    lacking = poses.lacking
    open_ones = poses.open_ones
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
def in_columns(posed: Records, count: int, shape: Record) -> Columns:
    """Put the first `count` poses of `posed` into columns, all of them open, and write that none may score."""
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
    return Columns(cosines, sines, lefts, bottoms, turned, lacking, open_ones)


@kernel
def sectors_about(middle: float, spread: float) -> int:
    """Return which sectors there are within `spread` of `middle`, both in sectors, as bits."""
    first = math.floor(middle - spread)
    more = min(SECTORS - 1, math.floor(middle + spread) - first)
    found = ((2 << more) - 1) << (first & (SECTORS - 1))
    return (found | (found >> SECTORS)) & ((1 << SECTORS) - 1)
