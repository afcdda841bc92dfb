"""Draw bases until no consensus set is likely to hold none of them."""

from __future__ import annotations

import math

from compiled import kernel

from ...layout import Integers
from ...tables import Drawing


@kernel
def draw_bases(drawing: Drawing, needed: float, hit: float, allowed: float, bases: Integers) -> int:
    """Draw the next bases, until the stopping rule ends it or `bases` is full; return how many.

    `Bases` says why no more have to be drawn.

    Parameters
    ----------
    drawing : Drawing
        Changed in place.
    needed : float
        The gains, nats, that a set comes to at least which is not to be missed.
    hit : float
        Probability that a base drawn at random is in such a set; 0 where samples of sets are counted.
    allowed : float
        Probability of having missed such a set, that is allowed; -1: all bases are drawn.
    bases : (b, 2)
        Written: the lines that slide and cross.
    """
    merits, telling, costs = drawing.merits, drawing.telling, drawing.costs
    left, state = drawing.left, drawing.state[0]
    lines = len(costs)
    count = 0
    while True:
        if len(drawing.found):
            state.missed = count_missed(drawing, needed - state.beyond, allowed) / len(drawing.found)
        if count == len(bases) or (allowed >= 0.0 and (state.bound < needed or state.missed <= allowed)):
            return count
        i = j = 0
        for one in range(lines):
            for other in range(one + 1, lines):
                if merits[one, other] > merits[i, j]:
                    i, j = one, other
        if i == j:
            return count
        merits[i, j] = -math.inf
        for k in range(lines):
            merits[min(i, k), max(i, k)] += state.fade
            merits[min(j, k), max(j, k)] += state.fade
        slides = costs[i] <= costs[j]
        bases[count, 0] = i if slides else j
        bases[count, 1] = j if slides else i
        count += 1
        if telling[i, j]:
            less = min(left[i], left[j])
            left[i] -= less
            left[j] -= less
            state.bound -= less
            state.missed *= 1.0 - hit
            strike(drawing, i, j)


@kernel
def strike(drawing: Drawing, one: int, other: int) -> None:
    """Note for each sample at which of its lines it holds a base that was drawn."""
    first, second, found = drawing.ranks[one], drawing.ranks[other], drawing.found
    for s in range(len(found)):  # without a branch, so that many are compared at once
        later = first[s] if first[s] > second[s] else second[s]
        found[s] = later if later < found[s] else found[s]


@kernel
def count_missed(drawing: Drawing, needed: float, allowed: float) -> int:
    """Count the samples that hold no base, up to one more than are allowed.

    A sample is an order of the lines: its set are the first of them whose gains reach `needed`, nats. A set that holds
    a base is decided for good, for a larger one holds it, too. Samples that are decided are not looked at again.
    """
    orders, gains, found = drawing.orders, drawing.gains, drawing.found
    sizes, reached, open_ones = drawing.sizes, drawing.reached, drawing.open_ones
    n, count = orders.shape[1], len(found)
    most = allowed * count if allowed >= 0.0 else count
    end = open_ones[count]
    at = 0
    while at < end and at <= most:
        s = open_ones[at]
        size = sizes[s]
        gain = reached[s]
        while size <= found[s] and size < n and gain < needed:
            gain += gains[orders[s, size]]
            size += 1
        sizes[s] = size
        reached[s] = gain
        if found[s] < size or gain < needed:
            end -= 1
            open_ones[at] = open_ones[end]
        else:
            at += 1
    open_ones[count] = end
    return at
