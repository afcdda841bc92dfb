"""Who may search now: at most one search per core, a short queue shared fairly, and no for the rest."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Callable, MutableMapping
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

from association import CancelledError, Deadline

from ..http.problems import ProblemError
from .fair_queue import FairQueue, Holder, Turn

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
    """

    def __init__(self, slots: int, queue: int) -> None:
        self.slots = slots
        self._places = slots + queue
        self._executor = ThreadPoolExecutor(slots, thread_name_prefix="search")
        self._queue = FairQueue()
        self._deadlines: dict[asyncio.Future[Any], Deadline] = {}
        self.running = 0
        self.announced = 0
        self._over: asyncio.Future[None] | None = None
        self._ended = threading.Event()
        self._counting = threading.Lock()
        self._busy = 0

    @property
    def waiting(self) -> int:
        """How many wait."""
        return self._queue.waiting

    @property
    def full(self) -> bool:
        """Whether everything is taken or spoken for; a holder with less than its share may still be let in."""
        return self.running + self.waiting + self.announced >= self._places

    def announce(self, holder: Holder = None) -> Announcement:
        """Note that a request is on its way to the gate, its body complete."""
        self.announced += 1
        self._queue.expect(holder)
        return Announcement(self, holder)

    def arrived(self, holder: Holder) -> None:
        """Note that one that was announced is there, or will never come."""
        self.announced -= 1
        self._queue.expect_no_longer(holder)

    def refusal(self, holder: Holder = None) -> ProblemError | None:
        """Return why a request whose body is still to be read is not let in, or None when it is.

        A full queue is shared: a holder that has less than its share of the places is let in all the same, and whoever
        has the most gives up one.
        """
        return self._refusal(holder) if self.full else None

    def _refusal(self, holder: Holder) -> ProblemError | None:
        mine = self._queue.places_of(holder)
        holders = self._queue.holders + (mine == 0)
        share = self._places / holders
        if holders > 1 and mine >= share:
            return rate_limited()
        if holders > 1 and mine + 1 <= share:
            return None
        return overloaded()

    async def run(
        self, function: Callable[[], T], deadline: Deadline, holder: Holder = None, *, admitted: bool = False
    ) -> T:
        """Run a function when its turn comes.

        A caller that is cancelled leaves the queue; what already runs keeps its slot until it returns, so that there
        are never more running than slots. Cancel the deadline to make it return soon. With `admitted` it waits however
        long the queue is: for the further parts of a request that was let in.

        Raises
        ------
        ProblemError
            When the queue is full, or the deadline passes before the turn comes, or the place went to somebody who has
            fewer.
        CancelledError
            When everything is told to give up.
        """
        await self._enter(deadline, holder, admitted)
        begun = time.monotonic()
        try:
            work = asyncio.get_running_loop().run_in_executor(self._executor, self._run, function)
        except BaseException:
            self._leave(holder, 0.0)
            raise
        self._deadlines[work] = deadline
        work.add_done_callback(lambda done: self._finish(done, holder, begun))
        if self._over is None:
            self._over = asyncio.get_running_loop().create_future()
        either: set[asyncio.Future[Any]] = {work, self._over}
        await asyncio.wait(either, return_when=asyncio.FIRST_COMPLETED)
        if work.done():
            return work.result()
        raise CancelledError

    def rest(self, seconds: float) -> None:
        """Hold the event loop for a time, or until a slot stands empty; not at all where one does."""
        with self._counting:
            self._ended.clear()
            all_busy = self._busy == self.slots
        if all_busy:
            self._ended.wait(seconds)

    def cancel_all(self) -> None:
        """Tell everything that runs to give up, and soon wait no longer for what does not hear, as indexing a map."""
        for deadline in self._deadlines.values():
            deadline.cancel()
        if self._over is not None:
            self._over.get_loop().call_later(HEARING_SECONDS, self._end, self._over)

    def close(self) -> None:
        """Give the threads back; does not wait for them."""
        self._executor.shutdown(wait=False, cancel_futures=True)

    def _run(self, function: Callable[[], T]) -> T:
        with self._counting:
            self._busy += 1
        try:
            return function()
        finally:
            with self._counting:
                self._busy -= 1
                self._ended.set()

    def _end(self, over: asyncio.Future[None]) -> None:
        if not over.done():
            over.set_result(None)

    async def _enter(self, deadline: Deadline, holder: Holder, admitted: bool) -> None:
        if deadline.passed:
            raise too_late()
        if self.running < self.slots and not self.waiting:
            self.running += 1
            self._queue.started(holder)
            return
        if not admitted:
            self._make_room(holder)
        turn = self._queue.join(holder, fixed=admitted)
        left = None if deadline.at is None else max(0.0, deadline.at - time.monotonic())
        try:
            await asyncio.wait({turn}, timeout=left)
        except asyncio.CancelledError:
            self._give_up(holder, turn)
            raise
        if not turn.done():
            self._queue.leave(holder, turn)
            raise too_late()
        turn.result()

    def _make_room(self, holder: Holder) -> None:
        """Raise when the queue is full; for a holder with less than its share take a place from another."""
        if self.running + self.waiting < self._places:
            return
        refusal = self._refusal(holder)
        if refusal is not None:
            raise refusal
        taken = self._queue.take_from_the_greediest(self._queue.places_of(holder) + 1)
        if taken is None:
            raise overloaded()
        taken.set_exception(rate_limited())

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
            following[1].set_result(None)


ANNOUNCED = "announced"


class Announcement:
    """A request on its way from the socket to the gate; without it all that come together would find room."""

    def __init__(self, gate: SearchGate, holder: Holder) -> None:
        self._gate: SearchGate | None = gate
        self._holder = holder

    def end(self) -> None:
        """Say that it is there, or will never come."""
        if self._gate is not None:
            self._gate.arrived(self._holder)
            self._gate = None


def too_late() -> ProblemError:
    """Return the problem of a deadline that passed before the search started."""
    return ProblemError("deadline_exceeded", "the deadline passed before the search started")


def end_announcement(scope: MutableMapping[str, Any]) -> None:
    """Say that a request has come to the gate, or never will, if it was announced."""
    announcement = scope["state"].get(ANNOUNCED)
    if announcement is not None:
        announcement.end()


def overloaded() -> ProblemError:
    """Return the problem of a full queue."""
    return ProblemError("overloaded", "every core is searching and the queue is full", headers={"Retry-After": "1"})


def rate_limited() -> ProblemError:
    """Return the problem of a key that has its share of a full queue."""
    return ProblemError(
        "rate_limited", "the queue is full, and this key has its share of it", headers={"Retry-After": "1"}
    )
