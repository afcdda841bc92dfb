"""Bases are planned, and taken, as the references do it."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings

from association.index.grids import listed
from association.layout import CROSSING
from association.search.kernels import bases as planning
from association.search.kernels import sliding
from association.search.tables import Sampling
from association.search.tuning import BASE_SEGMENTS, COST_BASE, COST_ENTRY, GAIN_POWER, PARALLEL_SINE, REUSE, UNTELLING
from association.tables import Crossings
from registration.layout import Records

from ...kernels.drawn import ASKED, INDEX, SEEDS, TABLES, Drawn, drawn, oblique
from ...kernels.plans import NOT_LISTED, RULE, bases_of, entries_of, plan_of, sampled, state_of
from ...reference import crossings as twin_of_crossings
from ...reference import planning as twin
from ...scenes import context_of, index_of, scan_of


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
    chains = oblique(d.rng).chains
    for got, expected in zip(
        planning.slack_tables(d.scan, 9, chains), twin.slack_tables(d.scan, 9, chains), strict=True
    ):
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
    bases = bases_of(scan, len(scan), INDEX.chains, 400.0)
    expected = twin.plan_bases(scan, len(scan), INDEX.chains, 400.0)
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
    scan, chains, area = uncertain(d), oblique(d.rng).chains, 10.0 ** d.rng.uniform(1.0, 4.0)
    count = int(d.rng.integers(2, len(scan) + 1))
    bases, expected = bases_of(scan, count, chains, area), twin.plan_bases(scan, count, chains, area)
    assert bases[["sliding", "crossing"]].tolist() == [base[:2] for base in expected]
    np.testing.assert_allclose(bases["merit"], [base[2] for base in expected], rtol=1e-9)
    for fade in (math.log(REUSE), 0.0):
        plan = plan_of(scan, count, chains, area)._replace(fade=fade)
        at_most = plan.bases["merit"].tolist()
        taken = [planning.next_base(ASKED._replace(scan=scan), plan) for _ in range(len(expected) + 1)]
        assert taken == [*twin.order_of(expected, fade, at_most), -1]
        assert plan.uses.sum() == 2 * len(expected)


@given(SEEDS)
@settings(max_examples=20, deadline=None)
def test_what_a_base_is_worth_before_it_is_weighed_it_is_worth_at_most(seed: int) -> None:
    d = drawn(seed)
    scan, chains, area = uncertain(d), oblique(d.rng).chains, 10.0 ** d.rng.uniform(1.0, 4.0)
    bases, weighed = planning.pair_up(scan, len(scan)), bases_of(scan, len(scan), chains, area)
    assert not bases["weighed"].any()
    assert weighed["weighed"].all()
    assert (bases["merit"] > weighed["merit"]).all()


@given(SEEDS)
@settings(max_examples=20, deadline=None)
def test_a_base_of_which_the_crossings_are_listed_costs_what_there_are(seed: int) -> None:
    """Its second segment is to the left of the first one then; beyond the lists it is swept as any other."""
    d = drawn(seed)
    scan, near = uncertain(d), listed_up_to(4.0)
    swept = bases_of(scan, len(scan), INDEX.chains, INDEX.area)
    bases = bases_of(scan, len(scan), INDEX.chains, INDEX.area, near)
    assert (swept["listed"] == -1).all()
    for base, other in zip(bases, swept, strict=True):
        a, b = base["sliding"], base["crossing"]
        if base["listed"] < 0:
            assert base.item() == other.item()
            continue
        assert {a, b} == {other["sliding"], other["crossing"]}
        assert scan["dx"][a] * scan["dy"][b] > scan["dy"][a] * scan["dx"][b]
        assert base["listed"] == entries_of(scan, (a, b), near)
        worth = min(scan["gain"][[a, b]]) ** GAIN_POWER * (1.0 if twin.is_telling(scan, a, b) else UNTELLING)
        assert base["merit"] == pytest.approx(math.log(worth / (COST_BASE + COST_ENTRY * base["listed"])))
    assert (bases["listed"] < 0).any()
    assert (bases["listed"] >= 0).any()


def listed_up_to(reach: float) -> Crossings:
    chains = INDEX.sweep.chains
    found = np.array([(*pair, 0) for pair in sorted(twin_of_crossings.crossings_of(chains, reach))], CROSSING)
    return listed(chains, found, reach)


def test_few_bases_are_weighed() -> None:
    d = drawn(3)
    plan = plan_of(d.scan, len(d.scan), INDEX.chains, INDEX.area, crossings=INDEX.crossings)
    for _ in range(4):
        planning.next_base(ASKED._replace(scan=d.scan), plan)
    assert 4 <= plan.bases["weighed"].sum() < 0.5 * len(plan.bases)


@given(SEEDS)
@settings(max_examples=20, deadline=None)
def test_plan_search(seed: int) -> None:
    """A scan of more segments than bases are made of, and of fewer."""
    d = drawn(seed)
    question, n = context_of(INDEX, scan_of(d.endpoints)).question(RULE), int(d.rng.integers(1, len(d.scan) + 1))
    samples, statistics = sampled(n, 16, d.rng), state_of().statistics
    noise = d.rng.gumbel(size=n * n if seed % 2 == 0 else 0)
    crossings = INDEX.crossings if seed % 3 else NOT_LISTED
    by = Sampling(INDEX.chains, INDEX.area, samples.orders, samples.ranks, math.log(REUSE), noise)
    plan = planning.plan_search(question, TABLES._replace(crossings=crossings), by, statistics[0])
    assert statistics[0]["bound"] == pytest.approx(d.scan["gain"].sum())
    again = plan_of(question.scan, n, INDEX.chains, INDEX.area, crossings=crossings)
    weighed = bases_of(question.scan, n, INDEX.chains, INDEX.area, crossings)
    weighed["merit"] += noise[: len(weighed)] if len(noise) else 0.0
    given = ["sliding", "crossing", "merit", "weighed", *(["listed"] if plan.random else [])]
    np.testing.assert_array_equal(plan.bases[given], (weighed if plan.random else again.bases)[given])
    swept = plan.random and bool((plan.bases["listed"] < 0).any())
    assert plan.costs.known[0] == swept
    for costs in (plan.costs, again.costs):
        planning.know_sweeps(question.scan, costs)
    for name in ("lines", "slides", "smooth", "scale"):
        np.testing.assert_equal(getattr(plan.costs, name), getattr(again.costs, name))
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


@given(SEEDS)
@settings(max_examples=20, deadline=None)
def test_what_makes_a_base_with_a_segment_is_left_out_where_that_slides(seed: int) -> None:
    """As far as such bases are planned: nothing that is nearly parallel, beyond the longest, or tells little."""
    scan = np.concatenate([uncertain(drawn(seed + k)) for k in range(6)])[: BASE_SEGMENTS + 8]
    sliding_one, shifts, later = int(seed % BASE_SEGMENTS), np.zeros(len(scan), np.int64), np.zeros(len(scan))
    sliding.leave_out_bases(scan, sliding_one, shifts, later)
    bases = planning.pair_up(scan, len(scan))
    pairs = {frozenset(pair) for pair in bases[["sliding", "crossing"]].tolist()}
    told = {frozenset((sliding_one, j)) for j in range(len(scan)) if twin.is_telling(scan, sliding_one, j)}
    left_out = [frozenset((sliding_one, j)) in pairs & told and j < BASE_SEGMENTS for j in range(len(scan))]
    assert (shifts < 0).tolist() == left_out
    counted = np.where(shifts < 0, 0.0, scan["gain"])
    np.testing.assert_allclose(later, [counted[j + 1 :].sum() for j in range(len(scan))])


def test_a_slide_needs_enough_without_what_makes_a_base_with_it() -> None:
    """Two sides of a room and the wall across: what is parallel has to come to enough alone."""
    index = index_of([[0.0, 0.0, 6.0, 0.0], [6.0, 4.0, 0.0, 4.0], [6.0, 0.0, 6.0, 4.0]])
    endpoints = [[-3.0, -2.0, 3.0, -2.0], [3.0, 2.0, -3.0, 2.0], [3.0, -2.0, 3.0, 2.0]]
    context = context_of(index, scan_of(endpoints))
    scan, kept = context.lines.rows, []
    longest = int(np.argmax(scan["length"]))
    for more in (-0.5, 0.5):
        parallel = scan["gain"][np.abs(scan["dx"] * scan["dy"][longest] - scan["dy"] * scan["dx"][longest]) < 0.1].sum()
        rules = RULE.copy()
        rules["kept_share"] = 1.0
        state, question = state_of(9, parallel + more), context.question(rules)
        assert sliding.search_slides(question, index.tables, longest, state, context.workspace, 2.0)
        kept.append(int(state.statistics["verified"][0]))
    assert kept[0] > 0
    assert kept[1] == 0
