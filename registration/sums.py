"""Sums over pairs that are added and subtracted without a loss of precision: the base of both estimators' sums."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from .kernels.compensated import compensated_sum
from .layout import Floats, Records


@dataclass(frozen=True, slots=True, eq=False)
class CompensatedSums:
    """Sums over pairs, compensated (double-double): after any additions and removals they are those of what remains.

    Attributes
    ----------
    compensated : (2,) of records
        Values and their errors, read-only.
    """

    compensated: Records

    def __post_init__(self) -> None:
        self.compensated.setflags(write=False)

    def __add__(self, other: Self) -> Self:
        return self._combined(other, 1.0)

    def __sub__(self, other: Self) -> Self:
        return self._combined(other, -1.0)

    def _combined(self, other: Self, sign: float) -> Self:
        return replace(self, compensated=compensated_sum(self.compensated, other.compensated, sign))

    @property
    def values(self) -> Floats:
        """The sums in plain doubles, in the order of the record's fields."""
        return self.compensated[:1].view(np.float64)

    @property
    def count(self) -> int:
        """Number of pairs."""
        return round(float(self.compensated["count"][0]))
