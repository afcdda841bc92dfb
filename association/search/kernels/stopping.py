"""Count sampled consensus sets that hold none of the bases that were searched."""

from __future__ import annotations

from compiled import kernel
from registration.layout import Floats

from ...tables import Samples


@kernel
def count_missed(samples: Samples, one: int, other: int, gains: Floats, needed: float, most: int) -> int:
    """Strike the samples that hold a base, and count those left over, up to one more than `most`.

    A sample is an order of the lines: its set are the first of them whose gains reach `needed`, nats. A set that holds
    a base is decided for good, for a larger one holds it, too. Samples that are decided are not looked at again.
    """
    orders = samples.orders
    first = samples.ranks[one]
    second = samples.ranks[other]
    found = samples.found
    sizes = samples.sizes
    reached = samples.gains
    open_ones = samples.open_ones
    n = orders.shape[1]
    count = len(found)
    for s in range(count):  # without a branch, so that many are compared at once
        later = first[s] if first[s] > second[s] else second[s]
        found[s] = later if later < found[s] else found[s]
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
