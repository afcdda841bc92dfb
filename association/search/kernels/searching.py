"""Compiled search from its plan to what it found, in one call where the budget lets it."""

import numpy as np

from compiled import kernel
from registration.kernels import keep_alive
from registration.layout import Records

from ...consensus.kernels.ordering import ascending
from ...layout import FOUND
from ...tables import MapTables, Question, Workspace
from ...tuning import BASE_SEGMENTS, SLIDE_SEGMENTS
from ..planning_tables import Plan, Planning
from .advancing import BUDGET, EXHAUSTED, advance
from .planning import begin
from .sliding import search_slides, sliding_segments
from .stopping import missed_share


@kernel
def search(
    question: Question,
    tables: MapTables,
    planning: Planning,
    found: Records,
    progress: Records,
    work: Workspace,
    how: Records,
) -> tuple[int, Plan | None]:
    """Plan a search, go through its bases as `advance` does, and then `finish` it; `how` (1,) of `HOW`.

    ``rules`` of the question (2,) are those of bases and of slides. Returns why the bases were left, and the plan where
    the budget ended them or the slides, to `go_on` with; else None: a plan is thirty arrays, which take long to hand to
    Python and back.
    """
    plan = begin(question, tables, planning, progress)
    why = EXHAUSTED
    if len(plan.bases) == 0:
        progress[0].missed = 0.0  # walls of which no two cross are slid
    else:
        of_bases = found[: how[0].kept]
        why = advance(question, tables, plan, of_bases, progress, work, how)
        if why == BUDGET:
            return why, plan
        if why == EXHAUSTED and not plan.random:
            progress[0].missed = missed_share(question, plan, progress)
    progress[0].left = 1
    finish(question, tables, found, progress, work, how)
    if progress[0].done == 0:
        return why, plan
    return why, None


@kernel
def go_on(
    question: Question,
    tables: MapTables,
    plan: Plan,
    found: Records,
    progress: Records,
    work: Workspace,
    how: Records,
) -> int:
    """Go on with a search where `progress` stands, with its bases or, once these are ``left``, to `finish` it.

    Returns as `advance` does. Both in one kernel, for each that goes through bases takes seconds to compile.
    """
    if progress[0].left == 0:
        return advance(question, tables, plan, found[: how[0].kept], progress, work, how)
    finish(question, tables, found, progress, work, how)
    return BUDGET if progress[0].done == 0 else EXHAUSTED


@kernel
def finish(
    question: Question, tables: MapTables, found: Records, progress: Records, work: Workspace, how: Records
) -> None:
    """Lay the longest of parallel segments on every run, once the bases are left, and put what was found in order.

    Parallel walls alone, as in a corridor, fix the pose across them: no base shows it, yet it may explain more. Goes on
    where `progress` stands, and stops when ``budget`` tests are used up for one of the segments: it is not ``done``
    then.
    """
    state = progress[0]
    limits = how[0]
    if state.sliding < 0:
        state.sliding = 0
        state.floor = limits.share * state.best_value
        state.of_bases = state.count
        state.count = 0
        state.anchor = 0
        state.step = 0
    scan = question.scan
    slides = Question(scan, question.terms, question.rules[1:])
    most = SLIDE_SEGMENTS
    segments = sliding_segments(scan, min(len(scan), BASE_SEGMENTS), state.floor, most)
    while state.sliding < len(segments):
        a = segments[state.sliding]
        if not search_slides(slides, tables, a, found[limits.kept :], progress, work, limits.spacing, limits.budget):
            return
        state.sliding += 1
        state.anchor = 0
        state.step = 0
    put_in_order(found, progress, how)


@kernel
def put_in_order(found: Records, progress: Records, how: Records) -> None:
    """Put the poses of bases and of slides together, the best first, ties as they were found; ``count`` of them."""
    state = progress[0]
    if state.sliding < 0:
        state.of_bases = state.count
        state.count = 0
    n = state.of_bases + state.count
    losses = np.empty(n, np.float64)
    together = np.empty(n, FOUND)
    for k in range(n):
        together[k] = found[k if k < state.of_bases else how[0].kept + k - state.of_bases]
        losses[k] = -together[k].value
    order = ascending(losses)
    for k in range(n):
        found[k] = together[order[k]]
    keep_alive(together)
    state.count = n
    state.done = 1
