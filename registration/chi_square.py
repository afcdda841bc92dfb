"""Quantiles of chi-square."""

from __future__ import annotations

from functools import lru_cache

from scipy.special import chdtri


@lru_cache(maxsize=4096)
def chi_square_quantile(dof: int, tail: float) -> float:
    """Return what chi-square of `dof` degrees of freedom exceeds with the chance `tail`."""
    return float(chdtri(dof, tail))
