"""Compiled hypotheses: from a base of two scan segments to the poses that it allows."""

import math

import numpy as np

from compiled import kernel
from registration.layout import Record, Records

from ...consensus.kernels.geometry import wrap
from ...consensus.kernels.raster import gates_about
from ...layout import HARD_PRIOR
from ...tables import MapTables, Question, Workspace
from ...tuning import AT_ONCE
from ..layout import LAID, LISTED, MET, SWEPT
from ..tables import SearchState, Sweeps
from ..tuning import MOST_LISTS
from .lookup import look_up, on_crossings
from .scoring import is_about, score_hypotheses
from .sweeping import anchors, end_slack, lay, measure, meet, sweep, where_crossed

LITTLE = 0.3  # rad; up to there the series that are used are exact to rounding


@kernel
def search_base(question: Question, tables: MapTables, base: Record, state: SearchState, work: Workspace) -> bool:
    """Score the hypotheses of a base: for all pairs of wall chains that it may lie on.

    By the lists of crossings where they hold all that matter, else by sweeping. Returns False if the search has to end
    before the last hypothesis.
    """
    if state.stop[0] != 0:
        return False
    measure(question.scan[base.sliding], question.scan[base.crossing], question.terms[0].gates, work.scratch[0].figure)
    if base.listed >= 0:
        return search_listed(question, tables, base, state, work)
    return sweep_base(question, tables, base, state, work)


@kernel
def search_listed(question: Question, tables: MapTables, base: Record, state: SearchState, work: Workspace) -> bool:
    """Score the hypotheses of a base on the crossings that are listed, b being to the left of a."""
    figure = work.scratch[0].figure
    chains = tables.sweep.chains
    lists = np.empty(MOST_LISTS, LISTED)
    met = np.empty(AT_ONCE, MET)
    count, entries = look_up(figure, tables.crossings, lists)
    stop = state.stop
    at = int(np.int64(0))
    gated = False
    goes_on = True
    while goes_on and at < entries:
        at, n = on_crossings(figure, tables.crossings, chains, lists, count, at, met)
        n = pose_listed(question, base, met, n, tables, work)
        if n > 0 and not gated:
            gates_about(question.scan, figure, question.terms[0].gates, work.spreads, work.shifts, work.later)
            gated = True
        goes_on = stop[0] == 0 and (n == 0 or score_hypotheses(question, tables, n, state, work))
    return goes_on


@kernel
def sweep_base(question: Question, tables: MapTables, base: Record, state: SearchState, work: Workspace) -> bool:
    """Score the hypotheses of a base of the scan segments a, which slides along wall chains, and b.

    A chain under a fixes the rotation and leaves one slide; the grid is walked along what the midpoint of b then
    sweeps.
    """
    figure = work.scratch[0].figure
    chains = tables.sweep.chains
    terms = question.terms[0]
    a = question.scan[base.sliding]
    b = question.scan[base.crossing]
    gates_about(question.scan, figure, terms.gates, work.spreads, work.shifts, work.later)
    anchor_list = np.empty(len(chains), np.int32)
    n_anchors = anchors(a.length, tables.sweep.lengths, anchor_list)
    sweeps = Sweeps(np.empty(AT_ONCE, LAID), np.empty(AT_ONCE, SWEPT), np.empty(AT_ONCE, MET))
    shape = tables.sweep.sectors.shape
    for begin in range(0, n_anchors, AT_ONCE):
        end = min(begin + AT_ONCE, n_anchors)
        lay(figure, a, b, terms.prior, chains, shape[0], anchor_list[begin:end], sweeps.laid)
        if not sweep_laid(question, tables, base, end - begin, sweeps, state, work):
            return False
    return True


@kernel
def sweep_laid(
    question: Question, tables: MapTables, base: Record, count: int, sweeps: Sweeps, state: SearchState, work: Workspace
) -> bool:
    """Score the hypotheses of a base with its first segment on the first `count` chains that it is laid on."""
    sectors = tables.sweep.sectors
    laid = sweeps.laid
    swept = sweeps.swept
    met = sweeps.met
    stop = state.stop
    chain = int(np.int64(0))
    while chain < count:
        chain, cells = sweep(laid, chain, count, tables.sweep.present, sectors.shape[0], swept)
        cell = int(np.int64(0))
        entry = int(np.int64(0))
        while cell < cells:
            if stop[0] != 0:
                return False
            cell, entry, crossings = meet(laid, swept, cell, entry, cells, sectors, met)
            n = pose_crossings(question, base, sweeps, crossings, tables.sweep.chains, work)
            if not score_hypotheses(question, tables, n, state, work):
                return False
    return stop[0] == 0


@kernel
def pose_listed(question: Question, base: Record, met: Records, count: int, tables: MapTables, work: Workspace) -> int:
    """Write the hypotheses on the chains of the first `count` crossings that were met; return how many."""
    figure = work.scratch[0].figure
    hypotheses = work.hypotheses
    chains = tables.sweep.chains
    crossings = tables.crossings.entries
    prior = question.terms[0].prior
    a = question.scan[base.sliding]
    b = question.scan[base.crossing]
    least_cos = 1.0 - 0.5 * figure.tolerance * figure.tolerance
    n = 0
    for k in range(count):
        crossing = crossings[met[k].number]
        wa = chains[crossing.first]
        wb = chains[crossing.second]
        one = hypotheses[n]
        c = wa.dx * a.dx + wa.dy * a.dy
        s = wa.dy * a.dx - wa.dx * a.dy
        if wb.dx * (c * b.dx - s * b.dy) + wb.dy * (s * b.dx + c * b.dy) < least_cos:
            continue
        if base_pose(a, b, wa, wb, one) and (prior.kind != HARD_PRIOR or is_about(prior, one)):
            pin(one, c, s, figure)
            n += 1
    return n


@kernel
def pose_crossings(
    question: Question, base: Record, sweeps: Sweeps, count: int, chains: Records, work: Workspace
) -> int:
    """Write the hypotheses on the first `count` chains that were met in a sweep; return how many."""
    figure = work.scratch[0].figure
    hypotheses = work.hypotheses
    laid = sweeps.laid
    swept = sweeps.swept
    met = sweeps.met
    a = question.scan[base.sliding]
    b = question.scan[base.crossing]
    hits = where_crossed(figure, laid, swept, met, count, chains)
    n = 0
    for k in range(hits):
        crossing = met[met[k].hit]
        wa = chains[laid[swept[crossing.cell].laid].chain]
        one = hypotheses[n]
        if base_pose(a, b, wa, chains[crossing.number], one):
            pin(one, wa.dx * a.dx + wa.dy * a.dy, wa.dy * a.dx - wa.dx * a.dy, figure)
            n += 1
    return n


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
def turn_a_little(c: float, s: float, angle: float) -> tuple[float, float]:
    """Return the cosine and sine of a direction that is rotated by a further angle, to rounding.

    By their series: they are needed for each two chains that cross, and a library's were 6 % of an answer on 2,000
    walls.
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
def pin(one: Record, c: float, s: float, figure: Record) -> None:
    """Write the point about which a hypothesis may turn, with the cosine and sine of a rotation, and the variance."""
    one.lever_x = c * figure.pin_x - s * figure.pin_y
    one.lever_y = s * figure.pin_x + c * figure.pin_y
    one.angle_variance = figure.angle_variance
