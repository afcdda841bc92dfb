"""Compiled main loop of the search: propose and score the poses of a base, then ask the stopping rule."""

import math

from compiled import kernel
from registration.layout import Record, Records

from ...tables import MapTables, Question, Workspace
from ..planning_tables import Plan
from .planning import is_telling, middle_of, next_base
from .proposing import search_base
from .stopping import cover, drawn_chance, fewest_segments, gain_beyond, least_freedom, missed_sets, needed_of, strike

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
    how: Records,
) -> int:
    """Go through bases, the best first, until nothing better can have been missed or the budget of tests is used up.

    `how` (1,) of `HOW`; `progress` (1,) keeps the chance of having missed something up to date, or says that it is
    greater than is allowed: see `missed_share`. Returns one of `BUDGET`, `EXHAUSTED`, `PROVEN`, `CONFIDENT`.
    """
    state = progress[0]
    allowed = how[0].allowed
    budget = how[0].budget
    spent = 0
    while True:
        if state.current < 0:
            state.current = next_base(question, plan)
            if state.current < 0:
                return EXHAUSTED
        base = plan.bases[state.current]
        spent += search_base(question, tables, base, found, state, work, budget - spent)
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
