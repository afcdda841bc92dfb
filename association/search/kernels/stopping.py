"""Compiled stop of the search: when enough bases have been gone through, by a bound and by sampled consensus sets."""

from compiled import kernel
from registration.layout import Floats, Records

from ...layout import Integers
from ...tables import Question
from ..planning_tables import Plan, Samples


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
    """Leave of orders of more segments those of the first n; of all orders as likely they are all as likely.

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
    """Note in the sampled consensus sets that a base was gone through."""
    found = samples.found
    first = samples.ranks[a]
    second = samples.ranks[b]
    for s in range(len(found)):
        later = first[s] if first[s] > second[s] else second[s]
        found[s] = later if later < found[s] else found[s]


@kernel
def missed_sets(scan: Records, samples: Samples, fewest: int, needed: float, most: int) -> int:
    """Count the sampled consensus sets that hold none of the bases so far, up to one more than `most`.

    Each is an order of the segments of bases, and has as many of the first as come to gains of `needed`, `fewest` at
    least, which may be more than before, never less. An order whose gains do not come to it has no set. Where a set
    was found to hold a base it is not looked at any more.
    """
    orders = samples.orders
    found = samples.found
    sizes = samples.sizes
    gains = samples.gains
    undecided = samples.undecided
    n = orders.shape[1]
    left = 0
    at = 0
    end = undecided[len(found)]
    while at < end and left <= most:
        s = undecided[at]
        held = found[s] < fewest
        if not held:
            size = sizes[s]
            gain = gains[s]
            # One that is larger than the place where it has a base holds that, however large it has to be.
            while size <= found[s] and size < n and (gain < needed or size < fewest):
                gain += scan[orders[s, size]].gain
                size += 1
            sizes[s] = size
            gains[s] = gain
            held = found[s] < size or gain < needed
        if held:
            end -= 1
            undecided[at] = undecided[end]
        else:
            left += 1
            at += 1
    undecided[len(found)] = end
    return left


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
def drawn_chance(fewest: int, count: int) -> float:
    """Return the chance that both segments of a base drawn among `count` are among `fewest` inliers."""
    return min(1.0, fewest * (fewest - 1) / max(1, count * (count - 1)))


@kernel
def least_freedom(scan: Records, freest: Integers, needed: float) -> float:
    """Return what freedom a consensus set takes at least whose gains come to `needed`, nats.

    It has one of the lines at least without which the others do not come to that; `freest` (n,) are the lines, those
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
    """Return what the gains of a set come to at least that scores as high as a rival of the best."""
    needed = question.rules[0].rival_share * best_value
    return needed + least_freedom(question.scan, plan.freest, needed)


@kernel
def gain_beyond(scan: Records, plan: Plan) -> float:
    """Return what the segments of a scan could add of which no bases are made, nats."""
    beyond = 0.0
    for i in range(len(plan.best_gains), len(scan)):
        beyond += scan[i].gain
    return beyond


@kernel
def missed_share(question: Question, plan: Plan, progress: Records) -> float:
    """Return the share of the sampled consensus sets that hold none of the bases so far."""
    scan = question.scan
    needed = needed_of(question, plan, progress[0].best_value)
    beyond = gain_beyond(scan, plan)
    count = len(plan.samples.found)
    fewest = fewest_segments(plan.best_gains, beyond, needed)
    return missed_sets(scan, plan.samples, fewest, needed - beyond, count) / count
