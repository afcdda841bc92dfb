"""The search goes from base to base as its twin does, and ends when nothing can have been missed."""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass

import numpy as np
import pytest
from hypothesis import given, settings

from association.layout import FOUND, HOW, PROGRESS, record
from association.search.kernels import advancing, stopping
from association.search.kernels.proposing import search_base
from association.search.planning_tables import Plan
from association.tables import Question
from registration.layout import Records

from ...kernels.drawn import INDEX, SEEDS, TABLES, Drawn, drawn, workspace_of
from ...kernels.plans import RULE, bases_of, plan_of
from ...reference import planning as twin
from ...scenes import context_of, scan_of

BASES = 8  # segments that bases are made of


def start_of(scan: Records) -> Records:
    return record(PROGRESS, current=-1, bound=scan["gain"].sum(), missed=1.0)


@dataclass(frozen=True)
class Effort:
    """How far a search goes: the chance of having missed something, the value that ends it, the order of bases."""

    allowed: float
    enough: float = math.inf
    by_chance: bool = False


@dataclass(frozen=True)
class End:
    """Why a search ended, after how many bases, the bound, and the share that may have been missed."""

    why: int
    bases: int
    bound: float
    missed: float


def asked(d: Drawn, effort: Effort) -> Question:
    rules = RULE.copy()
    rules["enough"] = effort.enough
    return context_of(INDEX, scan_of(d.endpoints)).question(rules)


def planned(question: Question, effort: Effort) -> Plan:
    n = min(len(question.scan), BASES)
    return plan_of(question.scan, n, INDEX.runs, INDEX.area, by_chance=effort.by_chance)


def expected_end(d: Drawn, effort: Effort) -> End:
    """Go through the bases one by one."""
    question, found, state = asked(d, effort), np.zeros(64, FOUND), start_of(d.scan)
    plan, work = planned(question, effort), workspace_of(d.scan)
    gains, beyond = plan.best_gains.tolist(), float(d.scan["gain"][BASES:].sum())
    residual, tried, bound, missed = d.scan["gain"].copy(), [], float(d.scan["gain"].sum()), 1.0
    weighed = bases_of(question.scan, len(plan.uses), INDEX.runs, INDEX.area)
    at_most = plan.bases["merit"].tolist()
    order = twin.order_of(weighed[["sliding", "crossing", "merit"]].tolist(), plan.fade, at_most)
    for count, k in enumerate(order, 1):
        base = weighed[k]
        search_base(question, TABLES, base, found, state[0], work, 10**9)
        best = float(state["best_value"][0])
        state["least_freedom"] = twin.least_freedom_sorted(d.scan, 0.65 * best)
        needed = 0.95 * best + twin.least_freedom_sorted(d.scan, 0.95 * best)
        a, b = base["sliding"], base["crossing"]
        if twin.is_telling(d.scan, a, b):
            tried.append(base)
            less = min(residual[[a, b]])
            residual[[a, b]] -= less
            bound -= less
            fewest = twin.fewest_segments(gains, beyond, needed)
            by_chance = missed * (1.0 - twin.drawn_chance(fewest, len(gains)))
            missed = (
                by_chance
                if effort.by_chance
                else twin.missed_share(plan.samples.orders, d.scan["gain"], tried, needed - beyond)
            )
        proven = effort.allowed >= 0.0 and bound < needed
        if best >= effort.enough or (missed <= effort.allowed and not proven):
            return End(advancing.CONFIDENT, count, bound, missed)
        if proven:
            return End(advancing.PROVEN, count, bound, missed)
    return End(advancing.EXHAUSTED, len(order), bound, missed)


def end_of(d: Drawn, effort: Effort, budget: int) -> tuple[End, Records, int]:
    """Advance until it ends; return how, what was found, and the number of calls."""
    question, found, progress = asked(d, effort), np.zeros(64, FOUND), start_of(d.scan)
    plan, work, how = (
        planned(question, effort),
        workspace_of(d.scan),
        record(HOW, allowed=effort.allowed, budget=budget),
    )
    why, calls = advancing.BUDGET, 0
    while why == advancing.BUDGET:
        why = advancing.advance(question, TABLES, plan, found, progress, work, how)
        calls += 1
    state = progress[0]
    missed = float(state["missed"]) if effort.by_chance else stopping.missed_share(question, plan, progress)
    end = End(why, int(state["bases"]), float(state["bound"]), missed)
    return end, found[: int(state["count"])], calls


def assert_ends_alike(d: Drawn, effort: Effort) -> End:
    """Compare with the twin, and with a search that is interrupted."""
    end, found, calls = end_of(d, effort, 10**9)
    assert astuple(end) == pytest.approx(astuple(expected_end(d, effort)))
    assert calls == 1
    again, same, calls = end_of(d, effort, 300)
    assert again == end
    np.testing.assert_array_equal(same, found)
    assert calls > 1 or end.bases <= 1
    return end


@given(SEEDS)
@settings(max_examples=12, deadline=None)
def test_advance(seed: int) -> None:
    """It ends where its twin does and for the same reason, with the same poses however often it is interrupted."""
    d = drawn(seed, radius=8.0, clutter=seed % 4)
    for allowed in (-1.0, 0.0, 0.02, 0.3):
        assert_ends_alike(d, Effort(allowed))


@given(SEEDS)
@settings(max_examples=8, deadline=None)
def test_advance_through_bases_that_are_drawn(seed: int) -> None:
    """The chance of having missed something is that of independent draws; bases are not spread over the segments."""
    d = drawn(seed, radius=8.0, clutter=seed % 4)
    for allowed in (-1.0, 0.3, 0.9):
        assert_ends_alike(d, Effort(allowed, by_chance=True))


@given(SEEDS)
@settings(max_examples=8, deadline=None)
def test_a_value_that_is_enough_ends_it(seed: int) -> None:
    """Whatever may have been missed, and where all bases were to be gone through, too."""
    d = drawn(seed, radius=8.0, clutter=seed % 4)
    end, found, _ = end_of(d, Effort(-1.0), 10**9)
    best = float(found["value"].max(initial=0.0))
    assert assert_ends_alike(d, Effort(-1.0, enough=best + 1e-6)) == end
    if best > 0.0:
        early = assert_ends_alike(d, Effort(-1.0, enough=best - 1e-6))
        assert early.why == advancing.CONFIDENT
        assert early.bases <= end.bases


def test_all_three_ends_are_met() -> None:
    ends = {
        expected_end(drawn(seed, radius=8.0, clutter=seed % 4), Effort(allowed)).why
        for seed in range(8)
        for allowed in (-1.0, 0.0, 0.3)
    }
    assert ends == {advancing.EXHAUSTED, advancing.PROVEN, advancing.CONFIDENT}
