"""Lets Numba load compiled kernels from a directory that it cannot write to; for the image.

Each of Numba's own locators tries to write a file first, and where none succeeds the import of a kernel fails. This one
takes ``NUMBA_CACHE_DIR`` as it is. The image names it in ``NUMBA_CACHE_LOCATOR_CLASSES``.
"""

from __future__ import annotations

from typing import Any

from numba.core.caching import CompileResultCacheImpl, UserProvidedCacheLocator


class ReadOnlyLocator(UserProvidedCacheLocator):
    """Finds what was compiled ahead."""

    def ensure_cache_path(self) -> None:
        """Do not try to write."""


def _keep_in_memory(impl: CompileResultCacheImpl, result: Any) -> bool:
    """Say of a kernel that was not compiled ahead that it cannot be cached: it then works, from memory."""
    return False


CompileResultCacheImpl.check_cachable = _keep_in_memory
