"""Propose poses: a base of two scan lines laid on all pairs of wall chains, one line slid along all of them."""

from __future__ import annotations

import math

import numpy as np

from compiled import kernel
from registration.layout import Floats, Record, Records

from ...consensus.kernels.geometry import angle_gate, prior_value, wrap
from ...layout import HARD_PRIOR, MOST_NOTED, Integers
from ...tables import Question, Raster, Sweep
from ...tuning import BASE_SLACK, BASE_SLACK_SHARE, MIN_CROSSING, SECTOR_BITS, SECTORS
from ..tuning import WINDOW_MARGIN, WINDOW_TURN

PER_RADIAN = SECTORS / (2.0 * math.pi)
GATE_MARGIN = 1.01  # over a gate: angles are tested by a cosine to the second order


@kernel
def end_slack(length: float) -> float:
    """Return how far a scan line, as part of a base, may stick out at each end of its wall."""
    return BASE_SLACK + BASE_SLACK_SHARE * length


@kernel
def is_about(prior: Record, pose: Record) -> bool:
    """Return whether a pose may be refined into the window of a hard prior."""
    near = math.hypot(pose.x - prior.x, pose.y - prior.y) <= prior.radius + WINDOW_MARGIN
    return near and abs(wrap(pose.theta - prior.theta)) <= prior.angle + WINDOW_TURN


@kernel
def sectors_about(middle: float, spread: float) -> int:
    """Return which sectors there are within `spread` of `middle`, both in sectors, as bits."""
    first = math.floor(middle - spread)
    more = min(SECTORS - 1, math.floor(middle + spread) - first)
    found = ((2 << more) - 1) << (first & (SECTORS - 1))
    return (found | (found >> SECTORS)) & ((1 << SECTORS) - 1)


