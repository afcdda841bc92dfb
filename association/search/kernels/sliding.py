"""Compiled hypotheses of parallel segments, which make no base: laid on every wall chain, and free along it."""

import math

import numpy as np

from compiled import kernel
from registration.layout import Floats, Record, Records

from ...consensus.kernels.geometry import wrap
from ...consensus.kernels.raster import gates_about
from ...layout import HARD_PRIOR, Integers
from ...tables import MapTables, Question, Workspace
from ..tables import SearchState
from ..tuning import BASE_SEGMENTS, MIN_CROSSING_BASE, PARALLEL_SINE, WINDOW_TURN
from .bases import is_telling, middle_of
from .scoring import score_hypotheses
from .sweeping import anchors, end_slack


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
    question: Question, tables: MapTables, sliding: int, state: SearchState, work: Workspace, spacing: float
) -> bool:
    """Lay scan segment `sliding` on every chain that is long enough, at slides `spacing` metres apart; score each.

    The result is a family of poses, fixed across the walls and free along them. Segments that make a base with this
    one do not count: the others have to be enough by themselves. Returns False if the search has to end before the last
    slide.
    """
    chains = tables.sweep.chains
    prior = question.terms[0].prior
    a = question.scan[sliding]
    figure = work.scratch[0].figure
    figure.angle_variance = a.angle_variance
    figure.pin_x = a.x
    figure.pin_y = a.y
    figure.slip = 0.0
    gates_about(question.scan, figure, question.terms[0].gates, work.spreads, work.shifts, work.later)
    leave_out_bases(question.scan, sliding, work.shifts, work.later)
    anchor_list = np.empty(len(chains), np.int32)
    n_anchors = anchors(a.length, tables.sweep.lengths, anchor_list)
    n = int(np.int64(0))
    for k in range(n_anchors):
        chain = chains[anchor_list[k]]
        low, high, count = slides_on(chain, a, prior, spacing)
        for j in range(count):
            pose_slide(chain, a, low + (j + 0.5) / count * (high - low), work.hypotheses[n])
            n += 1
            if n == len(work.hypotheses):
                if not score_hypotheses(question, tables, n, state, work):
                    return False
                n = 0
    return score_hypotheses(question, tables, n, state, work)


@kernel
def slides_on(chain: Record, a: Record, prior: Record, spacing: float) -> tuple[float, float, int]:
    """Return between which abscissae the midpoint of a segment slides on a chain, and the number of slides there.

    That is 0 outside the window of a hard prior.
    """
    half = 0.5 * a.length - end_slack(a.length)
    low = chain.begin + half
    high = chain.end - half
    if prior.kind == HARD_PRIOR:
        theta = chain.angle - a.angle
        c = math.cos(theta)
        s = math.sin(theta)
        gx = c * a.x - s * a.y
        gy = s * a.x + c * a.y
        middle = chain.dx * (prior.x + gx) + chain.dy * (prior.y + gy)
        low = max(low, middle - prior.radius)
        high = min(high, middle + prior.radius)
        if low > high or abs(wrap(theta - prior.theta)) > prior.angle + WINDOW_TURN:
            return low, high, 0
    return low, high, max(1, math.ceil((high - low) / spacing))


@kernel
def pose_slide(chain: Record, a: Record, slide: float, one: Record) -> None:
    """Write the hypothesis that puts the midpoint of a segment at an abscissa of a chain."""
    theta = chain.angle - a.angle
    c = math.cos(theta)
    s = math.sin(theta)
    gx = c * a.x - s * a.y
    gy = s * a.x + c * a.y
    one.theta = theta
    one.cosine = c
    one.sine = s
    one.x = chain.dx * slide - chain.dy * chain.offset - gx
    one.y = chain.dy * slide + chain.dx * chain.offset - gy
    one.lever_x = gx
    one.lever_y = gy
    one.angle_variance = a.angle_variance
