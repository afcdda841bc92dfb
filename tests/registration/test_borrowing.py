"""What a kernel borrows is what it was handed, and nobody counts who refers to it."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit, types
from numba.extending import intrinsic

from registration.compiling import borrowed
from registration.layout import Floats


class Inner(NamedTuple):
    rows: Floats
    factor: float


class Outer(NamedTuple):
    inner: Inner
    out: Floats


def _is_counted(_: Any, array: types.Array) -> Any:
    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        owner = context.make_array(signature.args[0])(context, builder, arguments[0]).meminfo
        return builder.icmp_unsigned("!=", owner, owner.type(None))

    return types.boolean(array), codegen


is_counted: Any = intrinsic(_is_counted)
"""Whether references to an array are counted."""


def _look(handed: Outer) -> tuple[bool, bool, bool]:
    value = borrowed(handed)
    for i in range(len(value.inner.rows)):
        value.out[i] = value.inner.factor * value.inner.rows[i]
    return is_counted(handed.out), is_counted(value.out), is_counted(value.inner.rows)


look: Any = njit(_look)


def test_tuples_of_arrays_are_borrowed() -> None:
    handed = Outer(Inner(np.arange(4.0), 2.0), np.zeros(4))
    assert look(handed) == (True, False, False)
    assert handed.out.tolist() == [0.0, 2.0, 4.0, 6.0]


def test_an_interpreted_kernel_has_what_it_was_handed() -> None:
    rows = np.arange(4.0)
    assert borrowed(rows) is rows
