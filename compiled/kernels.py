"""The decorators of kernels."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar, cast

import numba

from .cache import cache_directory
from .interpreting import interpreted

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
    with _cached_in(directory):
        decorate = numba.njit(cache=directory is not None, nogil=True, error_model="numpy")
        return cast(Function, decorate(function))


@contextmanager
def _cached_in(directory: Path | None) -> Iterator[None]:
    """Set Numba's cache directory while a function is decorated, which is when Numba reads it.

    Functions that other programs in this process compile keep the directory that their own settings name.
    """
    former = SETTINGS.CACHE_DIR
    SETTINGS.CACHE_DIR = "" if directory is None else str(directory)
    try:
        yield
    finally:
        SETTINGS.CACHE_DIR = former
