"""Compiled selection. Numba takes seconds to compile `np.partition`, most of it for the words of its errors."""

from compiled import kernel
from registration.layout import Floats


@kernel
def select(values: Floats, k: int) -> None:
    """Put the k-th least of the values (n,) in its place, those before it being no greater, those behind it no less.

    By Hoare's FIND (1961); 0 <= k < n, none of the values nan.
    """
    low = 0
    high = len(values) - 1
    while low < high:
        pivot = values[k]
        i = low
        j = high
        while i <= j:
            while values[i] < pivot:
                i += 1
            while pivot < values[j]:
                j -= 1
            if i <= j:
                values[i], values[j] = values[j], values[i]
                i += 1
                j -= 1
        if j < k:
            low = i
        if k < i:
            high = j
