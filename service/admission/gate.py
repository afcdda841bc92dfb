"""Admit searches: at most one per core, a short queue shared fairly, and a refusal for the rest.

A search that has run for long goes on in a thread of lower priority and gives its slot back: the operating system runs
it in the time that short searches leave. The number of these is bounded, for all callers and for each.
"""

from __future__ import annotations

import asyncio
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

from association import CancelledError, Deadline

from .errors import DeadlinePassedError, QueueFullError, ShareUsedError
from .fair_queue import FairQueue, Holder, Waiter
from .threads import GateThreads, Running
from .ticket import Ticket

T = TypeVar("T")
HEARING_SECONDS = 0.5  # s that a search has to notice that it shall end
LONG_SECONDS = 0.05  # s after which a search is long: most answers take some milliseconds
LONG_NICE = 10  # of long searches: where short ones want every core, a tenth of one
LONG_PER_SLOT = 2  # long searches for each slot: each has a thread, and the memory of its search


@dataclass(eq=False, slots=True)
class _Run:
    """A function that runs.

    Attributes
    ----------
    holder : Holder
    running : Running
        In which thread.
    begun : float
        `time.monotonic()` seconds.
    timer : TimerHandle or None
        When it counts as long; None where it never does.
    long : bool
        True once it has given its slot back.
    """

    holder: Holder
    running: Running
    begun: float
    timer: asyncio.TimerHandle | None = None
    long: bool = False


