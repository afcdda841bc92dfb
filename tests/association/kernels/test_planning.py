"""Bases are planned as the twins plan them, and the search ends when nothing can have been missed."""

from __future__ import annotations

import itertools
import math
from dataclasses import astuple, dataclass

import numpy as np
import pytest
from hypothesis import given, settings

from association.kernels import advancing, planning, sliding, stopping
from association.kernels.proposing import search_base
from association.layout import FOUND, PROGRESS, RULES, SCAN_LINE, WALL, record
from association.tables import Plan, Question, Samples
from association.tuning import BASE_SEGMENTS, PARALLEL_SINE, REUSE
from registration.layout import Records

from ..reference import planning as twin
from ..reference.consensus import Pairs, freedom_taken
from ..reference.scans import freedom_alone
from ..scenes import context_of, scan_of
from .drawn import INDEX, MODEL, NOTHING, SEEDS, TABLES, Drawn, drawn, oblique, workspace_of

RULE = record(RULES, kept_share=0.65, distinct_distance=0.3, distinct_angle=0.1, rival_share=0.95, enough=np.inf)
BASES = 8  # segments that bases are made of


def uncertain(d: Drawn) -> Records:
    """Return the scan with angles that are known more or less well: a base may tell much or little."""
    scan = d.scan.copy()
    scan["angle_variance"] *= 10.0 ** d.rng.uniform(0.0, 3.0, len(scan))
    return scan


@given(SEEDS)
@settings(max_examples=30, deadline=None)
def test_slack_tables(seed: int) -> None:
    d = drawn(seed)
    d.scan["length"] *= 1.5
    runs = oblique(d.rng).runs
    for got, expected in zip(planning.slack_tables(d.scan, 9, runs), twin.slack_tables(d.scan, 9, runs), strict=True):
        np.testing.assert_allclose(got, expected, atol=1e-9)


@given(SEEDS)
@settings(max_examples=40, deadline=None)
def test_is_telling(seed: int) -> None:
    d = drawn(seed)
    scan = uncertain(d)
    for a, b in itertools.combinations(range(len(scan)), 2):
        assert bool(planning.is_telling(scan[a], scan[b], planning.middle_of(scan))) is twin.is_telling(scan, a, b)


@given(SEEDS)
@settings(max_examples=4, deadline=None)
def test_beyond_the_longest_segments_only_what_tells_makes_a_base(seed: int) -> None:
    scan = np.concatenate([uncertain(drawn(seed + k)) for k in range(6)])[: BASE_SEGMENTS + 8]
    assert len(scan) == BASE_SEGMENTS + 8
    bases = planning.plan_bases(scan, len(scan), INDEX.runs, 400.0)
    expected = twin.plan_bases(scan, len(scan), INDEX.runs, 400.0)
    assert bases[["sliding", "crossing"]].tolist() == [base[:2] for base in expected]
    assert any(max(base[:2]) >= BASE_SEGMENTS for base in expected)


def test_a_base_tells_as_long_as_it_lays_the_others_off_by_a_quarter_of_a_metre() -> None:
    """Two segments at the origin with an angle's deviation of 0.02 each, others 10 m and more away."""
    scan = drawn(0).scan[:4].copy()
    scan["x"], scan["y"], scan["gain"], scan["angle_variance"] = 0.0, 0.0, [0.0, 0.0, 1.0, 1.0], 2.0 * 0.02**2
    for distance, telling in ((12.4, True), (12.6, False)):
        scan["x"][2:], scan["y"][2:] = [distance, 0.0], [0.0, distance]
        assert bool(planning.is_telling(scan[0], scan[1], planning.middle_of(scan))) is telling


@given(SEEDS)
@settings(max_examples=20, deadline=None)
def test_plan_bases_and_the_order_in_which_they_are_taken(seed: int) -> None:
    d = drawn(seed)
    scan, runs, area = uncertain(d), oblique(d.rng).runs, 10.0 ** d.rng.uniform(1.0, 4.0)
    count = int(d.rng.integers(2, len(scan) + 1))
    bases, expected = planning.plan_bases(scan, count, runs, area), twin.plan_bases(scan, count, runs, area)
    assert bases[["sliding", "crossing"]].tolist() == [base[:2] for base in expected]
    np.testing.assert_allclose(bases["merit"], [base[2] for base in expected], rtol=1e-9)
    for fade in (math.log(REUSE), 0.0):
        left, uses = bases.copy(), np.zeros(count)
        taken = [planning.next_base(left, uses, fade) for _ in range(len(expected) + 1)]
        assert taken == [*twin.order_of(expected, fade), -1]
        assert uses.sum() == 2 * len(expected)


