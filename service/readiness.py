"""Readiness of the service for requests, for probes, which may come often and must not wait long."""

from __future__ import annotations

import asyncio

from .errors import ENDING, CorruptMapError, NotReadyError, StoreFullError
from .maps import MapStore
from .thread_pool import Threads

ANSWERS_WITHIN = 2.0  # s


class Readiness:
    """Refuse requests before the kernels are warm, and report the end of the service before it closes.

    It looks at the store in a thread of its own, and belongs to one event loop.

    Attributes
    ----------
    warm : bool
        True when the kernels are loaded.
    draining : bool
        True when the service is to end.
    compiled : float or None
        Compiled fraction of the kernels, 0 to 1; None before and after the compilation.
    """

    def __init__(self, store: MapStore) -> None:
        self.warm = False
        self.draining = False
        self.compiled: float | None = None
        self._store = store
        self._threads = Threads(1, "probe")
        self._looking: asyncio.Future[None] | None = None

    def require_warm(self) -> None:
        """Raise `NotReadyError` as long as nothing can be searched."""
        if not self.warm:
            state = "loaded" if self.compiled is None else f"compiled, {self.compiled:.0%} so far"
            raise NotReadyError(f"the kernels are being {state}; send the request again later")

    async def open_store(self) -> None:
        """Make sure that the store's tables exist; raises `StoreError` when they do not."""
        await self._threads.run(self._store.open)

    async def require_all(self) -> None:
        """Return when the kernels are loaded and the store answers; probes that come together share one look at it.

        Raises
        ------
        ReadOnlyStoreError, BusyStoreError, StoreAwayError, NotReadyError
            When requests should go elsewhere. The callers of maps need the kind of failure, full or damaged; a balancer
            treats all alike.
        """
        if self.draining:
            raise NotReadyError(ENDING)
        self.require_warm()
        if self._looking is None or self._looking.done():
            self._looking = asyncio.ensure_future(self.open_store())
        try:
            async with asyncio.timeout(ANSWERS_WITHIN):
                await asyncio.shield(self._looking)
        except TimeoutError:
            raise NotReadyError("the store does not respond; check that its database runs and is reachable") from None
        except (CorruptMapError, StoreFullError) as error:  # of no map that was asked for
            raise NotReadyError(str(error)) from error

    def close(self) -> None:
        """Give the thread back."""
        self._threads.close()
