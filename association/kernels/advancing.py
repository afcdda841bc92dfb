"""Compiled main loop of the search: base after base, or some of them ahead of their turn."""

import math

import numpy as np

from registration.compiling import borrowed, kernel
from registration.layout import Record, Records

from ..layout import TRIED
from ..planning_tables import Plan
from ..tables import MapTables, Question, Workspace
from .planning import is_telling, middle_of, next_base
from .proposing import search_base
from .stopping import (
    cover,
    drawn_chance,
    fewest_segments,
    gain_beyond,
    least_freedom,
    missed_sets,
    needed_of,
    strike,
)
from .trying import keep_tried

# Why `advance` came back.
BUDGET, EXHAUSTED, PROVEN, CONFIDENT = range(4)


@kernel
def advance(
    question: Question,
    tables: MapTables,
    plan: Plan,
    found: Records,
    progress: Records,
    work: Workspace,
    allowed: float,
    budget: int,
) -> int:
    """Go through bases, the best first, until nothing better can have been missed or `budget` tests are used up.

    `allowed` is the greatest chance of having missed a better consensus set, -1 to go through all bases; `progress`
    (1,) keeps that chance up to date, or says that it is greater than that: see `missed_share`. Returns one of
    `BUDGET`, `EXHAUSTED`, `PROVEN`, `CONFIDENT`.
    """
    question = borrowed(question)
    tables = borrowed(tables)
    plan = borrowed(plan)
    found = borrowed(found)
    progress = borrowed(progress)
    work = borrowed(work)
    state = progress[0]
    nothing = np.empty(0, dtype=TRIED)
    spent = 0
    while True:
        if state.current < 0:
            state.current = next_base(question, plan)
            if state.current < 0:
                return EXHAUSTED
        base = plan.bases[state.current]
        spent += search_base(question, tables, base, found, nothing, state, work, budget - spent)
        if state.anchor > 0 or state.step > 0 or state.entry > 0:
            return BUDGET
        why = after_base(question, plan, state, allowed)
        if why != BUDGET:
            return why
        if spent > budget:
            return BUDGET


@kernel
def after_base(question: Question, plan: Plan, state: Record, allowed: float) -> int:
    """Note that the current base was gone through; tell why the search may end, `BUDGET` where it may not."""
    scan = question.scan
    rules = question.rules[0]
    base = plan.bases[state.current]
    state.current = -1
    state.least_freedom = least_freedom(scan, plan.freest, rules.kept_share * state.best_value)
    needed = needed_of(question, plan, state.best_value)
    a = base.sliding
    b = base.crossing
    if is_telling(scan[a], scan[b], middle_of(scan)):
        count = len(plan.samples.found)
        beyond = gain_beyond(scan, plan)
        state.bound -= cover(plan.residual, a, b)
        fewest = fewest_segments(plan.best_gains, beyond, needed)
        if plan.random:
            state.missed *= 1.0 - drawn_chance(fewest, len(plan.best_gains))
        else:
            strike(plan.samples, a, b)
            # It need not be known by how much too many are left.
            most = math.floor(allowed * count) if allowed >= 0.0 else -1
            state.missed = missed_sets(scan, plan.samples, fewest, needed - beyond, most) / count
    if state.best_value >= rules.enough:
        return CONFIDENT
    if allowed >= 0.0:
        if state.bound < needed:
            return PROVEN
        if state.missed <= allowed:
            return CONFIDENT
    return BUDGET


@kernel
def merge(
    question: Question,
    plan: Plan,
    tried: Records,
    ahead: Records,
    found: Records,
    progress: Records,
    work: Workspace,
    allowed: float,
) -> int:
    """Take over what was found in a base ahead of its turn, which has come; return as `after_base` does.

    `found` and `progress` are then what they would be if the base had been gone through now.
    """
    question = borrowed(question)
    plan = borrowed(plan)
    tried = borrowed(tried)
    found = borrowed(found)
    work = borrowed(work)
    state = progress[0]
    state.hypotheses += ahead[0].hypotheses
    state.bases += 1
    state.current = ahead[0].current
    state.anchor = 0
    state.step = 0
    state.entry = 0
    keep_tried(question, tried, found, state, work)
    return after_base(question, plan, state, allowed)
