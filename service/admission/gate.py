"""Who may search now: at most one search per core, a short queue shared fairly, and no for the rest.

A turn that has gone on for long rests while somebody waits who has used less: otherwise who asks for what takes seconds
would have the processor for as long each time, and who asks for milliseconds would get one answer for each of those.
"""

from __future__ import annotations

import asyncio
import os
import sys
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from typing import Any, TypeVar

from association import CancelledError, Deadline

from .errors import DeadlinePassedError, QueueFullError, ShareUsedError
from .fair_queue import FairQueue, Holder, Turn
from .helpers import HelperThreads
from .ticket import Ticket

T = TypeVar("T")
HEARING_SECONDS = 0.5  # s that a search has to notice that it shall end
LONG_SECONDS = 0.02  # s after which a turn may have to rest: shorter ones are waited for
LEAD_SECONDS = 0.002  # s by which it has used more than somebody who waits; every look would be too often
RESTING = 4  # turns that may rest, for each slot: each keeps a thread, and the memory of its search


@dataclass(eq=False, slots=True)
class _Run:
    """A function that runs, or rests.

    Attributes
    ----------
    holder : Holder
    begun : float
        `time.monotonic()` seconds; since when it runs, or goes on after a rest.
    before : float
        Seconds that it ran before that.
    awake : Event
        Clear while it rests.
    """

    holder: Holder
    begun: float
    before: float = 0.0
    awake: threading.Event = field(default_factory=threading.Event)


class Gate:
    """Runs functions in threads of its own, a bounded number at a time and a bounded number waiting.

    What looks at its deadline may have to rest there, for others to have their turns. While slots are free
    their threads may take part in what runs: the deadline has them as its helpers.

    Belongs to one event loop.

    Parameters
    ----------
    slots : int
        Searches that run at once.
    queue : int
        Searches that may wait.
    name : str
        Of the threads.
    nice : int
        By how much they go behind other threads.

    Attributes
    ----------
    running : int
        Slots that are taken.
    """

    def __init__(self, slots: int, queue: int, name: str = "search", nice: int = 0) -> None:
        self.slots = slots
        self._places = slots + queue
        self._most_resting = RESTING * slots
        threads = slots + self._most_resting
        self._executor = ThreadPoolExecutor(threads, name, initializer=_go_behind, initargs=(nice,))
        self._queue = FairQueue()
        self._helpers = HelperThreads(slots - 1, self._spare) if slots > 1 else None
        self._waiting: tuple[tuple[Holder, float], ...] = ()
        self._resting: set[_Run] = set()
        self._local = threading.local()
        self._closed = False
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
        run = _Run(ticket.holder, time.monotonic())
        loop = asyncio.get_running_loop()
        deadline.rest, deadline.helpers = partial(self._may_rest, loop), self._helpers
        try:
            work = loop.run_in_executor(self._executor, partial(self._working, run, function))
        except BaseException:
            self._leave(ticket.holder, 0.0)
            raise
        self._deadlines[work] = deadline
        work.add_done_callback(lambda done: self._finish(done, run))
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
        self._closed = True
        self._executor.shutdown(wait=False)
        if self._helpers is not None:
            self._helpers.close()

    def _spare(self) -> int:
        return 0 if self._closed else self.slots - self.running

    def _working(self, run: _Run, function: Callable[[], T]) -> T:
        """Run a function in a thread, which is known by its turn meanwhile."""
        self._local.run = run
        try:
            return function()
        finally:
            self._local.run = None

    def _may_rest(self, loop: asyncio.AbstractEventLoop) -> None:
        """Wait, in the thread of a turn that has run for long, while somebody waits who has used less."""
        run: _Run | None = getattr(self._local, "run", None)
        if run is None or self._closed:
            return
        spent = time.monotonic() - run.begun
        if run.before + spent < LONG_SECONDS:
            return
        mine = self._queue.used_by(run.holder) + spent - LEAD_SECONDS
        if all(used >= mine or holder == run.holder for holder, used in self._waiting):
            return
        run.awake.clear()
        try:
            loop.call_soon_threadsafe(self._rest, run)
        except RuntimeError:  # the loop has ended
            return
        while not run.awake.wait(HEARING_SECONDS) and not self._closed:
            pass  # the loop may have ended without having put it to rest: then nobody wakes it

    def _rest(self, run: _Run) -> None:
        """Put a turn that runs back into the queue, where nothing takes its place away, and hand on its slot."""
        if self._closed or len(self._resting) >= self._most_resting:
            run.awake.set()
            return
        spent = time.monotonic() - run.begun
        run.before += spent
        self._resting.add(run)
        self._queue.join_again(run.holder).add_done_callback(lambda _: self._go_on(run))
        self._leave(run.holder, spent)

    def _go_on(self, run: _Run) -> None:
        self._resting.discard(run)
        run.begun = time.monotonic()
        run.awake.set()

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
        self._note_waiting()
        try:
            await asyncio.wait({turn}, timeout=_left(deadline))
        except asyncio.CancelledError:
            self._give_up(holder, turn)
            raise
        if not turn.done():
            self._queue.leave(holder, turn)
            self._note_waiting()
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
            self._note_waiting()
        elif turn.exception() is None:
            self._leave(holder, 0.0)

    def _finish(self, done: asyncio.Future[Any], run: _Run) -> None:
        del self._deadlines[done]
        if not done.cancelled():
            done.exception()  # looked at, also where the caller has gone
        self._leave(run.holder, time.monotonic() - run.begun)

    def _leave(self, holder: Holder, seconds: float) -> None:
        """Hand the slot to the next in the queue, or give it back."""
        self._queue.finished(holder, seconds)
        following = self._queue.next()
        self._note_waiting()
        if following is None:
            self.running -= 1
        else:
            following.set_result(None)

    def _note_waiting(self) -> None:
        """Write down who waits, for threads to look at."""
        self._waiting = self._queue.standing()


def _go_behind(nice: int) -> None:
    """Have this thread go behind others where threads have priorities of their own."""
    if nice and sys.platform == "linux":
        os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), nice)


def _left(deadline: Deadline) -> float | None:
    """Return the seconds until a deadline, None where it has no time."""
    return None if deadline.at is None else max(0.0, deadline.at - time.monotonic())
