"""A search in one call does what its parts do one after the other, however often it is interrupted."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given, settings

from association.layout import FOUND, HOW, PROGRESS, record
from association.search.kernels import advancing, stopping
from association.search.kernels.planning import begin
from association.search.kernels.searching import go_on, put_in_order, search
from association.search.kernels.sliding import search_slides, sliding_segments
from association.search.planning_tables import Planning
from association.tables import MapTables, Question, Workspace
from association.tuning import BASE_SEGMENTS, REUSE, SLIDE_SEGMENTS
from registration.layout import Records

from ...kernels.drawn import INDEX, SEEDS, TABLES, Drawn, drawn, workspace_of
from ...kernels.plans import NOT_LISTED, RULE, sampled
from ...scenes import context_of, scan_of

BASES, KEPT, SLIDES = 8, 20, 16  # segments that bases are made of; poses of bases and of slides that are kept
SPACING, SHARE = 2.0, 0.7


def asked(d: Drawn) -> Question:
    """Return what is searched, with rules for bases and for slides."""
    rules = np.concatenate([RULE, RULE])
    rules["distinct_distance"][1] = 0.9 * SPACING
    return context_of(INDEX, scan_of(d.endpoints)).question(rules)


def apart(
    question: Question, tables: MapTables, by: Planning, work: Workspace, allowed: float
) -> tuple[Records, Records, int]:
    """Plan, go through the bases, lay what is parallel and sort; return poses, progress, why it ended."""
    progress, found, slid = record(PROGRESS), np.zeros(KEPT, FOUND), np.zeros(SLIDES, FOUND)
    plan, why = begin(question, tables, by, progress), advancing.EXHAUSTED
    if len(plan.bases):
        how = record(HOW, allowed=allowed, budget=10**9)
        why = advancing.advance(question, tables, plan, found, progress, work, how)
    if not len(plan.bases):
        progress["missed"] = 0.0
    elif why == advancing.EXHAUSTED and not plan.random:
        progress["missed"] = stopping.missed_share(question, plan, progress)
    poses, floor = found[: int(progress["count"][0])], SHARE * float(progress["best_value"][0])
    progress["count"] = 0
    for sliding in sliding_segments(question.scan, min(len(question.scan), BASE_SEGMENTS), floor, SLIDE_SEGMENTS):
        progress["anchor"] = progress["step"] = 0
        slides = question._replace(rules=question.rules[1:])
        assert search_slides(slides, tables, sliding, slid, progress, work, SPACING, 10**9)
    poses = np.concatenate([poses, slid[: int(progress["count"][0])]])
    return poses[np.argsort(-poses["value"], kind="stable")], progress, why


@given(SEEDS)
@settings(max_examples=16, deadline=None)
def test_a_search_in_one_call(seed: int) -> None:
    """The plan is handed out where the budget ends it; where there are no bases they are at their end."""
    d = drawn(seed, radius=8.0, clutter=seed % 4)
    question, work = asked(d), workspace_of(d.scan)
    for allowed, by_chance in ((-1.0, False), (0.0, False), (0.3, False), (-1.0, True), (0.3, True)):
        n = seed % 2 if seed % 5 == 0 else min(len(d.scan), BASES)
        samples, noise = sampled(n, 64, d.rng), d.rng.gumbel(size=BASES**2 if by_chance else 0)
        by = Planning(INDEX.runs, INDEX.area, samples.orders, samples.ranks, math.log(REUSE), noise)
        tables = TABLES._replace(crossings=INDEX.crossings if seed % 3 else NOT_LISTED)
        expected, state, ended = apart(question, tables, by, work, allowed)
        for budget in (10**9, 100):
            how = record(HOW, allowed=allowed, spacing=SPACING, share=SHARE, kept=KEPT, budget=budget)
            progress, found = record(PROGRESS), np.zeros(KEPT + SLIDES, FOUND)
            why, left = search(question, tables, by, found, progress, work, how)
            assert (left is None) == bool(progress["done"][0])
            assert budget == 100 or left is None
            assert bool(progress["left"][0]) == (why != advancing.BUDGET)
            if left is not None:
                steps = 0
                while not progress["left"][0]:
                    why = go_on(question, tables, left, found, progress, work, how)
                    progress["left"] = why != advancing.BUDGET
                    steps += 1
                if steps and why == advancing.EXHAUSTED and not by_chance:
                    progress["missed"] = stopping.missed_share(question, left, progress)
                while not progress["done"][0]:
                    go_on(question, tables, left, found, progress, work, how)
            assert why == ended
            np.testing.assert_array_equal(found[: int(progress["count"][0])], expected)
            same = ["best_value", "least_kept", "bases", "hypotheses", "verified", "bound", "missed", "least_freedom"]
            np.testing.assert_array_equal(progress[same], state[same])


def test_what_was_found_before_anything_was_laid_is_put_in_order() -> None:
    """As where the deadline ended the bases; ties stay as they were found."""
    how, found = record(HOW, kept=4), np.zeros(8, FOUND)
    found["value"], found["x"] = [1.0, 3.0, 2.0, 3.0, 9.0, 9.0, 9.0, 9.0], np.arange(8)
    progress = record(PROGRESS, count=4, sliding=-1)
    put_in_order(found, progress, how)
    assert found["x"][:4].tolist() == [1.0, 3.0, 2.0, 0.0]
    assert (progress["count"][0], progress["done"][0]) == (4, 1)
    found["value"], found["x"] = [1.0, 3.0, 2.0, 3.0, 9.0, 3.0, 0.5, 9.0], np.arange(8)
    progress = record(PROGRESS, count=3, sliding=1, of_bases=2)
    put_in_order(found, progress, how)
    assert found["x"][:5].tolist() == [4.0, 1.0, 5.0, 0.0, 6.0]
