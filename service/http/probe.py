"""State of the store, for probes, which may come often and must not wait long."""

from __future__ import annotations

import asyncio

from ..errors import BusyStoreError, NotReadyError, ReadOnlyStoreError, StoreAwayError, StoreError
from ..maps import MapStore
from ..thread_pool import Threads

ANSWERS_WITHIN = 2.0  # s


class StoreProbe:
    """Looks at the store in a thread of its own; belongs to one event loop."""

    def __init__(self, store: MapStore) -> None:
        self._store = store
        self._threads = Threads(1, "probe")
        self._looking: asyncio.Future[None] | None = None

    async def open(self) -> None:
        """Make sure that the store's tables exist; raises `StoreError` when they do not."""
        await self._threads.run(self._store.open)

    async def check(self) -> None:
        """Return when the store answers; probes that come together share one look.

        Raises
        ------
        ReadOnlyStoreError, BusyStoreError, StoreAwayError, NotReadyError
            The callers of maps need the kind of failure, full or damaged; a balancer treats all alike.
        """
        if self._looking is None or self._looking.done():
            self._looking = asyncio.ensure_future(self.open())
        try:
            async with asyncio.timeout(ANSWERS_WITHIN):
                await asyncio.shield(self._looking)
        except TimeoutError:
            raise NotReadyError("the store does not respond; check that its database runs and is reachable") from None
        except (ReadOnlyStoreError, BusyStoreError, StoreAwayError):
            raise
        except StoreError as error:
            raise NotReadyError(str(error)) from error

    def close(self) -> None:
        """Give the thread back."""
        self._threads.close()
