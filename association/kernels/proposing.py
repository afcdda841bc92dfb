"""Compiled proposals: from bases of two scan segments to poses."""

import math

import numpy as np

from registration.compiling import inlined, kernel
from registration.layout import Record, Records

from ..layout import HARD_PRIOR, Integers
from ..tables import MapTables, Question, Workspace
from ..tuning import (
    BASE_SLACK,
    BASE_SLACK_SHARE,
    MIN_CROSSING,
    SECTOR_BITS,
    SECTORS,
    TESTS_ANCHOR,
    WINDOW_MARGIN,
    WINDOW_TURN,
)
from .consensus import turning
from .matching import PER_RADIAN, gates_about, wrap
from .trying import try_pose


@inlined
def end_slack(length: float) -> float:
    """Return how far a scan segment, as part of a base, may stick out at each end of its wall."""
    return BASE_SLACK + BASE_SLACK_SHARE * length


@inlined
def least_length(length: float) -> float:
    """Return how long a wall is at least under a scan segment of a base."""
    return length - 2.0 * end_slack(length)


@kernel
def anchors(length: float, runs: Records, bin_starts: Integers, out: Integers) -> int:
    """List the runs long enough for a scan segment of `length` metres."""
    n = 0
    need = least_length(length)
    for b in range(len(bin_starts) - 1):
        for w in range(bin_starts[b], bin_starts[b + 1]):
            if runs[w].end - runs[w].begin < need:
                break
            out[n] = w
            n += 1
    return n


@kernel
def base_pose(a: Record, b: Record, wa: Record, wb: Record, pose: Record) -> bool:
    """Write the pose that puts the midpoints of `a` and `b` on the lines `wa` and `wb`.

    Splits the misfit of the angles by their variances. Returns whether both segments then lie within the ends of their
    lines, up to their slack.
    """
    gap = wrap(wb.angle - wa.angle - b.angle + a.angle)
    theta = wa.angle - a.angle + gap * a.angle_variance / (a.angle_variance + b.angle_variance)
    c = math.cos(theta)
    s = math.sin(theta)
    det = wa.dx * wb.dy - wa.dy * wb.dx
    # n . t = p - n . R m for both, with n = (-d_y, d_x).
    ax = c * a.x - s * a.y
    ay = s * a.x + c * a.y
    bx = c * b.x - s * b.y
    by = s * b.x + c * b.y
    ra = wa.offset + wa.dy * ax - wa.dx * ay
    rb = wb.offset + wb.dy * bx - wb.dx * by
    tx = (ra * wb.dx - rb * wa.dx) / det
    ty = (ra * wb.dy - rb * wa.dy) / det
    pose.theta = theta
    pose.x = tx
    pose.y = ty
    along = wa.dx * (ax + tx) + wa.dy * (ay + ty)
    half = 0.5 * a.length - end_slack(a.length)
    if along - half < wa.begin or along + half > wa.end:
        return False
    along = wb.dx * (bx + tx) + wb.dy * (by + ty)
    half = 0.5 * b.length - end_slack(b.length)
    return along - half >= wb.begin and along + half <= wb.end