def test_bound_is_never_below_what_can_have_been_missed() -> None:
    """Brute force over all consensus sets that contain none of the bases; what is lowered is told."""
    rng = np.random.default_rng(4)
    gains = rng.uniform(1.0, 10.0, 9)
    residual, bound = gains.copy(), float(gains.sum())
    tried = []
    for _ in range(12):
        a, b = rng.choice(9, 2, replace=False).tolist()
        bound -= stopping.cover(residual, a, b)
        tried.append((1 << a) | (1 << b))
        free = [s for s in range(512) if not any(s & t == t for t in tried)]
        missed = max(sum(gains[i] for i in range(9) if s >> i & 1) for s in free)
        assert bound >= missed - 1e-9
        assert bound >= residual.sum() - 1e-9
    assert bound < 0.7 * gains.sum()


def sampled(n: int, count: int, rng: np.random.Generator) -> Samples:
    orders = rng.permuted(np.tile(np.arange(n, dtype=np.uint8), (count, 1)), axis=1)
    ranks = np.ascontiguousarray(orders.argsort(axis=1).T, dtype=np.uint8)
    found, sizes, gains = np.full(count, n, np.uint8), np.zeros(count, np.uint8), np.zeros(count)
    return Samples(orders, ranks, found, sizes, gains, np.arange(count + 1, dtype=np.int32))


@given(SEEDS)
@settings(max_examples=40, deadline=None)
def test_strike(seed: int) -> None:
    """The sets that are left are counted, as they grow; what all segments together do not come to has none."""
    rng = np.random.default_rng(seed)
    samples, scan = sampled(7, 200, rng), drawn(seed).scan[:7]
    most = int(rng.integers(0, 200))
    gains = scan["gain"]
    tried, total = [], float(scan["gain"].sum())
    for needed in np.sort(rng.uniform(-5.0, 1.1 * total, 5)):
        a, b = rng.choice(7, 2, replace=False).tolist()
        tried.append({"sliding": a, "crossing": b})
        stopping.strike(samples, a, b)
        fewest = twin.fewest_segments((-np.sort(-gains)).tolist(), 0.0, needed)
        expected = round(200 * twin.missed_share(samples.orders, gains, tried, needed))
        assert stopping.missed_sets(scan, samples, fewest, needed, most) == min(expected, most + 1)
        assert stopping.missed_sets(scan, samples, fewest, needed, 200) == expected


@given(SEEDS)
@settings(max_examples=60, deadline=None)
def test_fewest_segments(seed: int) -> None:
    rng = np.random.default_rng(seed)
    gains = -np.sort(-rng.integers(1, 9, 6).astype(float))
    beyond, needed = float(rng.choice([0.0, 3.0])), float(rng.integers(-1, 50))
    assert stopping.fewest_segments(gains, beyond, needed) == twin.fewest_segments(gains.tolist(), beyond, needed)


def test_drawn_chance() -> None:
    for count in range(8):
        for fewest in range(2, max(3, count + 1)):
            assert stopping.drawn_chance(fewest, count) == pytest.approx(twin.drawn_chance(fewest, count))


@given(SEEDS)
@settings(max_examples=60, deadline=None)
def test_least_freedom(seed: int) -> None:
    """Brute force over all sets; some lines take as much as others, and some sets come to what is needed to the bit."""
    rng = np.random.default_rng(seed)
    scan = np.zeros(int(rng.integers(1, 9)), SCAN_LINE)
    scan["gain"], scan["freedom"] = rng.integers(1, 9, len(scan)), rng.integers(1, 6, len(scan))
    freest = np.argsort(-scan["freedom"], kind="stable")
    for needed in (*rng.integers(1, int(scan["gain"].sum()) + 1, 5), scan["gain"].sum()):
        got = stopping.least_freedom(scan, freest, float(needed))
        assert got == twin.least_freedom(scan, needed) == twin.least_freedom_sorted(scan, needed)
    assert stopping.least_freedom(scan, freest, 0.0) == 0.0
    assert stopping.least_freedom(scan, freest, scan["gain"].sum() + 1.0) == scan["freedom"].max()


@given(SEEDS)
@settings(max_examples=20, deadline=None)
def test_no_set_takes_less_freedom(seed: int) -> None:
    """Brute force over the sets of some lines, on walls that lie as they do, several of them on one wall."""
    d = drawn(seed)
    scan = d.scan[np.sort(d.rng.choice(len(d.scan), 7, replace=False))].copy()
    walls = np.zeros(len(scan), WALL)
    walls["dx"], walls["dy"] = scan["dx"], scan["dy"]
    of_wall = np.arange(len(scan))
    for k in range(3):  # these lie on the wall of the first, farther on
        scan[["dx", "dy", "angle"]][k] = scan[["dx", "dy", "angle"]][0]
        of_wall[k] = 0
    model = MODEL[0]
    for line in scan:
        line["freedom"] = freedom_alone(line, model)
    freest = np.argsort(-scan["freedom"], kind="stable")
    taken = {}
    for size in range(1, len(scan) + 1):
        for some in itertools.combinations(range(len(scan)), size):
            held = np.where(np.isin(np.arange(len(scan)), some), of_wall, -1)
            pairs = Pairs.of(scan, held, walls, float(model["wall_variance"]))
            taken[some] = freedom_taken(pairs.information(0.0), model), scan["gain"][list(some)].sum()
    for needed in d.rng.uniform(1.0, scan["gain"].sum(), 8):
        least = min(freedom for freedom, gain in taken.values() if gain >= needed)
        assert stopping.least_freedom(scan, freest, needed) <= least + 1e-9


