"""Compiled proposals of scans without a base: parallel segments laid on every run; what is found is free along them."""

import math

import numpy as np

from compiled import kernel
from registration.layout import Floats, Records

from ...consensus.kernels.matching import gates_about, wrap
from ...layout import HARD_PRIOR, Integers
from ...tables import MapTables, Question, Workspace
from ...tuning import BASE_SEGMENTS, MIN_CROSSING_BASE, PARALLEL_SINE, WINDOW_TURN
from .planning import is_telling, middle_of
from .sweeping import anchors, end_slack
from .trying import try_poses


@kernel
def sliding_segments(scan: Records, count: int, floor: float, most: int) -> Integers:
    """Pick from the first `count` the two longest segments of each class of parallel ones that may explain more.

    More than `floor` nats, with all that are parallel to them; at most `most`.
    """
    chosen = np.empty(most, np.int64)
    n = 0
    for i in range(count):
        if n == most:
            break
        gain = 0.0
        for j in range(len(scan)):
            if abs(scan[i].dx * scan[j].dy - scan[i].dy * scan[j].dx) < PARALLEL_SINE:
                gain += scan[j].gain
        before = 0
        for k in range(n):
            j = chosen[k]
            before += abs(scan[i].dx * scan[j].dy - scan[i].dy * scan[j].dx) < PARALLEL_SINE
        if gain > floor and before < 2:
            chosen[n] = i
            n += 1
    return chosen[:n]


@kernel
def leave_out_bases(scan: Records, sliding: int, shifts: Integers, later: Floats) -> None:
    """Mark the segments for `may_score` that make a base with another one, as not to be looked up.

    A pose to which one of them counts is one of that base.
    """
    middle = middle_of(scan)
    a = scan[sliding]
    after = 0.0
    for i in range(len(scan) - 1, -1, -1):
        later[i] = after
        b = scan[i]
        crossing = abs(a.dx * b.dy - a.dy * b.dx) >= MIN_CROSSING_BASE
        if crossing and i < BASE_SEGMENTS and is_telling(a, b, middle):
            shifts[i] = -1
        else:
            after += b.gain


@kernel
def search_slides(
    question: Question,
    tables: MapTables,
    sliding: int,
    found: Records,
    progress: Records,
    work: Workspace,
    spacing: float,
    budget: int,
) -> bool:
    """Lay scan segment `sliding` on every run that is long enough, at slides `spacing` metres apart; keep the best.

    For scans without a base: what is found is a family of poses, fixed across the walls and free along them. What makes
    a base with the segment has been looked for so, and what does not has to be enough by itself. Goes on from the
    anchor and the step of `progress` (1,), and returns False when `budget` tests are used up before the end.
    """
    state = progress[0]
    runs = tables.sweep.runs
    prior = question.terms[0].prior
    posed = work.posed
    a = question.scan[sliding]
    variance = a.angle_variance
    figure = work.scratch[0].figure
    figure.angle_variance = variance
    figure.pin_x = a.x
    figure.pin_y = a.y
    figure.slip = 0.0
    gates_about(question.scan, figure, question.terms[0].gates, work.spreads, work.shifts, work.later)
    leave_out_bases(question.scan, sliding, work.shifts, work.later)
    anchor_list = np.empty(len(runs), np.int32)
    n_anchors = anchors(a.length, tables.sweep.lengths, anchor_list)
    left = budget
    n = 0
    for anchor in range(state.anchor, n_anchors):
        w = anchor_list[anchor]
        wall = runs[w]
        first = state.step
        state.step = 0
        half = 0.5 * a.length - end_slack(a.length)
        low = wall.begin + half
        high = wall.end - half
        theta = wall.angle - a.angle
        c = math.cos(theta)
        s = math.sin(theta)
        gx = c * a.x - s * a.y
        gy = s * a.x + c * a.y
        if prior.kind == HARD_PRIOR:
            middle = wall.dx * (prior.x + gx) + wall.dy * (prior.y + gy)
            low = max(low, middle - prior.radius)
            high = min(high, middle + prior.radius)
            if low > high or abs(wrap(theta - prior.theta)) > prior.angle + WINDOW_TURN:
                continue
        steps = max(1, math.ceil((high - low) / spacing))
        for j in range(first, steps):
            slide = low + (j + 0.5) / steps * (high - low)
            one = posed[n]
            one.theta = theta
            one.cosine = c
            one.sine = s
            one.x = wall.dx * slide - wall.dy * wall.offset - gx
            one.y = wall.dy * slide + wall.dx * wall.offset - gy
            one.lever_x = gx
            one.lever_y = gy
            one.angle_variance = variance
            one.anchor = anchor
            one.step = j + 1
            one.entry = 0
            n += 1
            if n == len(posed):
                cost, stopped = try_poses(question, tables, n, found, state, work, left)
                if stopped:
                    return False
                left -= cost
                n = 0
    return not try_poses(question, tables, n, found, state, work, left)[1]
