"""The search goes from base to base as the reference does, and ends when nothing can have been missed."""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass

import numpy as np
import pytest
from hypothesis import given, settings

from association.layout import record
from association.search.kernels import searching, stopping
from association.search.kernels.bases import plan_search
from association.search.kernels.hypotheses import search_base
from association.search.kernels.sliding import search_slides, sliding_segments
from association.search.layout import CONFIDENT, EXHAUSTED, INTERRUPTED, LIMITS, PROVEN, STATISTICS
from association.search.tables import Plan, Sampling, SearchState
from association.search.tuning import BASE_SEGMENTS, REUSE, SLIDE_SEGMENTS
from association.tables import MapTables, Question
from registration.layout import Records

from ...kernels.drawn import INDEX, SEEDS, TABLES, Drawn, drawn, workspace_of
from ...kernels.plans import NOT_LISTED, RULE, bases_of, plan_of, sampled, state_of, stored_in
from ...reference import planning as twin
from ...scenes import context_of, scan_of

BASES, STORED = 8, 20  # segments that bases are made of; poses of bases that are stored
SPACING, FRACTION = 2.0, 0.7  # of slides, m; of the best value that parallel segments have to gain


@dataclass(frozen=True)
class Effort:
    """Limits of a search: the probability of having missed a set, the value that ends it, the order of bases."""

    allowed: float
    enough: float = math.inf
    by_chance: bool = False


@dataclass(frozen=True)
class End:
    """Why a search ended, after how many bases, the bound, and the fraction of sets that may have been missed."""

    why: int
    bases: int
    bound: float
    missed: float


def asked(d: Drawn, effort: Effort) -> Question:
    """Return what is searched, with rules for bases and for slides."""
    rules = np.concatenate([RULE, RULE])
    rules["enough"], rules["distinct_distance"][1] = effort.enough, 0.9 * SPACING
    return context_of(INDEX, scan_of(d.endpoints)).question(rules)


def planned(question: Question, effort: Effort) -> Plan:
    n = min(len(question.scan), BASES)
    return plan_of(question.scan, n, INDEX.chains, INDEX.area, by_chance=effort.by_chance)


def begun(d: Drawn, stored: int = 64) -> SearchState:
    """Return the state of a search of a scan that has just begun."""
    state = state_of(stored)
    state.statistics["bound"] = d.scan["gain"].sum()
    return state


def expected_end(d: Drawn, effort: Effort) -> End:
    """Search the bases one by one."""
    question, state = asked(d, effort), begun(d)
    plan, work = planned(question, effort), workspace_of(d.scan)
    gains, beyond = plan.best_gains.tolist(), float(d.scan["gain"][BASES:].sum())
    residual, tried, bound, missed = d.scan["gain"].copy(), [], float(d.scan["gain"].sum()), 1.0
    weighed = bases_of(question.scan, len(plan.uses), INDEX.chains, INDEX.area)
    at_most = plan.bases["merit"].tolist()
    order = twin.order_of(weighed[["sliding", "crossing", "merit"]].tolist(), plan.fade, at_most)
    for count, k in enumerate(order, 1):
        base = weighed[k]
        assert search_base(question, TABLES, base, state, work)
        best = float(state.best["best_value"][0])
        state.best["least_freedom"] = twin.least_freedom_sorted(d.scan, 0.65 * best)
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
            return End(CONFIDENT, count, bound, missed)
        if proven:
            return End(PROVEN, count, bound, missed)
    return End(EXHAUSTED, len(order), bound, missed)


def end_of(d: Drawn, effort: Effort) -> tuple[End, Records]:
    """Return how a search of bases ends, and what it found."""
    question, state = asked(d, effort), begun(d)
    plan = planned(question, effort)
    why = searching.search_bases(question, TABLES, plan, state, workspace_of(d.scan), effort.allowed)
    statistics = state.statistics[0]
    best = float(state.best["best_value"][0])
    missed = float(statistics["missed"]) if effort.by_chance else stopping.missed_fraction(question, plan, best)
    return End(why, int(statistics["bases"]), float(statistics["bound"]), missed), stored_in(state)


def assert_ends_alike(d: Drawn, effort: Effort) -> End:
    """Compare with the reference."""
    end, _ = end_of(d, effort)
    assert astuple(end) == pytest.approx(astuple(expected_end(d, effort)))
    return end


@given(SEEDS)
@settings(max_examples=12, deadline=None)
def test_search_bases(seed: int) -> None:
    """It ends where the reference does and for the same reason."""
    d = drawn(seed, radius=8.0, clutter=seed % 4)
    for allowed in (-1.0, 0.0, 0.02, 0.3):
        assert_ends_alike(d, Effort(allowed))


