"""The limit up to which lines count as parallel, by noise alone."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from .chi_square import chi_square_quantile
from .layout import Floats

THREE_SIGMA_TAIL = math.erfc(3.0 / math.sqrt(2.0))


def most_parallel(count: int) -> float:
    """Return the chi-square of their angles up to which so many lines are parallel; inf for fewer than two."""
    return chi_square_quantile(count - 1, THREE_SIGMA_TAIL) if count > 1 else math.inf


def most_parallel_up_to(count: int) -> Floats:
    """Return the same for each number of lines up to `count` and at most twice as many, (k,)."""
    return _most_parallel(1 << count.bit_length())


@lru_cache
def _most_parallel(count: int) -> Floats:
    most = np.array([most_parallel(k) for k in range(count)])
    most.setflags(write=False)
    return most