def plan_of(scan: Records, rng: np.random.Generator, *, drawn_by_chance: bool) -> Plan:
    n = min(len(scan), BASES)
    return Plan(
        bases=planning.plan_bases(scan, n, INDEX.runs, INDEX.area),
        uses=np.zeros(n),
        residual=scan["gain"].copy(),
        best_gains=-np.sort(-scan["gain"][:n]),
        freest=np.argsort(-scan["freedom"], kind="stable"),
        samples=sampled(n, 512, rng),
        fade=0.0 if drawn_by_chance else math.log(REUSE),
        random=drawn_by_chance,
    )


@given(SEEDS)
@settings(max_examples=20, deadline=None)
def test_begin(seed: int) -> None:
    """A scan of more segments than bases are made of, and of fewer; the best value that is known stays."""
    d = drawn(seed)
    question, n = context_of(INDEX, scan_of(d.endpoints)).question(RULE), int(d.rng.integers(1, len(d.scan) + 1))
    samples, progress = sampled(n, 16, d.rng), record(PROGRESS, best_value=3.0, current=7, bound=9.0)
    plan = planning.begin(
        question, INDEX.runs, INDEX.area, samples.orders, samples.ranks, progress, math.log(REUSE), seed % 2 == 0
    )
    assert progress[0]["current"] == -1
    assert progress[0]["bound"] == pytest.approx(d.scan["gain"].sum())
    assert progress[0]["missed"] == 1.0
    assert progress[0]["best_value"] == 3.0
    np.testing.assert_array_equal(plan.bases, planning.plan_bases(question.scan, n, INDEX.runs, INDEX.area))
    np.testing.assert_array_equal(plan.uses, np.zeros(n))
    np.testing.assert_array_equal(plan.residual, d.scan["gain"])
    np.testing.assert_array_equal(plan.best_gains, sorted(d.scan["gain"][:n], reverse=True))
    np.testing.assert_array_equal(plan.freest, sorted(range(len(d.scan)), key=lambda i: -d.scan["freedom"][i]))
    assert (plan.fade, plan.random) == (math.log(REUSE), seed % 2 == 0)
    for got, expected in zip(plan.samples, samples, strict=True):
        np.testing.assert_array_equal(got, expected)


@given(SEEDS)
@settings(max_examples=40, deadline=None)
def test_sliding_segments(seed: int) -> None:
    """Of each class of parallel ones two at most, if together they come to more than the floor."""
    d = drawn(seed)
    few, most, floor = int(d.rng.integers(0, len(d.scan) + 1)), int(d.rng.integers(1, 5)), d.rng.uniform(0.0, 30.0)
    directions = np.stack([d.scan["dx"], d.scan["dy"]], 1)
    chosen: list[int] = []
    for i, direction in enumerate(directions[:few]):
        alike = np.abs(directions @ [direction[1], -direction[0]]) < PARALLEL_SINE
        if d.scan["gain"][alike].sum() > floor and alike[chosen].sum() < 2:
            chosen.append(i)
    assert sliding.sliding_segments(d.scan, few, floor, most).tolist() == chosen[:most]


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


def expected_end(d: Drawn, effort: Effort) -> End:
    """Go through the bases one by one."""
    question, found, state = asked(d, effort), np.zeros(64, FOUND), start_of(d.scan)
    plan, work = (
        plan_of(question.scan, np.random.default_rng(0), drawn_by_chance=effort.by_chance),
        workspace_of(d.scan),
    )
    gains, beyond = plan.best_gains.tolist(), float(d.scan["gain"][BASES:].sum())
    residual, tried, bound, missed = d.scan["gain"].copy(), [], float(d.scan["gain"].sum()), 1.0
    order = twin.order_of([base.item() for base in plan.bases], plan.fade)
    for count, k in enumerate(order, 1):
        base = plan.bases[k]
        search_base(question, TABLES, base, found, NOTHING, state[0], work, 10**9)
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
    plan, work = (
        plan_of(question.scan, np.random.default_rng(0), drawn_by_chance=effort.by_chance),
        workspace_of(d.scan),
    )
    why, calls = advancing.BUDGET, 0
    while why == advancing.BUDGET:
        why = advancing.advance(question, TABLES, plan, found, progress, work, effort.allowed, budget)
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