@given(SEEDS)
@settings(max_examples=8, deadline=None)
def test_bases_that_are_drawn_at_random(seed: int) -> None:
    """The probability of having missed a set is that of independent draws; uses of a segment do not count."""
    d = drawn(seed, radius=8.0, clutter=seed % 4)
    for allowed in (-1.0, 0.3, 0.9):
        assert_ends_alike(d, Effort(allowed, by_chance=True))


@given(SEEDS)
@settings(max_examples=8, deadline=None)
def test_a_value_that_is_enough_ends_it(seed: int) -> None:
    """Whatever may have been missed, and where all bases were to be searched, too."""
    d = drawn(seed, radius=8.0, clutter=seed % 4)
    end, found = end_of(d, Effort(-1.0))
    best = float(found["value"].max(initial=0.0))
    assert assert_ends_alike(d, Effort(-1.0, enough=best + 1e-6)) == end
    if best > 0.0:
        early = assert_ends_alike(d, Effort(-1.0, enough=best - 1e-6))
        assert early.why == CONFIDENT
        assert early.bases <= end.bases


def test_all_three_ends_are_met() -> None:
    ends = {
        expected_end(drawn(seed, radius=8.0, clutter=seed % 4), Effort(allowed)).why
        for seed in range(8)
        for allowed in (-1.0, 0.0, 0.3)
    }
    assert ends == {EXHAUSTED, PROVEN, CONFIDENT}


def drawn_by(seed: int, d: Drawn, *, by_chance: bool) -> Sampling:
    """Return by which a plan is made; of some scans without bases."""
    n = seed % 2 if seed % 5 == 0 else min(len(d.scan), BASES)
    samples, noise = sampled(n, 64, d.rng), d.rng.gumbel(size=BASES**2 if by_chance else 0)
    return Sampling(INDEX.chains, INDEX.area, samples.orders, samples.ranks, math.log(REUSE), noise)


def apart(question: Question, tables: MapTables, by: Sampling, allowed: float) -> tuple[Records, SearchState]:
    """Plan, search the bases, slide what is parallel and sort; return the poses and the state of the bases."""
    state, work = state_of(STORED), workspace_of(question.scan)
    plan = plan_search(question, tables, by, state.statistics[0])
    state.statistics["why"] = searching.search_bases(question, tables, plan, state, work, allowed)
    best = state.best.copy()
    best["count"] = 0
    slides = state_of(64)._replace(best=best, statistics=state.statistics)
    floor = FRACTION * float(best["best_value"][0])
    for sliding in sliding_segments(question.scan, min(len(question.scan), BASE_SEGMENTS), floor, SLIDE_SEGMENTS):
        of_slides = question._replace(rules=question.rules[1:])
        assert search_slides(of_slides, tables, sliding, slides, work, SPACING)
    poses = np.concatenate([stored_in(state), stored_in(slides)])
    return poses[np.argsort(-poses["value"], kind="stable")], state


@given(SEEDS)
@settings(max_examples=16, deadline=None)
def test_a_search_does_what_its_parts_do_one_after_the_other(seed: int) -> None:
    d = drawn(seed, radius=8.0, clutter=seed % 4)
    question, work = asked(d, Effort(0.0)), workspace_of(d.scan)
    for allowed, by_chance in ((-1.0, False), (0.0, False), (0.3, False), (-1.0, True), (0.3, True)):
        by = drawn_by(seed, d, by_chance=by_chance)
        tables = TABLES._replace(crossings=INDEX.crossings if seed % 3 else NOT_LISTED)
        limits = record(LIMITS, allowed=allowed, spacing=SPACING, slides_fraction=FRACTION, stored=STORED)
        statistics = record(STATISTICS)
        found = searching.search(question, tables, by, limits, statistics, work, np.zeros(1, np.uint8))
        expected, state = apart(question, tables, by, allowed)
        np.testing.assert_array_equal(found, expected)
        np.testing.assert_array_equal(statistics, state.statistics)


def test_a_search_that_has_to_end_finds_nothing() -> None:
    """And it returns that reason before the first base."""
    d = drawn(3, radius=8.0)
    limits = record(LIMITS, allowed=0.0, spacing=SPACING, slides_fraction=FRACTION, stored=STORED)
    statistics, by = record(STATISTICS), drawn_by(3, d, by_chance=False)
    stop = np.ones(1, np.uint8)
    found = searching.search(asked(d, Effort(0.0)), TABLES, by, limits, statistics, workspace_of(d.scan), stop)
    assert len(found) == 0
    assert statistics[0][["bases", "hypotheses", "why", "missed"]].item() == (0, 0, INTERRUPTED, 1.0)