@kernel
def sweep_bases(question: Question, bases: Integers, sweep: Sweep, first: int, posed: Records) -> tuple[int, int]:
    """Write the poses that lay bases on two wall chains, from a step on; return the next step, and how many.

    A step is one base on one chain: ``base * chains + chain``. The array is left when it is half full. If one step
    fills it, -1 is returned in place of the number: the array has to be larger.

    Parameters
    ----------
    question : Question
    bases : (b, 2)
        The scan lines that slide and cross.
    sweep : Sweep
    first : int
    posed : (k,) of `HYPOTHESIS`
        Written.
    """
    number = len(sweep.chains)
    count = 0
    for k in range(first // number, len(bases)):
        chain, count = sweep_base(
            question, bases[k, 0], bases[k, 1], sweep, max(0, first - k * number), posed, count
        )  # fmt: skip
        if chain < number:
            return k * number + chain, count
    return len(bases) * number, count


@kernel
def sweep_base(
    question: Question, sliding: int, crossing: int, sweep: Sweep, first: int, posed: Records, count: int
) -> tuple[int, int]:
    """Write the poses of one base behind the first `count`; return the next chain, and how many there are then.

    While line a slides along a chain, the midpoint of b passes the cells of a grid, which list the chains of each
    direction: b lies on one where its midpoint crosses it.
    """
    gates, prior = question.terms[0].gates, question.terms[0].prior
    a, b = question.scan[sliding], question.scan[crossing]
    chains, lengths, present = sweep.chains, sweep.lengths, sweep.present
    starts, items = sweep.sectors.starts, sweep.sectors.items
    shape = sweep.sectors.shape[0]
    cell, columns, rows = shape.cell, shape.columns, shape.rows
    per_cell = 1.0 / cell
    windowed = prior.kind == HARD_PRIOR
    va, vb = a.angle_variance, b.angle_variance
    gx, gy = b.x - a.x, b.y - a.y
    turn = b.angle - a.angle
    tolerance = min(gates.greatest_angle, max(gates.least_angle, gates.sigmas * math.sqrt(va + vb)))
    least_cosine = 1.0 - 0.5 * tolerance * tolerance
    spread = tolerance * PER_RADIAN
    # The rotation of the base is only known up to the angle between its lines: until then b is off by that much.
    swing = tolerance * va / (va + vb) * math.hypot(gx, gy) / abs(math.sin(turn))
    half_a = 0.5 * a.length - end_slack(a.length)
    half_b = 0.5 * b.length - end_slack(b.length)
    need = 2.0 * half_a
    for w in range(first, len(chains)):
        if lengths[w] < need:
            continue
        if 2 * count >= len(posed):
            return w, count
        wa = chains[w]
        dx, dy = wa.dx, wa.dy
        c, s = dx * a.dx + dy * a.dy, dy * a.dx - dx * a.dy
        if windowed and abs(wrap(wa.angle - a.angle - prior.theta)) > prior.angle + WINDOW_TURN + tolerance:
            continue
        # Midpoint and direction of b with the midpoint of a at abscissa 0 of the chain; the slide is that abscissa.
        bdx, bdy = c * b.dx - s * b.dy, s * b.dx + c * b.dy
        x = c * gx - s * gy - dy * wa.offset
        y = s * gx + c * gy + dx * wa.offset
        at, high = wa.begin + half_a - swing, wa.end - half_a + swing
        wanted = sectors_about((wa.angle + turn + math.pi) * PER_RADIAN + 0.5, spread)
        fx = (x + at * dx - shape.x0) * per_cell
        fy = (y + at * dy - shape.y0) * per_cell
        column, row = math.floor(fx), math.floor(fy)
        step_x, step_y = 1 if dx > 0.0 else -1, 1 if dy > 0.0 else -1
        pace_x, pace_y = cell / max(abs(dx), 1e-12), cell / max(abs(dy), 1e-12)
        next_x = at + ((column + 1 - fx) if dx > 0.0 else (fx - column)) * pace_x
        next_y = at + ((row + 1 - fy) if dy > 0.0 else (fy - row)) * pace_y
        while at <= high:
            until = min(next_x, next_y)
            if 0 <= column < columns and 0 <= row < rows:
                here = row * columns + column
                if present[here] & wanted:
                    for k in range(starts[here], starts[here + 1]):
                        if not (wanted >> (items[k] & (SECTORS - 1))) & 1:
                            continue
                        wb = chains[items[k] >> SECTOR_BITS]
                        across = wb.dx * dy - wb.dy * dx
                        if wb.dx * bdx + wb.dy * bdy < least_cosine or abs(across) < MIN_CROSSING:
                            continue
                        slide = (wb.offset - wb.dx * y + wb.dy * x) / across
                        if slide < at or slide >= until or slide > high:
                            continue
                        if count == len(posed):
                            return w, -1
                        if lay_base(a, b, wa, wb, half_a, half_b, posed[count]):
                            count += 1
            at = until
            if next_x < next_y:
                column += step_x
                next_x += pace_x
            else:
                row += step_y
                next_y += pace_y
    return len(chains), count


@kernel
def lay_base(a: Record, b: Record, wa: Record, wb: Record, half_a: float, half_b: float, pose: Record) -> bool:
    """Write the pose that puts the midpoints of lines `a` and `b` on `wa` and `wb`, both turned as their angles allow.

    Return False where one of them sticks out at an end. The pose may turn about the middle between both.
    """
    gap = wrap(wb.angle - wa.angle - b.angle + a.angle)
    turn = gap * a.angle_variance / (a.angle_variance + b.angle_variance)
    theta = wa.angle - a.angle + turn
    c, s = math.cos(theta), math.sin(theta)
    det = wa.dx * wb.dy - wa.dy * wb.dx
    # n . t = p - n . R m for both, with n = (-d_y, d_x).
    ax, ay = c * a.x - s * a.y, s * a.x + c * a.y
    bx, by = c * b.x - s * b.y, s * b.x + c * b.y
    ra = wa.offset + wa.dy * ax - wa.dx * ay
    rb = wb.offset + wb.dy * bx - wb.dx * by
    tx = (ra * wb.dx - rb * wa.dx) / det
    ty = (ra * wb.dy - rb * wa.dy) / det
    along = wa.dx * (ax + tx) + wa.dy * (ay + ty)
    if along - half_a < wa.begin or along + half_a > wa.end:
        return False
    along = wb.dx * (bx + tx) + wb.dy * (by + ty)
    if along - half_b < wb.begin or along + half_b > wb.end:
        return False
    pose.theta, pose.cosine, pose.sine, pose.x, pose.y = theta, c, s, tx, ty
    pose.lever_x, pose.lever_y = 0.5 * (ax + bx), 0.5 * (ay + by)
    pose.angle_variance = a.angle_variance * b.angle_variance / (a.angle_variance + b.angle_variance)
    return True


@kernel
def slide_line(
    question: Question, sliding: int, sweep: Sweep, spacing: float, first: int, posed: Records
) -> tuple[int, int]:
    """Write the poses that lay one scan line on chains, `spacing` metres apart, from chain `first` on.

    Return the next chain, and how many; both as of `sweep_base`.
    """
    prior = question.terms[0].prior
    a = question.scan[sliding]
    chains, lengths = sweep.chains, sweep.lengths
    half = 0.5 * a.length - end_slack(a.length)
    count = 0
    for w in range(first, len(chains)):
        if lengths[w] < 2.0 * half:
            continue
        if 2 * count >= len(posed):
            return w, count
        chain = chains[w]
        theta = chain.angle - a.angle
        c, s = math.cos(theta), math.sin(theta)
        x, y = c * a.x - s * a.y, s * a.x + c * a.y
        low, high = chain.begin + half, chain.end - half
        if prior.kind == HARD_PRIOR:
            middle = chain.dx * (prior.x + x) + chain.dy * (prior.y + y)
            low = max(low, middle - prior.radius)
            high = min(high, middle + prior.radius)
            if low > high or abs(wrap(theta - prior.theta)) > prior.angle + WINDOW_TURN:
                continue
        number = max(1, math.ceil((high - low) / spacing))
        for k in range(number):
            if count == len(posed):
                return w, -1
            at = low + (k + 0.5) / number * (high - low)
            pose = posed[count]
            pose.theta, pose.cosine, pose.sine = theta, c, s
            pose.x = chain.dx * at - chain.dy * chain.offset - x
            pose.y = chain.dy * at + chain.dx * chain.offset - y
            pose.lever_x, pose.lever_y = x, y
            pose.angle_variance = a.angle_variance
            count += 1
    return len(chains), count


@kernel
def reject(
    question: Question, raster: Raster, gains: Floats, posed: Records, rule: Records, poses: Records, possible: Floats
) -> int:
    """Write those of the hypotheses that may reach the floor, as (k,) of `ESTIMATE`; return how many.

    A scan line counts only where the raster has a wall of its direction near its midpoint. The lines of the greatest
    gain come first, so that most hypotheses are rejected by a few. `gains` (n,) are the gains of the lines; those of 0
    are not looked up. `possible` gets by how much the gains that are left exceed the floor, nats.
    """
    scan, bits = question.scan, raster.bits
    gates, prior = question.terms[0].gates, question.terms[0].prior
    shape = raster.shape[0]
    per_cell, columns, rows = 1.0 / shape.cell, shape.columns, shape.rows
    n = len(scan)
    spreads = np.empty(n, np.float64)
    total = gains.sum()
    variance = -1.0
    least = max(rule[0].kept_fraction * rule[0].best_value, rule[0].least_value) + rule[0].least_freedom
    kept = 0
    for k in range(len(posed)):
        one = posed[k]
        if one.angle_variance != variance:  # the same for all hypotheses of a base
            variance = one.angle_variance
            for i in range(n):
                spreads[i] = GATE_MARGIN * angle_gate(scan[i], variance, gates) * PER_RADIAN
        bonus = 0.0
        if prior.kind == HARD_PRIOR:
            if not is_about(prior, one):
                continue
        else:
            bonus = prior_value(prior, one)
        spare = total - (least - bonus)  # what may be lost
        c, s = one.cosine, one.sine
        turned = (one.theta + math.pi) * PER_RADIAN + 0.5
        unfit = 0
        for i in range(n):
            if spare < 0.0:
                break
            if gains[i] <= 0.0:
                continue
            fx = (c * scan[i].x - s * scan[i].y + one.x - shape.x0) * per_cell
            fy = (s * scan[i].x + c * scan[i].y + one.y - shape.y0) * per_cell
            fits = False
            if fx >= 0.0 and fy >= 0.0 and fx < columns and fy < rows:
                wanted = sectors_about(turned + scan[i].angle * PER_RADIAN, spreads[i])
                fits = (bits[int(fy) * columns + int(fx)] & wanted) != 0
            if not fits:
                spare -= gains[i]
                unfit |= (1 << i) if i < MOST_NOTED else 0
        if spare < 0.0:
            continue
        pose, v, x, y = poses[kept], one.angle_variance, one.lever_x, one.lever_y
        pose.theta, pose.x, pose.y, pose.unfit = one.theta, one.x, one.y, unfit
        pose.xx, pose.xy, pose.yy = v * y * y, -v * x * y, v * x * x
        pose.xt, pose.yt, pose.tt = v * y, -v * x, v
        possible[kept] = spare
        kept += 1
    return kept
