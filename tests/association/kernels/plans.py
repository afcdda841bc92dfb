"""Plans of searches, and the bases in them, for tests of what goes through them."""

from __future__ import annotations

import math

import numpy as np

from association.kernels import planning
from association.layout import RULES, record
from association.tables import Plan, Samples, Walls
from association.tuning import REUSE
from registration.layout import Records

RULE = record(RULES, kept_share=0.65, distinct_distance=0.3, distinct_angle=0.1, rival_share=0.95, enough=np.inf)


def sampled(n: int, count: int, rng: np.random.Generator) -> Samples:
    orders = rng.permuted(np.tile(np.arange(n, dtype=np.uint8), (count, 1)), axis=1)
    ranks = np.ascontiguousarray(orders.argsort(axis=1).T, dtype=np.uint8)
    found, sizes, gains = np.full(count, n, np.uint8), np.zeros(count, np.uint8), np.zeros(count)
    return Samples(orders, ranks, found, sizes, gains, np.arange(count + 1, dtype=np.int32))


def plan_of(scan: Records, n: int, runs: Walls, area: float, *, by_chance: bool = False) -> Plan:
    """Return the plan of a search with bases of the first n segments, none of them weighed yet."""
    costs = planning.costs_of(scan, n, runs, area)
    return Plan(
        bases=planning.list_bases(scan, costs),
        costs=costs,
        uses=np.zeros(n),
        residual=scan["gain"].copy(),
        best_gains=-np.sort(-scan["gain"][:n]),
        freest=np.argsort(-scan["freedom"], kind="stable"),
        samples=sampled(n, 512, np.random.default_rng(0)),
        fade=0.0 if by_chance else math.log(REUSE),
        random=by_chance,
    )


def bases_of(scan: Records, count: int, runs: Walls, area: float) -> Records:
    """Return the bases of the first `count` segments of a scan, all of them weighed."""
    costs = planning.costs_of(scan, count, runs, area)
    bases = planning.list_bases(scan, costs)
    planning.weigh_all(bases, costs, np.zeros(len(bases)))
    return bases
