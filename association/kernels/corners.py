"""Compiled proposals from the list of crossings: bases whose lines cross near both segments."""

import math

import numpy as np

from registration.compiling import kernel
from registration.layout import Record, Records

from ..layout import HARD_PRIOR, NOT_LISTED, Corner, Crossings, Integers, MapTables, Question, Workspace
from ..tuning import (
    CORNER_ANGLE_SLACK,
    CORNER_ROUNDING,
    CORNER_STEPS,
    COST_BASE,
    COST_HYPOTHESIS,
    CROSSING_BLOCK_SIZE,
    MIN_CROSSING,
    TESTS_BLOCK,
)
from .consensus import turning
from .matching import angle_spreads, wrap
from .proposing import base_pose, base_tolerance, end_slack, try_pose


@kernel
def corner_of(a: Record, b: Record, tolerance: float) -> Corner:
    """Return what a crossing has to be to fit a base; `b` is turned to the left of `a`, by `tolerance` more or less.

    Where the two segments lie along their lines depends on the angle g by which the lines are turned apart more than
    the segments: the midpoint of `a` at ``-D sin(turn - delta + k_b g) / sin(turn + g)`` from the crossing, that of `b`
    at ``D sin(delta + k_a g) / sin(turn + g)``, with their distance D and its direction delta from that of `a`. The
    extremes over all g are those of some steps, and what the derivative allows between these.
    """
    turn = wrap(b.angle - a.angle)
    least = math.asin(MIN_CROSSING) - CORNER_ROUNDING
    low = max(turn - CORNER_ANGLE_SLACK * tolerance, least)
    high = min(turn + CORNER_ANGLE_SLACK * tolerance, math.pi - least)
    x = b.x - a.x
    y = b.y - a.y
    distance = math.hypot(x, y)
    delta = math.atan2(y, x) - a.angle
    share = a.angle_variance / (a.angle_variance + b.angle_variance)
    first_low = math.inf
    first_high = -math.inf
    second_low = math.inf
    second_high = -math.inf
    for step in range(CORNER_STEPS + 1):
        angle = low + step * (high - low) / CORNER_STEPS
        g = angle - turn
        per_sine = distance / math.sin(angle)
        first = -math.sin(turn - delta + (1.0 - share) * g) * per_sine
        second = math.sin(delta + share * g) * per_sine
        first_low = min(first_low, first)
        first_high = max(first_high, first)
        second_low = min(second_low, second)
        second_high = max(second_high, second)
    sine = min(math.sin(low), math.sin(high))
    between = 0.5 * (high - low) / CORNER_STEPS * distance * (1.0 / sine + 1.0 / (sine * sine))
    slack = between + CORNER_ROUNDING * (1.0 + distance)
    half_a = 0.5 * a.length - end_slack(a.length) - slack
    half_b = 0.5 * b.length - end_slack(b.length) - slack
    return Corner(
        low - CORNER_ROUNDING,
        high + CORNER_ROUNDING,
        first_high - half_a,
        first_low + half_a,
        second_high - half_b,
        second_low + half_b,
    )


@kernel
def corner_reach(corner: Corner) -> float:
    """Return how far from one of its runs a crossing may be that fits, metres."""
    return max(corner.first_begin, -corner.first_end, corner.second_begin, -corner.second_end)


