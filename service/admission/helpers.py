"""Threads that take part in a long search, as long as fewer run than may."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor


class HelperThreads:
    """See `association.options.Helpers`; used from the threads of searches.

    Parameters
    ----------
    most : int
        Threads.
    spare : callable
        Tells how many slots nobody uses.
    """

    def __init__(self, most: int, spare: Callable[[], int]) -> None:
        self._most, self._spare = most, spare
        self._executor = ThreadPoolExecutor(most, "helper")
        self._lock = threading.Lock()
        self._running = 0

    @property
    def free(self) -> bool:
        """Whether one more would begin at once."""
        return self._running < min(self._most, self._spare())

    @property
    def welcome(self) -> bool:
        """Whether those that have begun may go on."""
        return self._running <= self._spare()

    def run(self, function: Callable[[], None]) -> Future[None]:
        """Run a function in one of them."""
        with self._lock:
            self._running += 1
        asked = self._executor.submit(function)
        asked.add_done_callback(self._end)  # also of one that is cancelled before it begins
        return asked

    def _end(self, _: Future[None]) -> None:
        with self._lock:
            self._running -= 1

    def close(self) -> None:
        """Give the threads back; does not wait for them."""
        self._executor.shutdown(wait=False)
