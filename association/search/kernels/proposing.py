"""Compiled proposals: from bases of two scan segments to poses."""

import math

import numpy as np

from compiled import kernel
from registration.layout import Record, Records

from ...consensus.kernels.matching import gates_about, wrap
from ...layout import HARD_PRIOR, LAID, LISTED, MET, SWEPT
from ...tables import MapTables, Question, Workspace
from ...tuning import AT_ONCE, MOST_LISTS, TESTS_ANCHOR, TESTS_BASE
from .looking_up import look_up, on_crossings
from .sweeping import anchors, end_slack, lay, measure, meet, sweep, where_crossed
from .trying import is_about, try_poses

LITTLE = 0.3  # rad; up to there the series that are used are exact to rounding


@kernel
def turn_a_little(c: float, s: float, angle: float) -> tuple[float, float]:
    """Return the cosine and sine of what is turned by a further angle, to rounding.

    By their series: they are taken for each two walls that cross, and a library's were 6 % of an answer on 2,000 walls.
    """
    if abs(angle) > LITTLE:
        cosine = math.cos(angle)
        sine = math.sin(angle)
    else:
        z = angle * angle
        cosine = 1.0 - z * (1 / 2 - z * (1 / 24 - z * (1 / 720 - z * (1 / 40320 - z * (1 / 3628800)))))
        sine = angle * (1.0 - z * (1 / 6 - z * (1 / 120 - z * (1 / 5040 - z * (1 / 362880 - z * (1 / 39916800))))))
    return c * cosine - s * sine, s * cosine + c * sine


@kernel
def base_pose(a: Record, b: Record, wa: Record, wb: Record, pose: Record) -> bool:
    """Write the pose that puts the midpoints of `a` and `b` on the lines `wa` and `wb`.

    Splits the misfit of the angles by their variances. Returns whether both segments then lie within the ends of their
    lines, up to their slack.
    """
    gap = wrap(wb.angle - wa.angle - b.angle + a.angle)
    turn = gap * a.angle_variance / (a.angle_variance + b.angle_variance)
    c, s = turn_a_little(wa.dx * a.dx + wa.dy * a.dy, wa.dy * a.dx - wa.dx * a.dy, turn)
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
    pose.theta = wa.angle - a.angle + turn
    pose.cosine = c
    pose.sine = s
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
def pose_crossings(
    a: Record, b: Record, laid: Records, swept: Records, met: Records, count: int, runs: Records, work: Workspace
) -> int:
    """Write the poses that put a and b on runs, of the first `count` that were met, to be tried; return how many.

    ``anchor`` of each is counted from the first that is laid.
    """
    figure = work.scratch[0].figure
    posed = work.posed
    hits = where_crossed(figure, laid, swept, met, count, runs)
    n = 0
    for k in range(hits):
        crossing = met[met[k].hit]
        cell = swept[crossing.cell]
        wa = runs[laid[cell.laid].run]
        one = posed[n]
        if base_pose(a, b, wa, runs[crossing.run], one):
            c = wa.dx * a.dx + wa.dy * a.dy
            s = wa.dy * a.dx - wa.dx * a.dy
            one.lever_x = c * figure.pin_x - s * figure.pin_y
            one.lever_y = s * figure.pin_x + c * figure.pin_y
            one.anchor = cell.laid
            one.step = cell.step
            one.angle_variance = figure.angle_variance
            one.entry = crossing.entry + 1
            n += 1
    return n


@kernel
def stand_behind(swept: Records, met: Records, last: int, begin: int, progress: Record) -> None:
    """Put `progress` behind a run that was met; `begin` is the anchor of the first that is laid."""
    cell = swept[met[last].cell]
    progress.anchor = begin + cell.laid
    progress.step = cell.step
    progress.entry = met[last].entry + 1


@kernel
def pose_listed(
    a: Record, b: Record, met: Records, count: int, prior: Record, runs: Records, crossings: Records, work: Workspace
) -> int:
    """Write the poses that put a and b on the runs of the first `count` crossings that were met; return how many."""
    figure = work.scratch[0].figure
    posed = work.posed
    least_cos = 1.0 - 0.5 * figure.tolerance * figure.tolerance
    n = 0
    for k in range(count):
        crossing = crossings[met[k].run]
        wa = runs[crossing.first]
        wb = runs[crossing.second]
        one = posed[n]
        c = wa.dx * a.dx + wa.dy * a.dy
        s = wa.dy * a.dx - wa.dx * a.dy
        if wb.dx * (c * b.dx - s * b.dy) + wb.dy * (s * b.dx + c * b.dy) < least_cos:
            continue
        if base_pose(a, b, wa, wb, one) and (prior.kind != HARD_PRIOR or is_about(prior, one)):
            one.lever_x = c * figure.pin_x - s * figure.pin_y
            one.lever_y = s * figure.pin_x + c * figure.pin_y
            one.anchor = 0
            one.step = 0
            one.angle_variance = figure.angle_variance
            one.entry = met[k].entry
            n += 1
    return n


