"""Who may search now: at most one search per core, a short queue shared fairly, and no for the rest."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

from association import CancelledError, Deadline

from .errors import DeadlinePassedError, QueueFullError, ShareUsedError
from .fair_queue import FairQueue, Holder, Turn
from .ticket import Ticket

T = TypeVar("T")
HEARING_SECONDS = 0.5  # s that a search has to notice that it shall end


class SearchGate:
    """Runs functions in threads of its own, a bounded number at a time and a bounded number waiting.

    Belongs to one event loop.

    Parameters
    ----------
    slots : int
        Searches that run at once.
    queue : int
        Searches that may wait.

    Attributes
    ----------
    running : int
        Slots that are taken.
    """

    def __init__(self, slots: int, queue: int) -> None:
        self.slots = slots
        self._places = slots + queue
        self._executor = ThreadPoolExecutor(slots, thread_name_prefix="search")
        self._queue = FairQueue()
        self._deadlines: dict[asyncio.Future[Any], Deadline] = {}
        self.running = 0
        self._expected = 0
        self._over: asyncio.Future[None] | None = None

    @property
    def waiting(self) -> int:
        """How many wait."""
        return self._queue.waiting

    @property
    def full(self) -> bool:
        """Whether everything is taken or spoken for; a holder with less than its share may still be let in."""
        return self.running + self.waiting + self._expected >= self._places

    def expect(self, holder: Holder) -> None:
        """Note that a request is on its way to the gate, its body complete."""
        self._expected += 1
        self._queue.expect(holder)

    def expect_no_longer(self, holder: Holder) -> None:
        """Note that one that was expected is there, or will never come."""
        self._expected -= 1
        self._queue.expect_no_longer(holder)

    def require_place(self, holder: Holder = None) -> None:
        """Refuse a request whose body is still to be read, when there is no place for it.

        A full queue is shared: a holder that has less than its share of the places is let in all the same, and whoever
        has the most gives up one.

        Raises
        ------
        QueueFullError, ShareUsedError
        """
        if self.full:
            self._require_share(holder)

    async def run(self, function: Callable[[], T], deadline: Deadline, ticket: Ticket, heeds: Callable[[], bool]) -> T:
        """Run a function when its turn comes.

        A caller that is cancelled leaves the queue; what already runs keeps its slot until it returns, so that there
        are never more running than slots. Cancel the deadline to make it return soon. A further turn of a request that
        had one is waited for however long the queue is.

        Parameters
        ----------
        heeds : callable
            Tells whether the function looks at the deadline by now, and returns soon after it. As long as it does not,
            as while it indexes a map, it is waited for until the deadline and no longer: it goes on, and keeps its
            slot, for whoever asks next.

        Raises
        ------
        QueueFullError, ShareUsedError
            When the queue is full, or the place went to somebody who has fewer.
        DeadlinePassedError
            When the deadline passes before the turn comes, or before the function heeds it.
        CancelledError
            When everything is told to give up.
        """
        ticket.arrive()
        await self._enter(deadline, ticket)
        ticket.admitted = True
        begun = time.monotonic()
        loop = asyncio.get_running_loop()
        try:
            work = loop.run_in_executor(self._executor, function)
        except BaseException:
            self._leave(ticket.holder, 0.0)
            raise
        self._deadlines[work] = deadline
        work.add_done_callback(lambda done: self._finish(done, ticket.holder, begun))
        return await self._outcome(work, deadline, heeds)

    async def _outcome(self, work: asyncio.Future[T], deadline: Deadline, heeds: Callable[[], bool]) -> T:
        """Wait for what runs, as long as it is waited for."""
        if self._over is None:
            self._over = work.get_loop().create_future()
        either: set[asyncio.Future[Any]] = {work, self._over}
        ended, _ = await asyncio.wait(either, timeout=_left(deadline), return_when=asyncio.FIRST_COMPLETED)
        if not ended and heeds():
            await asyncio.wait(either, return_when=asyncio.FIRST_COMPLETED)
        if work.done():
            return work.result()
        if self._over.done():
            raise CancelledError
        raise DeadlinePassedError

    def cancel_all(self) -> None:
        """Tell everything that runs to give up, and soon wait no longer for what does not hear, as indexing a map."""
        for deadline in self._deadlines.values():
            deadline.cancel()
        if self._over is not None:
            self._over.get_loop().call_later(HEARING_SECONDS, self._end, self._over)

    def close(self) -> None:
        """Give the threads back; does not wait for them."""
        self._executor.shutdown(wait=False)

    def _require_share(self, holder: Holder) -> None:
        """Raise unless a holder has less than its share of a full queue."""
        mine = self._queue.places_of(holder)
        holders = self._queue.holders + (mine == 0)
        share = self._places / holders
        if holders > 1 and mine >= share:
            raise ShareUsedError
        if mine + 1 > share:
            raise QueueFullError

    def _end(self, over: asyncio.Future[None]) -> None:
        if not over.done():
            over.set_result(None)

    async def _enter(self, deadline: Deadline, ticket: Ticket) -> None:
        if deadline.passed:
            raise DeadlinePassedError
        holder = ticket.holder
        if self.running < self.slots and not self.waiting:
            self.running += 1
            self._queue.started(holder)
            return
        if not ticket.admitted:
            self._make_room(holder)
        turn = self._queue.join(holder, fixed=ticket.admitted)
        try:
            await asyncio.wait({turn}, timeout=_left(deadline))
        except asyncio.CancelledError:
            self._give_up(holder, turn)
            raise
        if not turn.done():
            self._queue.leave(holder, turn)
            raise DeadlinePassedError
        turn.result()

    def _make_room(self, holder: Holder) -> None:
        """Raise when the queue is full; for a holder with less than its share take a place from another."""
        if self.running + self.waiting < self._places:
            return
        self._require_share(holder)
        taken = self._queue.take_from_the_greediest(self._queue.places_of(holder) + 1)
        if taken is None:
            raise QueueFullError
        taken.set_exception(ShareUsedError())

    def _give_up(self, holder: Holder, turn: Turn) -> None:
        """Leave the queue, or hand on the turn that has just come."""
        if not turn.done():
            self._queue.leave(holder, turn)
        elif turn.exception() is None:
            self._leave(holder, 0.0)

    def _finish(self, done: asyncio.Future[Any], holder: Holder, begun: float) -> None:
        del self._deadlines[done]
        if not done.cancelled():
            done.exception()  # looked at, also where the caller has gone
        self._leave(holder, time.monotonic() - begun)

    def _leave(self, holder: Holder, seconds: float) -> None:
        """Hand the slot to the next in the queue, or give it back."""
        self._queue.finished(holder, seconds)
        following = self._queue.next()
        if following is None:
            self.running -= 1
        else:
            following.set_result(None)


def _left(deadline: Deadline) -> float | None:
    """Return the seconds until a deadline, None where it has no time."""
    return None if deadline.at is None else max(0.0, deadline.at - time.monotonic())
