"""Compiles functions: kernels, which Python or other kernels call, and what is written into them.

What comes of it is kept for later processes (`registration.kept_kernels`).
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from functools import partial, update_wrapper, wraps
from typing import Any, TypeVar, cast

from numba import njit, types

from .borrowing import borrowed as borrowed
from .interpreting import interpreted
from .kept_kernels import UNKNOWN_NUMBA, CalleeCache, KernelCache

try:
    from numba.core.dispatcher import Dispatcher

    from .code_libraries import CalleeCompiler, KernelCompiler
except ImportError as error:
    raise ImportError(UNKNOWN_NUMBA) from error

Function = TypeVar("Function", bound=Callable[..., Any])

CHECKED = "LINEFIX_CHECK_KERNELS"  # set, it has the types of what kernels are handed looked at each time
# The ways in that Numba makes of no use.
FROM_PYTHON: dict[str, Any] = {"no_cfunc_wrapper": True}
FROM_KERNELS: dict[str, Any] = {"no_cfunc_wrapper": True, "no_cpython_wrapper": True}


def kernel(function: Function) -> Function:
    """Compile a function when it is first called, without the interpreter's lock, and keep what comes of it.

    Additions are done in the order in which they are written.

    Parameters
    ----------
    function : callable
        Of a module in its package's ``kernels``. It closes over nothing.

    Raises
    ------
    TypeError
        When the function stands elsewhere: what is kept of it could go stale.
    """
    if function.__closure__:
        raise TypeError(f"kernel {function.__qualname__}: expected no variables of an enclosing function")
    compiled: Any = njit(nogil=True, pipeline_class=KernelCompiler, **FROM_PYTHON)(function)
    if not isinstance(compiled, Dispatcher):  # NUMBA_DISABLE_JIT is set
        return interpreted(function)
    if not hasattr(compiled, "_cache"):
        raise ImportError(UNKNOWN_NUMBA)
    called: Any = njit(nogil=True, pipeline_class=CalleeCompiler, **FROM_KERNELS)(function)
    compiled._cache, called._cache = KernelCache(function), CalleeCache(function)
    # Kernels that call it are handed the other one.
    compiled.get_call_template = partial(_call_template, called.get_call_template)  # type: ignore[method-assign]
    compiled.get_overload = called.get_overload  # type: ignore[method-assign]
    return cast(Function, compiled)


def internal(function: Function) -> Function:
    """Call a kernel from Python without a look at its arguments' types, once it is compiled.

    For those whose arguments the packages make themselves, each always of one type: to find out what it is of tables of
    forty arrays takes ten times as long as to hand them over, a tenth of a small answer in all. Other kernels cannot
    call it. Where `CHECKED` is set in the environment, as in the tests, the types are looked at all the same.

    Parameters
    ----------
    function : callable
        A kernel.

    Raises
    ------
    TypeError
        By the kernel, where types are looked at: it was called with arguments of other types before.
    """
    if not isinstance(function, Dispatcher):  # NUMBA_DISABLE_JIT is set
        return function
    entry: Callable[..., Any] | None = None
    variants: list[Any] = []

    @wraps(function)
    def call(*arguments: Any) -> Any:
        nonlocal entry, variants
        if entry is not None:
            return entry(*arguments)
        result = function(*arguments)
        if len(function.overloads) > len(variants):
            kinds = set(map(_layouts, function.signatures))
            if len(kinds) > 1:
                name = function.py_func.__qualname__
                raise TypeError(f"kernel {name}: expected arguments of one type each, got {kinds}")
            variants = list(function.overloads.values())
        if not os.environ.get(CHECKED):
            entry = variants[0].entry_point
        return result

    return cast(Function, call)


def way_in(function: Function) -> Function:
    """Call a kernel from Python that other kernels call as well, likewise: it is compiled once for both.

    Parameters
    ----------
    function : callable
        A kernel, as other kernels call it.
    """
    if not isinstance(function, Dispatcher):  # NUMBA_DISABLE_JIT is set
        return function

    def entry(arguments: tuple[Any, ...]) -> Any:
        return function(*arguments)

    update_wrapper(entry, function.py_func)
    vars(entry).pop("__wrapped__")  # whose parameters Numba would look for here
    compiled: Any = njit(nogil=True, pipeline_class=KernelCompiler, **FROM_PYTHON)(entry)
    compiled._cache = KernelCache(function.py_func)
    enter = internal(compiled)

    @wraps(function)
    def call(*arguments: Any) -> Any:
        return enter(arguments)

    return cast(Function, call)


def _layouts(kinds: Iterable[types.Type]) -> tuple[Any, ...]:
    """Return types but for whether arrays may be written to, which those that another process sent always may."""
    return tuple(
        kind.copy(readonly=False) if isinstance(kind, types.Array)
        else _layouts(tuple(cast(Any, kind))) if isinstance(kind, types.BaseTuple)
        else kind
        for kind in kinds
    )  # fmt: skip


def inlined(function: Function) -> Function:
    """Compile a small function into each kernel that calls it."""
    compiled = njit(inline="always")(function)
    return cast(Function, compiled) if isinstance(compiled, Dispatcher) else interpreted(function)


def _call_template(template: Callable[..., Any], args: tuple[types.Type, ...], kws: dict[str, types.Type]) -> Any:
    """Call a kernel from another one with a constant as with any number: it is not compiled once more for its sake."""
    plain: Callable[[types.Type], types.Type] = types.unliteral
    return template(tuple(map(plain, args)), {name: plain(kind) for name, kind in kws.items()})
