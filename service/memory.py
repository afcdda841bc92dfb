"""Giving memory back: large arrays come and go with every large map, and have to leave no holes."""

from __future__ import annotations

import ctypes

_MMAP_THRESHOLD = -3  # of mallopt(3)
_ARENA_MAX = -8
_LARGE = 1 << 20  # bytes


def return_large_blocks() -> None:
    """Have every large block mapped separately, so that the system has it back when it is freed; glibc only.

    Otherwise glibc stops this with the first large block that is freed, and keeps the heap that they then lie in. That
    takes three times the memory after some maps of 16 MB. And each thread would get a heap of its own, with its own
    holes. Of two heaps there is always one free, since a thread that allocates much holds Python's lock.
    """
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is not None:
        mallopt(_MMAP_THRESHOLD, _LARGE)
        mallopt(_ARENA_MAX, 2)


def return_free_pages() -> None:
    """Have the system take back what the start has freed; glibc only."""
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)
