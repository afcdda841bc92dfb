"""Arrays in kernels to which no references are counted."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from numba import types
from numba.extending import lower_builtin, type_callable

Value = TypeVar("Value")


def borrowed(value: Value) -> Value:
    """Return arrays, or tuples of them, as they are, for a kernel that counts no references to them.

    Numba counts references to each array that is taken from a tuple or handed on, atomically, which for threads that
    search one map comes to waiting for one another. Whoever called the kernel holds what it is handed until it returns:
    nothing that it borrowed, nor any part of it, may it return or write to where it is kept.
    """
    return value


def _uncounted(context: Any, builder: Any, kind: types.Type, value: Any) -> Any:
    if isinstance(kind, types.Array):
        array = context.make_array(kind)(context, builder, value)
        array.meminfo = array.meminfo.type(None)
        return array._getvalue()
    if isinstance(kind, types.BaseTuple):
        members: Any = kind
        for place, member in enumerate(members):
            part = _uncounted(context, builder, member, builder.extract_value(value, place))
            value = builder.insert_value(value, part, place)
    return value


# By itself and not as a function that is compiled into each kernel: that took a fortieth of a first start.
@type_callable(borrowed)
def _type_borrowed(_: Any) -> Callable[[types.Type], types.Type]:
    return lambda value: value


@lower_builtin(borrowed, types.Any)  # type: ignore[no-untyped-call, untyped-decorator]
def _lower_borrowed(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    return _uncounted(context, builder, signature.args[0], arguments[0])
