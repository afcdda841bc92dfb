"""Plans of searches, and the bases in them, for tests of what goes through them."""

from __future__ import annotations

import math

import numpy as np

from association.index.grids import listed
from association.layout import CROSSING, FIGURE, FOUND, RULES, record
from association.search.kernels import bases as planning
from association.search.kernels.lookup import look_up
from association.search.kernels.sweeping import measure
from association.search.layout import BEST, LISTED, STATISTICS
from association.search.tables import Costs, Plan, Samples, SearchState
from association.search.tuning import MOST_LISTS, REUSE
from association.tables import Crossings, Walls
from registration.layout import Records

from .drawn import ASKED, GATES, INDEX

NOT_LISTED = listed(INDEX.sweep.chains, np.zeros(0, CROSSING), -1.0)  # so that every base is swept

RULE = record(RULES, kept_share=0.65, distinct_distance=0.3, distinct_angle=0.1, rival_share=0.95, enough=np.inf)


def state_of(stored: int = 20_000, best_value: float = 0.0) -> SearchState:
    """Return the state of a search that has just begun, with room for so many poses."""
    statistics = record(STATISTICS, missed=1.0)
    return SearchState(np.zeros(stored, FOUND), record(BEST, best_value=best_value), statistics, np.zeros(1, np.uint8))


def stored_in(state: SearchState) -> Records:
    """Return the best poses of a search so far."""
    return state.poses[: int(state.best["count"][0])]


def sampled(n: int, count: int, rng: np.random.Generator) -> Samples:
    orders = rng.permuted(np.tile(np.arange(n, dtype=np.uint8), (count, 1)), axis=1)
    ranks = np.ascontiguousarray(orders.argsort(axis=1).T, dtype=np.uint8)
    found, sizes, gains = np.full(count, n, np.uint8), np.zeros(count, np.uint8), np.zeros(count)
    return Samples(orders, ranks, found, sizes, gains, np.arange(count + 1, dtype=np.int32))


def plan_of(
    scan: Records, n: int, chains: Walls, area: float, *, crossings: Crossings = NOT_LISTED, by_chance: bool = False
) -> Plan:
    """Return the plan of a search with bases of the first n segments, none of them weighed yet."""
    return Plan(
        bases=planning.pair_up(scan, n),
        costs=costs_of(n, chains, area, crossings),
        uses=np.zeros(n),
        residual=scan["gain"].copy(),
        best_gains=-np.sort(-scan["gain"][:n]),
        freest=np.argsort(-scan["freedom"], kind="stable"),
        samples=sampled(n, 512, np.random.default_rng(0)),
        fade=0.0 if by_chance else math.log(REUSE),
        random=by_chance,
    )


def costs_of(count: int, chains: Walls, area: float, crossings: Crossings = NOT_LISTED) -> Costs:
    """Return what the bases of the first `count` segments of a scan cost."""
    return planning.costs_of(count, chains, area, crossings)


def bases_of(scan: Records, count: int, chains: Walls, area: float, crossings: Crossings = NOT_LISTED) -> Records:
    """Return the bases of the first `count` segments of a scan, all of them weighed."""
    bases, question = planning.pair_up(scan, count), ASKED._replace(scan=scan)
    planning.weigh_all(question, bases, costs_of(count, chains, area, crossings), np.zeros(len(bases)))
    return bases


def entries_of(scan: Records, base: tuple[int, int], crossings: Crossings) -> int:
    """Return how many crossings are on the lists of a base, or -1."""
    figure, lists = record(FIGURE), np.zeros(MOST_LISTS, LISTED)
    measure(scan[base[0]], scan[base[1]], GATES[0], figure[0])
    count, entries = look_up(figure[0], crossings, lists)
    assert entries < 0 or entries == sum(lists["end"][:count] - lists["begin"][:count])
    return int(entries)