@kernel
def fitting(crossings: Crossings, corner: Corner, out: Integers) -> int:
    """Write which crossings fit to `out`, as many as it holds; return how many there are."""
    rows = crossings.rows
    blocks = crossings.blocks
    tops = crossings.tops
    size = CROSSING_BLOCK_SIZE
    low = corner.least_angle
    high = corner.greatest_angle
    first_begin = corner.first_begin
    first_end = corner.first_end
    second_begin = corner.second_begin
    second_end = corner.second_end
    room = len(out)
    count = 0
    for t in range(len(tops)):
        if (
            tops[t].greatest_angle < low
            or tops[t].least_angle > high
            or tops[t].first_begin > first_begin
            or tops[t].first_end < first_end
            or tops[t].second_begin > second_begin
            or tops[t].second_end < second_end
        ):
            continue
        for b in range(t * size, min(len(blocks), (t + 1) * size)):
            if (
                blocks[b].first_begin > first_begin
                or blocks[b].first_end < first_end
                or blocks[b].second_begin > second_begin
                or blocks[b].second_end < second_end
                or blocks[b].greatest_angle < low
                or blocks[b].least_angle > high
            ):
                continue
            for k in range(b * size, min(len(rows), (b + 1) * size)):
                if (
                    rows[k].first_begin <= first_begin
                    and rows[k].first_end >= first_end
                    and rows[k].second_begin <= second_begin
                    and rows[k].second_end >= second_end
                    and low <= rows[k].angle <= high
                ):
                    if count < room:
                        out[count] = k
                    count += 1
    return count


@kernel
def count_fits(question: Question, crossings: Crossings, base: Record) -> None:
    """Count the crossings that may fit a base, where all of those are listed: then its cost is known.

    A window prunes walls and slides before there is a hypothesis: with one no base goes by the list.
    """
    base.fits = NOT_LISTED
    if question.terms[0].prior.kind == HARD_PRIOR or len(crossings.rows) == 0:
        return
    gates = question.terms[0].gates
    a = question.scan[base.sliding]
    b = question.scan[base.crossing]
    if math.sin(b.angle - a.angle) < 0.0:
        a, b = b, a
    corner = corner_of(a, b, base_tolerance(a, b, gates))
    if corner_reach(corner) <= crossings.reach:
        base.fits = fitting(crossings, corner, np.empty(0, dtype=np.int32))
        base.cost = COST_BASE + COST_HYPOTHESIS * base.fits


@kernel
def search_corner(
    question: Question, tables: MapTables, base: Record, found: Records, progress: Record, work: Workspace, budget: int
) -> int:
    """Go through all crossings that fit a base, as `search_base` goes through the runs: the same poses come of it.

    Goes on from the crossing where `progress` stands as its anchor, and stops when `budget` tests are used up. Returns
    the tests that it took; the anchor is back at 0 when the base is done.
    """
    rows = tables.crossings.rows
    runs = tables.sweep.runs
    gates = question.terms[0].gates
    pose = work.scratch[0].estimate
    a = question.scan[base.sliding]
    b = question.scan[base.crossing]
    if math.sin(b.angle - a.angle) < 0.0:
        a, b = b, a
    tolerance = base_tolerance(a, b, gates)
    least_cosine = 1.0 - 0.5 * tolerance * tolerance
    turn = wrap(b.angle - a.angle)
    theta_var = a.angle_variance * b.angle_variance / (a.angle_variance + b.angle_variance)
    angle_spreads(question.scan, theta_var, gates, work.spreads)
    pin_x = 0.5 * (a.x + b.x)
    pin_y = 0.5 * (a.y + b.y)
    fits = np.empty(base.fits, dtype=np.int32)
    count = fitting(tables.crossings, corner_of(a, b, tolerance), fits)
    spent = 1 + TESTS_BLOCK * len(tables.crossings.tops)
    for k in range(progress.anchor, count):
        here = fits[k]
        wa = runs[rows[here].first]
        wb = runs[rows[here].second]
        spent += 1
        if math.cos(wb.angle - wa.angle - turn) >= least_cosine and base_pose(a, b, wa, wb, pose):
            c = math.cos(pose.theta)
            s = math.sin(pose.theta)
            turning(theta_var, c * pin_x - s * pin_y, s * pin_x + c * pin_y, pose)
            spent += try_pose(question, tables.place, tables.raster, found, progress, work)
        if spent > budget and k + 1 < count:
            progress.anchor = k + 1
            return spent
    progress.anchor = 0
    progress.bases += 1
    return spent
