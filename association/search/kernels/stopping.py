"""Compiled stopping rule: whether a better consensus set may have been missed, by a bound and by sampled sets."""

import math

from compiled import kernel
from registration.layout import Floats, Record, Records

from ...layout import Integers
from ...tables import Question
from ..layout import CONFIDENT, GOES_ON, PROVEN
from ..tables import Plan, Samples, SearchState
from .bases import is_telling, middle_of


@kernel
def why_stop(question: Question, plan: Plan, base: Record, state: SearchState, allowed: float) -> int:
    """Return why a search ends after a base, `GOES_ON` where it does not.

    It ends if the best value is enough. It ends if the bound on the gain of a pose without any of the bases so far is
    too low for an alternative. It also ends if the probability of having missed such a set is at most
    `allowed`. That of a search in order is the fraction of sampled sets that hold none of the bases; of a random one it
    follows from the number of draws. With `allowed` below 0 all bases are searched.
    """
    scan = question.scan
    rules = question.rules[0]
    best = state.best[0]
    statistics = state.statistics[0]
    best.least_freedom = least_freedom(scan, plan.freest, rules.kept_share * best.best_value)
    needed = needed_of(question, plan, best.best_value)
    if is_telling(scan[base.sliding], scan[base.crossing], middle_of(scan)):
        count_base(question, plan, base, needed, allowed, statistics)
    if best.best_value >= rules.enough:
        return CONFIDENT
    if allowed >= 0.0 and statistics.bound < needed:
        return PROVEN
    if allowed >= 0.0 and statistics.missed <= allowed:
        return CONFIDENT
    return GOES_ON


@kernel
def count_base(question: Question, plan: Plan, base: Record, needed: float, allowed: float, statistics: Record) -> None:
    """Lower the bound, and the probability of having missed a set that gains `needed`, by a base that was searched."""
    scan = question.scan
    a = base.sliding
    b = base.crossing
    beyond = gain_beyond(scan, plan)
    statistics.bound -= cover(plan.residual, a, b)
    fewest = fewest_segments(plan.best_gains, beyond, needed)
    if plan.random:
        statistics.missed *= 1.0 - drawn_probability(fewest, len(plan.best_gains))
        return
    strike(plan.samples, a, b)
    count = len(plan.samples.found)
    # It need not be known by how much the probability is too large.
    most = math.floor(allowed * count) if allowed >= 0.0 else -1
    statistics.missed = missed_sets(scan, plan.samples, fewest, needed - beyond, most) / count


@kernel
def cover(residual: Floats, a: int, b: int) -> float:
    """Return by how much a base lowers the bound on what a pose can score that contains none of the bases so far.

    Such a pose lacks one segment of each base. The greedy packing of the gains over the bases is a feasible solution of
    the dual of that covering problem, so the bound holds. `residual` (n,) is what is left of each gain.
    """
    less = min(residual[a], residual[b])
    residual[a] -= less
    residual[b] -= less
    return less


@kernel
def restrict(drawn: Integers, orders: Integers, ranks: Integers) -> None:
    """Reduce equally likely orders of more segments to equally likely orders of the first n.

    Parameters
    ----------
    drawn : (s, m)
        Orders of m segments, at least n.
    orders : (s, n)
        Written: the segments below n in the same order.
    ranks : (n, s)
        Written: the places of each segment in them.
    """
    n = orders.shape[1]
    for s in range(len(orders)):
        place = k = 0
        while place < n:  # without a branch that is as often wrong as right: what does not stay is written over
            orders[s, place] = drawn[s, k]
            place += drawn[s, k] < n
            k += 1
        for place in range(n):
            ranks[orders[s, place], s] = place


@kernel
def strike(samples: Samples, a: int, b: int) -> None:
    """Note in the sampled consensus sets that a base was searched."""
    found = samples.found
    first = samples.ranks[a]
    second = samples.ranks[b]
    for s in range(len(found)):
        later = first[s] if first[s] > second[s] else second[s]
        found[s] = later if later < found[s] else found[s]


@kernel
def missed_sets(scan: Records, samples: Samples, fewest: int, needed: float, most: int) -> int:
    """Count the sampled consensus sets that hold none of the bases so far, up to one more than `most`.

    `fewest` and `needed` as in `is_decided`. A set that was found to hold a base is not looked at again.
    """
    undecided = samples.undecided
    count = len(samples.found)
    end = undecided[count]
    at = 0
    while at < end and at <= most:
        if is_decided(scan, samples, undecided[at], fewest, needed):
            end -= 1
            undecided[at] = undecided[end]
        else:
            at += 1
    undecided[count] = end
    return at


@kernel
def is_decided(scan: Records, samples: Samples, s: int, fewest: int, needed: float) -> bool:
    """Return whether a sampled set holds a base that was searched, or is none because all its gains are too little.

    A sample is an order of the segments of bases. Its set consists of the first of them, as many as gain `needed`, and
    `fewest` at least. Both may be more than before, never less: the set grows from what it was.
    """
    orders = samples.orders
    n = orders.shape[1]
    place = samples.found[s]
    if place < fewest:
        return True
    size = samples.sizes[s]
    gain = samples.gains[s]
    # A set that is larger than the place where the order has a base holds it, however large it has to be.
    while size <= place and size < n and (gain < needed or size < fewest):
        gain += scan[orders[s, size]].gain
        size += 1
    samples.sizes[s] = size
    samples.gains[s] = gain
    return place < size or gain < needed


@kernel
def fewest_segments(best_gains: Floats, beyond: float, needed: float) -> int:
    """Return how many of the first segments a consensus set has at least that scores `needed`.

    `best_gains` (n,): their gains, the largest first; `beyond`: what all other segments of the scan could add.
    """
    total = beyond
    for m in range(len(best_gains)):
        if total >= needed:
            return max(m, 2)
        total += best_gains[m]
    return max(len(best_gains), 2)


@kernel
def drawn_probability(fewest: int, count: int) -> float:
    """Return the probability that both segments of a base drawn among `count` are among `fewest` inliers."""
    return min(1.0, fewest * (fewest - 1) / max(1, count * (count - 1)))


@kernel
def least_freedom(scan: Records, freest: Integers, needed: float) -> float:
    """Return the least freedom that a consensus set takes whose gains reach `needed`, nats.

    The set has at least one of the lines without which the others do not reach it; `freest` (n,) are the lines, those
    that take most by themselves first.
    """
    rest = 0.0
    for i in range(len(scan)):
        rest += scan[i].gain
    for i in freest:
        rest -= scan[i].gain
        if rest < needed:
            return scan[i].freedom
    return 0.0


@kernel
def needed_of(question: Question, plan: Plan, best_value: float) -> float:
    """Return the least gain of a consensus set that scores as high as an alternative of the best, nats."""
    needed = question.rules[0].rival_share * best_value
    return needed + least_freedom(question.scan, plan.freest, needed)


@kernel
def gain_beyond(scan: Records, plan: Plan) -> float:
    """Return the gain of the segments of a scan of which no bases are made, nats."""
    beyond = 0.0
    for i in range(len(plan.best_gains), len(scan)):
        beyond += scan[i].gain
    return beyond


@kernel
def missed_fraction(question: Question, plan: Plan, best_value: float) -> float:
    """Return the fraction of the sampled consensus sets that hold none of the bases so far."""
    scan = question.scan
    needed = needed_of(question, plan, best_value)
    beyond = gain_beyond(scan, plan)
    count = len(plan.samples.found)
    fewest = fewest_segments(plan.best_gains, beyond, needed)
    return missed_sets(scan, plan.samples, fewest, needed - beyond, count) / count
