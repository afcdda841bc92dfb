"""Arrays that kernels make are those that numpy makes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numba import njit

from registration.allocating import empty, zeros
from registration.layout import LINE, Records

ROWS = 3


@njit
def zeros_after_others(count: int) -> Any:
    """Make zeros where memory that was just given back holds something else."""
    for _ in range(8):
        used = empty(count, np.float64)
        for i in range(count):
            used[i] = 7.0
    return zeros(count, np.float64), zeros((count, 4), np.int32), zeros(count, LINE), zeros(count, np.bool_)


@njit
def filled(count: int) -> Any:
    lines, table, small = empty(count, LINE), empty((count, ROWS), np.float64), empty(2, np.uint8)
    for i in range(count):
        lines[i].offset = i
        for j in range(ROWS):
            table[i, j] = 10 * i + j
    small[0], small[1] = 255, 1
    return lines, table, small


def test_zeros_are_zeros() -> None:
    floats, table, lines, flags = zeros_after_others(1_000)
    for made, kind, shape in (
        (floats, np.float64, (1_000,)),
        (table, np.int32, (1_000, 4)),
        (lines, LINE, (1_000,)),
        (flags, np.bool_, (1_000,)),
    ):
        assert (made.dtype, made.shape, made.flags.c_contiguous) == (kind, shape, True)
        assert not made.view(np.uint8).any()


def test_what_is_written_to_empty_arrays_is_there() -> None:
    lines, table, small = filled(5)
    assert (lines.dtype, lines["offset"].tolist()) == (LINE, [0.0, 1.0, 2.0, 3.0, 4.0])
    assert (table == 10 * np.arange(5)[:, None] + np.arange(ROWS)).all()
    assert (small.dtype, small.tolist()) == (np.uint8, [255, 1])
    assert len(filled(0)[0]) == 0


def test_arrays_that_nobody_could_hold_are_refused() -> None:
    with pytest.raises(ValueError, match="too big"):
        filled(2**60)


def test_an_interpreted_kernel_has_arrays_of_numpy() -> None:
    made: Records = zeros(2, LINE)
    assert made.tolist() == np.zeros(2, LINE).tolist()
    assert empty((2, 3), np.int64).shape == (2, 3)
