"""Compiled functions (kernels): the `kernel` decorator, and the directory where compiled code is cached.

Numba is used by its public interface only. A kernel is a plain ``numba.njit`` function that runs without Python's
global lock and whose machine code is cached for later processes.
"""

from .cache import cache_directory, compiled_fraction, is_complete, mark_complete
from .kernels import kernel

__all__ = ["cache_directory", "compiled_fraction", "is_complete", "kernel", "mark_complete"]
