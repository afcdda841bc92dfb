"""Arrays that kernels make.

As `numpy.empty` and `numpy.zeros`, which Numba compiles as a function of its own for each type of array: a tenth of a
first start. These are made where they stand.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
from numba import types
from numba.extending import lower_builtin, type_callable
from numpy.typing import NDArray

from .kept_kernels import UNKNOWN_NUMBA

try:
    from numba.core.cgutils import memset, unpack_tuple
    from numba.core.typing.npydecl import parse_dtype
    from numba.np.arrayobj import _empty_nd_impl
except ImportError as error:
    raise ImportError(UNKNOWN_NUMBA) from error

Scalar = TypeVar("Scalar", bound=np.generic)


def empty(shape: int | tuple[int, int], kind: type[Scalar] | np.dtype[Scalar]) -> NDArray[Scalar]:
    """Return an array of one or two dimensions, with whatever is in its memory."""
    return np.empty(shape, kind)


def zeros(shape: int | tuple[int, int], kind: type[Scalar] | np.dtype[Scalar]) -> NDArray[Scalar]:
    """Return an array of one or two dimensions, full of zeros."""
    return np.zeros(shape, kind)


@type_callable(empty)
@type_callable(zeros)
def _type_array(_: Any) -> Callable[[types.Type, types.Type], types.Type]:
    def typed(shape: types.Type, kind: types.Type) -> types.Type:
        dimensions = len(shape) if isinstance(shape, types.BaseTuple) else 1
        element: types.Type = parse_dtype(kind)
        return types.Array(element, dimensions, "C")

    return typed


@lower_builtin(empty, types.Any, types.Any)  # type: ignore[untyped-decorator]
def _lower_empty(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    return _allocated(context, builder, signature, arguments)._getvalue()


@lower_builtin(zeros, types.Any, types.Any)  # type: ignore[untyped-decorator]
def _lower_zeros(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    array = _allocated(context, builder, signature, arguments)
    memset(builder, array.data, builder.mul(array.itemsize, array.nitems), 0)
    return array._getvalue()


def _allocated(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    kind, value = signature.args[0], arguments[0]
    many = isinstance(kind, types.BaseTuple)
    kinds, values = (kind, unpack_tuple(builder, value)) if many else ((kind,), [value])
    counts = [context.cast(builder, value, kind, types.intp) for kind, value in zip(kinds, values, strict=True)]
    return _empty_nd_impl(context, builder, signature.return_type, counts)
