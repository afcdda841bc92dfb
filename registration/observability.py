"""The limit up to which lines count as parallel, by noise alone."""

from __future__ import annotations

import math

from .chi_square import chi_square_quantile

THREE_SIGMA_TAIL = math.erfc(3.0 / math.sqrt(2.0))


def most_parallel(count: int) -> float:
    """Return the chi-square of their angles up to which so many lines are parallel; inf for fewer than two."""
    return chi_square_quantile(count - 1, THREE_SIGMA_TAIL) if count > 1 else math.inf