class Gate:
    """Runs functions in threads of its own, a bounded number at a time and a bounded number waiting.

    Belongs to one event loop.

    Parameters
    ----------
    slots : int
        Searches that run at once, long ones apart.
    queue : int
        Searches that may wait, or run for long.
    name : str
        Of the threads.
    nice : int
        By how much they go behind other threads.
    long_per_slot : int
        Long searches that may run next to those that have slots; 0: every function keeps its slot until it returns.
    """

    def __init__(
        self, slots: int, queue: int, name: str = "search", nice: int = 0, long_per_slot: int = LONG_PER_SLOT
    ) -> None:
        self.slots = slots
        self._places = slots + queue
        self._most_long = long_per_slot * slots
        self._most_long_of_one = max(1, self._most_long // 2)
        self._threads = GateThreads(name, nice)
        self._queue = FairQueue()
        self._long: Counter[Holder] = Counter()
        self._deadlines: dict[asyncio.Future[Any], Deadline] = {}
        self._taken = 0
        self._expected = 0
        self._over: asyncio.Future[None] | None = None

    @property
    def running(self) -> int:
        """The number of searches that run, long ones included."""
        return self._taken + self._long.total()

    @property
    def waiting(self) -> int:
        """The number of searches that wait."""
        return self._queue.waiting

    @property
    def full(self) -> bool:
        """Return whether every place is taken or reserved; a holder with less than its share may still be let in."""
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

        A full queue is shared. A holder that has less than its share of the places is let in all the same. The holder
        with the most gives up one.

        Raises
        ------
        QueueFullError, ShareUsedError
        """
        if self.full:
            self._require_share(holder)

    async def run(self, function: Callable[[], T], deadline: Deadline, ticket: Ticket, heeds: Callable[[], bool]) -> T:
        """Run a function as soon as it has a slot.

        A caller that is cancelled leaves the queue; what already runs keeps its slot until it returns or is long, so
        that there are never more running than slots. Cancel the deadline to make it return soon. A further part of a
        request that had one is waited for however long the queue is.

        Parameters
        ----------
        heeds : callable
            Returns whether the function looks at the deadline by now, and returns soon after it. As long as it does
            not, as while it indexes a map, the caller waits for it until the deadline and no longer. The function then
            goes on and keeps its slot, for the next caller.

        Raises
        ------
        QueueFullError, ShareUsedError
            When the queue is full, or the place went to a holder that has fewer.
        DeadlinePassedError
            When the deadline passes before there is a slot, or before the function heeds it.
        CancelledError
            When every search is cancelled.
        """
        ticket.arrive()
        await self._enter(deadline, ticket)
        ticket.admitted = True
        return await self._outcome(self._start(function, deadline, ticket.holder), deadline, heeds)

    def _start(self, function: Callable[[], T], deadline: Deadline, holder: Holder) -> asyncio.Future[T]:
        """Start a function in a thread, in the slot that its holder has."""
        try:
            run = _Run(holder, self._threads.start(function), time.monotonic())
        except BaseException:
            self._free_slot(holder, 0.0)
            raise
        work: asyncio.Future[T] = asyncio.wrap_future(run.running.result)
        self._deadlines[work] = deadline
        self._watch(run)
        work.add_done_callback(lambda done: self._finish(done, run))
        return work

    async def _outcome(self, work: asyncio.Future[T], deadline: Deadline, heeds: Callable[[], bool]) -> T:
        """Wait for what runs, as long as it is waited for."""
        if self._over is None:
            self._over = work.get_loop().create_future()
        either: set[asyncio.Future[Any]] = {work, self._over}
        ended, _ = await asyncio.wait(either, timeout=_left(deadline), return_when=asyncio.FIRST_COMPLETED)
        if not ended and heeds():
            await asyncio.wait(either, return_when=asyncio.FIRST_COMPLETED)
        if work.done():
            try:
                return work.result()
            finally:
                del work, either, ended  # else a cycle: the traceback of an error holds this frame
        if self._over.done():
            raise CancelledError
        raise DeadlinePassedError

    def cancel_all(self) -> None:
        """Cancel everything that runs, and soon wait no longer for functions that do not end, as indexing a map."""
        for deadline in self._deadlines.values():
            deadline.cancel()
        if self._over is not None:
            self._over.get_loop().call_later(HEARING_SECONDS, self._end, self._over)

    def close(self) -> None:
        """Give the threads back; does not wait for them."""
        self._threads.close()

    def _watch(self, run: _Run) -> None:
        """Look again whether a function is long, once it has run for so long."""
        if self._most_long:
            run.timer = asyncio.get_running_loop().call_later(LONG_SECONDS, self._lower, run)

    def _lower(self, run: _Run) -> None:
        """Have a long search go on behind short ones, and hand on its slot; later where too many do so."""
        if self._long.total() >= self._most_long or self._long[run.holder] >= self._most_long_of_one:
            self._watch(run)
            return
        run.long = True
        run.running.lower(LONG_NICE)
        self._long[run.holder] += 1
        self._queue.spent(run.holder, time.monotonic() - run.begun)
        self._taken -= 1
        self._fill()

    def _may_start(self, holder: Holder) -> bool:
        """Return whether a holder may start a search: not while it has its share of the long ones."""
        return not self._most_long or self._long[holder] < self._most_long_of_one

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
        if self._taken < self.slots and self._may_start(holder):
            self._taken += 1
            self._queue.started(holder)
            return
        if not ticket.admitted:
            self._make_room(holder)
        waiter = self._queue.join(holder, fixed=ticket.admitted)
        try:
            await asyncio.wait({waiter}, timeout=_left(deadline))
        except asyncio.CancelledError:
            self._give_up(holder, waiter)
            raise
        if not waiter.done():
            self._queue.leave(holder, waiter)
            raise DeadlinePassedError
        waiter.result()

    def _make_room(self, holder: Holder) -> None:
        """Raise when the queue is full; for a holder with less than its share take a place from another."""
        if self.running + self.waiting < self._places:
            return
        self._require_share(holder)
        taken = self._queue.take_from_the_greediest(self._queue.places_of(holder) + 1)
        if taken is None:
            raise QueueFullError
        taken.set_exception(ShareUsedError())

    def _give_up(self, holder: Holder, waiter: Waiter) -> None:
        """Leave the queue, or hand on the slot that has just come."""
        if not waiter.done():
            self._queue.leave(holder, waiter)
        elif waiter.exception() is None:
            self._free_slot(holder, 0.0)

    def _finish(self, done: asyncio.Future[Any], run: _Run) -> None:
        del self._deadlines[done]
        if run.timer is not None:
            run.timer.cancel()
        if not done.cancelled():
            done.exception()  # looked at, also where the caller has gone
        if not run.long:
            self._free_slot(run.holder, time.monotonic() - run.begun)
            return
        self._long[run.holder] -= 1
        if not self._long[run.holder]:
            del self._long[run.holder]
        self._queue.finished(run.holder, 0.0)
        self._fill()

    def _free_slot(self, holder: Holder, seconds: float) -> None:
        self._queue.finished(holder, seconds)
        self._taken -= 1
        self._fill()

    def _fill(self) -> None:
        """Hand free slots to those that wait and may start."""
        while self._taken < self.slots and (waiter := self._queue.next(self._may_start)) is not None:
            self._taken += 1
            waiter.set_result(None)


def _left(deadline: Deadline) -> float | None:
    """Return the seconds until a deadline, None where it has no time."""
    return None if deadline.at is None else max(0.0, deadline.at - time.monotonic())