@kernel
def sweep_base(
    question: Question,
    tables: MapTables,
    base: Record,
    found: Records,
    progress: Record,
    work: Workspace,
    budget: int,
) -> int:
    """Go through all pairs of runs that fit a base of two scan segments a, which slides, and b.

    A run under a fixes the rotation and leaves one slide; the grid is walked along what the midpoint of b then sweeps.
    Goes on from the anchor where `progress` stands, in the cell of its step, at the entry of its list, and stops when
    `budget` tests are used up, within a cell, too. Returns the tests that it took; `progress` is back at the first
    anchor when the base is done.
    """
    runs = tables.sweep.runs
    sectors = tables.sweep.sectors
    present = tables.sweep.present
    prior = question.terms[0].prior
    gates = question.terms[0].gates
    figure = work.scratch[0].figure
    a = question.scan[base.sliding]
    b = question.scan[base.crossing]
    measure(a, b, gates, figure)
    gates_about(question.scan, figure, gates, work.spreads, work.shifts, work.later)
    anchor_list = np.empty(len(runs), np.int32)
    n_anchors = anchors(a.length, tables.sweep.lengths, anchor_list)
    laid = np.empty(AT_ONCE, LAID)
    swept = np.empty(AT_ONCE, SWEPT)
    met = np.empty(AT_ONCE, MET)
    spent = TESTS_BASE
    while progress.anchor < n_anchors:
        begin = progress.anchor
        end = min(begin + AT_ONCE, n_anchors)
        lay(figure, a, b, prior, runs, sectors.shape[0], anchor_list[begin:end], laid)
        spent += TESTS_ANCHOR * (end - begin)
        first_step = progress.step
        first_entry = progress.entry
        run = 0
        while run < end - begin:
            run, cells = sweep(laid, run, end - begin, present, sectors.shape[0], first_step, swept)
            cell = 0
            resumed = cells > 0 and swept[0].laid == 0 and swept[0].step == first_step
            entry = first_entry if resumed else 0
            while cell < cells:
                cell, entry, crossings = meet(laid, swept, cell, entry, cells, sectors, met)
                poses = pose_crossings(a, b, laid, swept, met, crossings, runs, work)
                left = budget - spent - crossings
                cost, stopped = try_poses(question, tables, poses, found, progress, work, left)
                spent += crossings + cost
                if stopped:
                    progress.anchor += begin
                    return spent
                if spent > budget and crossings > 0:
                    stand_behind(swept, met, crossings - 1, begin, progress)
                    return spent
        progress.anchor = end
        progress.step = 0
        progress.entry = 0
        if spent > budget and end < n_anchors:
            return spent
    progress.anchor = 0
    progress.bases += 1
    return spent


@kernel
def search_listed(
    question: Question,
    tables: MapTables,
    base: Record,
    found: Records,
    progress: Record,
    work: Workspace,
    budget: int,
) -> int:
    """Do as `sweep_base` where the crossings are listed on which a base may lie, b being to the left of a.

    Goes on from the entry of all lists where `progress` stands.
    """
    figure = work.scratch[0].figure
    runs = tables.sweep.runs
    crossings = tables.crossings.entries
    gates = question.terms[0].gates
    prior = question.terms[0].prior
    a = question.scan[base.sliding]
    b = question.scan[base.crossing]
    measure(a, b, gates, figure)
    lists = np.empty(MOST_LISTS, LISTED)
    met = np.empty(AT_ONCE, MET)
    count, entries = look_up(figure, tables.crossings, lists)
    spent = TESTS_BASE
    gated = False
    while progress.entry < entries:
        at, n = on_crossings(figure, tables.crossings, runs, lists, count, progress.entry, met)
        spent += (at - progress.entry) // 4
        poses = pose_listed(a, b, met, n, prior, runs, crossings, work)
        if poses > 0:
            if not gated:
                gated = True
                gates_about(question.scan, figure, gates, work.spreads, work.shifts, work.later)
            cost, stopped = try_poses(question, tables, poses, found, progress, work, budget - spent)
            spent += cost
            if stopped:
                return spent
        progress.entry = at
        if spent > budget and at < entries:
            return spent
    progress.entry = 0
    progress.bases += 1
    return spent


@kernel
def search_base(
    question: Question,
    tables: MapTables,
    base: Record,
    found: Records,
    progress: Record,
    work: Workspace,
    budget: int,
) -> int:
    """Go through all pairs of runs that fit a base, by the lists of crossings or else by sweeping; see `sweep_base`."""
    if base.listed >= 0:
        return search_listed(question, tables, base, found, progress, work, budget)
    return sweep_base(question, tables, base, found, progress, work, budget)
