"""The decorator of kernels, compiled or, where ``NUMBA_DISABLE_JIT`` is set, as plain Python.

The latter is for debuggers, coverage and mutation tests. A compiled kernel reads the fields of a record as attributes.
Plain elements of structured arrays have none; as `numpy.record` they have.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba
import numpy as np

from .cache import cache_directory

Function = TypeVar("Function", bound=Callable[..., Any])

SETTINGS: Any = numba.config


def kernel(function: Function) -> Function:
    """Compile a function at its first call and cache the machine code for later processes.

    The function runs without Python's global lock. Additions keep the order in which they are written. With
    ``NUMBA_DISABLE_JIT=1`` in the environment it stays plain Python.

    Parameters
    ----------
    function : callable
        A function of module level, in a module that `compiled.cache.sources` covers.

    Returns
    -------
    callable
        The same function, compiled. Python and other kernels can call it.
    """
    if SETTINGS.DISABLE_JIT:
        return interpreted(function)
    directory = cache_directory()
    # Numba reads the directory when a function is decorated; functions of other programs in this process keep theirs.
    former, SETTINGS.CACHE_DIR = SETTINGS.CACHE_DIR, str(directory or "")
    try:
        return cast(Function, numba.njit(cache=directory is not None, nogil=True, error_model="numpy")(function))
    finally:
        SETTINGS.CACHE_DIR = former


def interpreted(function: Function) -> Function:
    """Return a kernel that is not compiled and takes the arguments of a compiled one."""

    @functools.wraps(function)
    def run(*arguments: Any) -> Any:
        names = function.__globals__
        for name, value in names.items():
            names[name] = _record_type(value) if isinstance(value, np.dtype) else value
        return function(*map(with_attributes, arguments))

    return cast(Function, run)


def with_attributes(value: Any) -> Any:
    """Return records, arrays of them and tuples of both with their fields as attributes, without a copy."""
    if isinstance(value, np.ndarray | np.void) and value.dtype.names is not None:
        return value.view(_record_type(value.dtype))
    if isinstance(value, tuple):
        parts = map(with_attributes, value)
        return type(value)(*parts) if hasattr(value, "_fields") else tuple(parts)
    return value


def _record_type(dtype: np.dtype[Any]) -> np.dtype[Any]:
    return np.dtype((np.record, dtype)) if dtype.names is not None and dtype.type is np.void else dtype
