"""Who may search now: at most one search per core, a short queue, and no for the rest."""

from __future__ import annotations

import asyncio
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

from association import Deadline

from .problems import ProblemError

T = TypeVar("T")


class SearchGate:
    """Runs functions in threads of its own, a bounded number at a time and a bounded number waiting.

    Belongs to one event loop.

    Parameters
    ----------
    slots : int
        Searches that run at once.
    queue : int
        Searches that may wait.
    """

    def __init__(self, slots: int, queue: int) -> None:
        self.slots = slots
        self._queue = queue
        self._executor = ThreadPoolExecutor(slots, thread_name_prefix="search")
        self._waiting: deque[asyncio.Future[None]] = deque()
        self._deadlines: dict[asyncio.Future[Any], Deadline] = {}
        self.running = 0

    @property
    def waiting(self) -> int:
        """How many wait."""
        return len(self._waiting)

    def refuse_when_full(self) -> None:
        """Raise when a request that came now could not even wait."""
        if self.running >= self.slots and self.waiting >= self._queue:
            raise ProblemError(
                "overloaded", "every core is searching and the queue is full", headers={"Retry-After": "1"}
            )

    async def run(self, function: Callable[[], T], deadline: Deadline, *, admitted: bool = False) -> T:
        """Run a function when its turn comes.

        A caller that is cancelled leaves the queue; what already runs keeps its slot until it returns, so that there
        are never more running than slots. Cancel the deadline to make it return soon. With `admitted` it waits however
        long the queue is: for the further parts of a request that was let in.

        Raises
        ------
        ProblemError
            When the queue is full, or the deadline passes before the turn comes.
        """
        await self._enter(deadline, admitted)
        try:
            work = asyncio.get_running_loop().run_in_executor(self._executor, function)
        except BaseException:
            self._leave()
            raise
        self._deadlines[work] = deadline
        work.add_done_callback(self._finish)
        return await asyncio.shield(work)

    def cancel_all(self) -> None:
        """Tell everything that runs to give up."""
        for deadline in self._deadlines.values():
            deadline.cancel()

    def close(self) -> None:
        """Give the threads back; does not wait for them."""
        self._executor.shutdown(wait=False, cancel_futures=True)

    async def _enter(self, deadline: Deadline, admitted: bool) -> None:
        if deadline.passed:
            raise too_late()
        if self.running < self.slots and not self._waiting:
            self.running += 1
            return
        if not admitted:
            self.refuse_when_full()
        turn: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._waiting.append(turn)
        left = None if deadline.at is None else max(0.0, deadline.at - time.monotonic())
        try:
            await asyncio.wait({turn}, timeout=left)
        except asyncio.CancelledError:
            if turn.done():
                self._leave()
            else:
                self._waiting.remove(turn)
            raise
        if not turn.done():
            self._waiting.remove(turn)
            raise too_late()

    def _finish(self, done: asyncio.Future[Any]) -> None:
        del self._deadlines[done]
        if not done.cancelled():
            done.exception()  # looked at, also where the caller has gone
        self._leave()

    def _leave(self) -> None:
        """Hand the slot to the next in the queue, or give it back."""
        if self._waiting:
            self._waiting.popleft().set_result(None)
        else:
            self.running -= 1


def too_late() -> ProblemError:
    """Return the problem of a deadline that passed before the search started."""
    return ProblemError("deadline_exceeded", "the deadline passed before the search started")
