"""Plans of searches, and the bases in them, for tests of what goes through them."""

from __future__ import annotations

import math

import numpy as np

from association.index.grids import listed
from association.layout import CROSSING, FIGURE, LISTED, RULES, record
from association.search.kernels import planning
from association.search.kernels.looking_up import look_up
from association.search.kernels.sweeping import measure
from association.search.planning_tables import Costs, Plan, Samples
from association.tables import Crossings, Walls
from association.tuning import MOST_LISTS, REUSE
from registration.layout import Records

from .drawn import ASKED, GATES, INDEX

NOT_LISTED = listed(INDEX.sweep.runs, np.zeros(0, CROSSING), -1.0)  # so that every base is swept

RULE = record(RULES, kept_share=0.65, distinct_distance=0.3, distinct_angle=0.1, rival_share=0.95, enough=np.inf)


def sampled(n: int, count: int, rng: np.random.Generator) -> Samples:
    orders = rng.permuted(np.tile(np.arange(n, dtype=np.uint8), (count, 1)), axis=1)
    ranks = np.ascontiguousarray(orders.argsort(axis=1).T, dtype=np.uint8)
    found, sizes, gains = np.full(count, n, np.uint8), np.zeros(count, np.uint8), np.zeros(count)
    return Samples(orders, ranks, found, sizes, gains, np.arange(count + 1, dtype=np.int32))


def plan_of(
    scan: Records, n: int, runs: Walls, area: float, *, crossings: Crossings = NOT_LISTED, by_chance: bool = False
) -> Plan:
    """Return the plan of a search with bases of the first n segments, none of them weighed yet."""
    return Plan(
        bases=planning.pair_up(scan, n),
        costs=costs_of(n, runs, area, crossings),
        uses=np.zeros(n),
        residual=scan["gain"].copy(),
        best_gains=-np.sort(-scan["gain"][:n]),
        freest=np.argsort(-scan["freedom"], kind="stable"),
        samples=sampled(n, 512, np.random.default_rng(0)),
        fade=0.0 if by_chance else math.log(REUSE),
        random=by_chance,
    )


def costs_of(count: int, runs: Walls, area: float, crossings: Crossings = NOT_LISTED) -> Costs:
    """Return what the bases of the first `count` segments of a scan cost."""
    return planning.costs_of(count, runs, area, crossings)


def bases_of(scan: Records, count: int, runs: Walls, area: float, crossings: Crossings = NOT_LISTED) -> Records:
    """Return the bases of the first `count` segments of a scan, all of them weighed."""
    bases, question = planning.pair_up(scan, count), ASKED._replace(scan=scan)
    planning.weigh_all(question, bases, costs_of(count, runs, area, crossings), np.zeros(len(bases)))
    return bases


def entries_of(scan: Records, base: tuple[int, int], crossings: Crossings) -> int:
    """Return how many crossings are on the lists of a base, or -1."""
    figure, lists = record(FIGURE), np.zeros(MOST_LISTS, LISTED)
    measure(scan[base[0]], scan[base[1]], GATES[0], figure[0])
    count, entries = look_up(figure[0], crossings, lists)
    assert entries < 0 or entries == sum(lists["end"][:count] - lists["begin"][:count])
    return int(entries)