@kernel
def search_base(
    question: Question,
    tables: MapTables,
    base: Record,
    found: Records,
    tried: Records,
    progress: Record,
    work: Workspace,
    budget: int,
) -> int:
    """Go through all pairs of runs that fit a base of two scan segments a, which slides, and b.

    A run under a fixes the rotation and leaves one slide; the grid is walked along what the midpoint of b then sweeps.
    The final angle splits the misfit of both, so that b turns about a by up to `swing` metres: the ends are tested
    loosely until then. Goes on from the anchor where `progress` stands, at its slide unless that is -inf and there at
    the item of its step, and stops when `budget` tests are used up, within a cell, too, or the room in `tried`. Returns
    the tests that it took; the anchor is back at 0, and the slide at -inf, when the base is done.

    The walk stands here whole, and reads arrays only by element: see `match_scan`.
    """
    place = tables.place
    raster = tables.raster
    runs = tables.sweep.runs
    bin_starts = tables.sweep.bin_starts
    starts = tables.sweep.sectors.starts
    items = tables.sweep.sectors.items
    shape = tables.sweep.sectors.shape[0]
    gates = question.terms[0].gates
    prior = question.terms[0].prior
    pose = work.scratch[0].estimate
    a = question.scan[base.sliding]
    b = question.scan[base.crossing]
    anchor_list = np.empty(len(runs), dtype=np.int32)
    n_anchors = anchors(a.length, runs, bin_starts, anchor_list)
    va = a.angle_variance
    vb = b.angle_variance
    theta_var = va * vb / (va + vb)
    tolerance = min(gates.greatest_angle, max(gates.least_angle, gates.sigmas * math.sqrt(va + vb)))
    cos_tolerance = 1.0 - 0.5 * tolerance * tolerance
    turn = b.angle - a.angle
    mx = b.x - a.x
    my = b.y - a.y
    slip = tolerance * va / (va + vb)
    swing = slip * math.hypot(mx, my) / abs(math.sin(turn))
    half_a = 0.5 * a.length - end_slack(a.length) - swing
    half_b = 0.5 * b.length - end_slack(b.length) - swing
    adx = a.dx
    ady = a.dy
    bdx = b.dx
    bdy = b.dy
    pin_x = 0.5 * (a.x + b.x)
    pin_y = 0.5 * (a.y + b.y)
    gates_about(question.scan, theta_var, pin_x, pin_y, slip, gates, work.spreads, work.shifts)
    x0 = shape.x0
    y0 = shape.y0
    cell = shape.cell
    columns = shape.columns
    rows = shape.rows
    per_cell = 1.0 / cell
    spread = tolerance * PER_RADIAN
    spent = len(bin_starts)
    # A hard prior says about where the midpoint of a is.
    windowed = prior.kind == HARD_PRIOR
    widest = prior.angle + WINDOW_TURN + tolerance
    nearest_x = math.cos(prior.theta) * a.x - math.sin(prior.theta) * a.y + prior.x
    nearest_y = math.sin(prior.theta) * a.x + math.cos(prior.theta) * a.y + prior.y
    lever = 2.0 * math.hypot(a.x, a.y) * math.sin(0.5 * min(widest, math.pi))
    window = prior.radius + WINDOW_MARGIN + lever + swing
    while progress.anchor < n_anchors:
        w = anchor_list[progress.anchor]
        wa = runs[w]
        progress.anchor += 1
        spent += TESTS_ANCHOR
        dx = wa.dx
        dy = wa.dy
        resumed = progress.slide > -math.inf
        at = max(wa.begin + half_a, progress.slide)
        high = wa.end - half_a
        first = progress.step
        progress.slide = -math.inf
        progress.step = 0
        entered = at
        if windowed:
            away = dx * nearest_y - dy * nearest_x - wa.offset
            if abs(away) > window or abs(wrap(wa.angle - a.angle - prior.theta)) > widest:
                continue
            along = dx * nearest_x + dy * nearest_y
            at = max(at, along - window)
            high = min(high, along + window)
        # Rotation that lays a on the wall, and the direction that b then has.
        c = dx * adx + dy * ady
        s = dy * adx - dx * ady
        tdx = c * bdx - s * bdy
        tdy = s * bdx + c * bdy
        # Midpoint of b with a's midpoint at abscissa 0 of its wall; the slide is that abscissa.
        x = c * mx - s * my - dy * wa.offset
        y = s * mx + c * my + dx * wa.offset
        fx = (x + at * dx - x0) * per_cell
        fy = (y + at * dy - y0) * per_cell
        column = math.floor(fx)
        row = math.floor(fy)
        step_x = 1 if dx > 0.0 else -1
        step_y = 1 if dy > 0.0 else -1
        pace_x = cell / max(abs(dx), 1e-12)
        pace_y = cell / max(abs(dy), 1e-12)
        next_x = at + ((column + 1 - fx) if dx > 0.0 else (fx - column)) * pace_x
        next_y = at + ((row + 1 - fy) if dy > 0.0 else (fy - row)) * pace_y
        if resumed:  # as it was left, to the bit: a crossing may lie where cells meet
            column = progress.column
            row = progress.row
            next_x = progress.next_x
            next_y = progress.next_y
        # The sectors that the direction of b may lie in, one or two.
        turned = (wa.angle + turn + math.pi) * PER_RADIAN + 0.5
        first_sector = math.floor(turned - spread)
        more_sectors = math.floor(turned + spread) - first_sector
        while at <= high:
            until = min(next_x, next_y)
            if 0 <= column < columns and 0 <= row < rows:
                here = row * columns + column
                begin = starts[here]
                if begin < first <= starts[here + 1]:
                    begin = first  # those before it were looked at the last time
                for k in range(begin, starts[here + 1]):
                    if (items[k] - first_sector) & (SECTORS - 1) > more_sectors:
                        continue
                    wb = items[k] >> SECTOR_BITS
                    spent += 1
                    wx = runs[wb].dx
                    wy = runs[wb].dy
                    across = wx * dy - wy * dx
                    if wx * tdx + wy * tdy < cos_tolerance or abs(across) < MIN_CROSSING:
                        continue
                    slide = (runs[wb].offset - wx * y + wy * x) / across
                    # A wall is listed in several cells: it counts where the crossing is.
                    if slide < at or slide >= until or slide > high:
                        continue
                    along = wx * (x + slide * dx) + wy * (y + slide * dy)
                    if along - half_b < runs[wb].begin or along + half_b > runs[wb].end:
                        continue
                    if base_pose(a, b, wa, runs[wb], pose):
                        turning(theta_var, c * pin_x - s * pin_y, s * pin_x + c * pin_y, pose)
                        spent += try_pose(question, place, raster, found, tried, progress, work)
                        if spent > budget or (progress.tried == len(tried) and progress.tried > 0):
                            progress.anchor -= 1
                            progress.slide = at
                            progress.step = k + 1
                            progress.column = column
                            progress.row = row
                            progress.next_x = next_x
                            progress.next_y = next_y
                            return spent
            at = until
            if next_x < next_y:
                column += step_x
                next_x += pace_x
            else:
                row += step_y
                next_y += pace_y
            # Rounding may have led back into the cell before, which leaves `at` where it is.
            if spent > budget and entered < at <= high:
                progress.anchor -= 1
                progress.slide = at
                progress.column = column
                progress.row = row
                progress.next_x = next_x
                progress.next_y = next_y
                return spent
        if spent > budget and progress.anchor < n_anchors:
            return spent
    progress.anchor = 0
    progress.bases += 1
    return spent
