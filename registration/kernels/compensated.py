"""Sums in double-double arithmetic: an array of two records, the values and their errors.

After any number of additions and removals they are the sums of what remains; what is lost is 2^-104 of the largest
number that ever stood there.
"""

from __future__ import annotations

import numpy as np

from compiled import kernel

from ..layout import Records


@kernel
def accumulated(value: float, error: float, high: float, low: float) -> tuple[float, float]:
    """Return value and error of a sum after ``high + low`` was added to it."""
    total = value + high
    back = total - value
    lost = (value - (total - back)) + (high - back) + (error + low)
    result = total + lost
    return result, lost - (result - total)


@kernel
def compensated_sum(sums: Records, other: Records, sign: float) -> Records:
    """Return whole compensated sums with others of the same type added (`sign` 1) or removed (-1)."""
    total = sums.copy()
    into = total.view(np.float64)
    what = other.view(np.float64)
    size = len(into) // 2
    for k in range(size):
        into[k], into[size + k] = accumulated(into[k], into[size + k], sign * what[k], sign * what[size + k])
    return total
