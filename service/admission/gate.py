"""Run searches: a bounded number at a time, the others in a queue that keys share fairly, and a refusal for the rest.

A search that has run for long goes on in a thread of lower priority and gives its slot back: the operating system runs
it in the time that short searches leave. The number of these is bounded, for all callers and for each.
"""

from __future__ import annotations

import asyncio
import os
import queue
import sys
import threading
import time
from collections import deque
from collections.abc import Awaitable, Callable
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, TypeVar

from association import CancelledError, Deadline
from linefix.documents.errors import DeadlinePassedError

from ..errors import QueueFullError, ShareUsedError
from .keys import Holder

T = TypeVar("T")
HEARING_SECONDS = 0.5  # s that a search has to notice that it shall end
LONG_SECONDS = 0.05  # s after which a search is long: most answers take some milliseconds
LONG_NICE = 10  # of long searches: where short ones want every core, a tenth of one
LONG_PER_SLOT = 2  # long searches for each slot: each has a thread, and the memory of its search


@dataclass(eq=False, slots=True)
class Ticket:
    """One request's admission: caller, prefix of the ids of its maps, whether it searches, has a place, had a slot."""

    holder: Holder = None
    maps: str = ""
    searches: bool = False
    has_place: bool = False
    had_slot: bool = False


@dataclass(eq=False, slots=True)
class _Share:
    """The share of one holder of a gate: its requests with a place, running, long and waiting; and the seconds used."""

    used: float
    places: int = 0
    running: int = 0
    long: int = 0
    waiting: deque[tuple[Ticket, asyncio.Future[None]]] = field(default_factory=deque)


@dataclass(eq=False, slots=True)
class _Run:
    """A function that runs, and the answer that its caller waits for."""

    holder: Holder
    deadline: Deadline
    answer: asyncio.Future[Any]
    begun: float
    worker: _Worker
    timer: asyncio.TimerHandle = field(init=False)
    long: bool = False


@dataclass(eq=False)
class Gate:
    """Runs functions in threads of its own; belongs to one event loop.

    Parameters
    ----------
    slots : int
        Functions that run at once, long ones apart.
    places : int or None
        Requests that may be on their way, wait or run; None where something else bounds them.
    name : str
        Of the threads.
    nice : int
        By how much these go behind other threads.
    long_per_slot : int
        Long functions that may run next to those that have slots; 0: each keeps its slot until it returns.
    waits : bool
        False where functions do not look at the deadline, as while they index a map: a caller waits for its function
        until the deadline and no longer. The function then goes on and keeps its slot, for the next caller.
    """

    slots: int
    places: int | None = None
    name: str = "search"
    nice: int = 0
    long_per_slot: int = LONG_PER_SLOT
    waits: bool = True
    _closed: bool = field(default=False, init=False)
    _idle: list[_Worker] = field(default_factory=list, init=False)
    _runs: set[_Run] = field(default_factory=set, init=False)
    _shares: dict[Holder, _Share] = field(default_factory=dict, init=False)

    def __post_init__(self) -> None:
        self._most = sys.maxsize if self.places is None else self.places
        self._most_long = self.long_per_slot * self.slots

    @property
    def running(self) -> int:
        """The number of functions that run, long ones included."""
        return len(self._runs)

    @property
    def waiting(self) -> int:
        """The number of functions that wait."""
        return sum(len(share.waiting) for share in self._shares.values())

    @property
    def _places(self) -> int:
        return sum(share.places for share in self._shares.values())

    @property
    def _has_free_slot(self) -> bool:
        return sum(share.running - share.long for share in self._shares.values()) < self.slots

    def require_place(self, holder: Holder) -> None:
        """Refuse a request when every place is taken, unless its holder has less than its share of them.

        Raises
        ------
        QueueFullError, ShareUsedError
        """
        if self._places < self._most:
            return
        mine = self._shares[holder].places if holder in self._shares else 0
        holders = sum(share.places > 0 for share in self._shares.values()) + (mine == 0)
        if holders > 1 and mine * holders >= self._most:
            raise ShareUsedError
        if (mine + 1) * holders > self._most:
            raise QueueFullError

    def enter(self, ticket: Ticket) -> None:
        """Take a place for a request whose body has arrived, once; where all are taken, from the holder with the most.

        Raises
        ------
        QueueFullError, ShareUsedError
        """
        if ticket.has_place:
            return
        self.require_place(ticket.holder)
        share = self._share(ticket.holder)
        if self._places >= self._most:
            self._evict(share.places + 1)
        ticket.has_place = True
        share.places += 1

    def leave(self, ticket: Ticket) -> None:
        """Give a request's place back, where it has one."""
        if ticket.has_place:
            ticket.has_place = False
            self._shares[ticket.holder].places -= 1
            self._forget(ticket.holder)

    async def run(self, function: Callable[[], T], deadline: Deadline, ticket: Ticket) -> T:
        """Run a function as soon as it has a slot; a request that had one is not refused later.

        A caller that is cancelled leaves the queue; what already runs keeps its slot until it returns or is long, so
        that there are never more running than slots. Cancel the deadline to make it return soon.

        Raises
        ------
        ShareUsedError
            When the place went to a holder that has fewer.
        DeadlinePassedError
            When the deadline passes before there is a slot, or, in a gate that does not wait, before the result.
        CancelledError
            When every search is cancelled.
        """
        if deadline.passed:
            raise DeadlinePassedError
        share = self._share(ticket.holder)
        if self._has_free_slot and self._may_start(share):
            share.running += 1
        else:
            await _until(deadline, self._wait(share, ticket))
        ticket.had_slot = True
        # Not by a name: else a cycle, for an error holds this frame, and everything that the function worked with.
        if self.waits:
            return await self._start(function, deadline, ticket.holder)
        return await _until(deadline, self._start(function, deadline, ticket.holder))

    def cancel_all(self) -> None:
        """Cancel everything that runs, and soon wait no longer for functions that do not end, as indexing a map."""
        for run in self._runs:
            run.deadline.cancel()
            run.answer.get_loop().call_later(HEARING_SECONDS, _fail, run.answer, CancelledError())

    def close(self) -> None:
        """End the free threads; does not wait for the others, which end with their functions."""
        self._closed = True
        for worker in self._idle:
            worker.todo.put(None)

    async def _wait(self, share: _Share, ticket: Ticket) -> None:
        one = ticket, asyncio.get_running_loop().create_future()
        share.waiting.append(one)
        try:
            await one[1]
        except BaseException:
            if one in share.waiting:
                share.waiting.remove(one)
                self._forget(ticket.holder)
            elif not one[1].cancelled() and one[1].exception() is None:  # a slot came as the caller left
                self._free(ticket.holder)
            raise

    def _start(self, function: Callable[[], T], deadline: Deadline, holder: Holder) -> asyncio.Future[T]:
        """Start a function in a thread, in the slot that its holder has."""
        loop = asyncio.get_running_loop()
        try:
            if self._closed:
                raise RuntimeError("this gate is closed")
            worker = self._idle.pop() if self._idle else _Worker(self.name, self.nice)
        except BaseException:
            self._free(holder)
            raise
        run = _Run(holder, deadline, loop.create_future(), time.monotonic(), worker)
        self._runs.add(run)
        run.timer = loop.call_later(LONG_SECONDS, self._lower, run)
        worker.todo.put((function, lambda *outcome: loop.call_soon_threadsafe(self._finish, run, *outcome)))
        return run.answer

    def _finish(self, run: _Run, result: object, error: BaseException | None) -> None:
        run.timer.cancel()
        self._runs.remove(run)
        if run.long or self._closed:  # a priority that was lowered cannot be raised again without rights
            run.worker.todo.put(None)
        else:
            self._idle.append(run.worker)
        self._free(run.holder, 0.0 if run.long else time.monotonic() - run.begun, long=run.long)
        if error is not None:
            _fail(run.answer, error)
        elif not run.answer.done():
            run.answer.set_result(result)

    def _lower(self, run: _Run) -> None:
        """Have a long search go on behind short ones, and hand on its slot; later where too many do so."""
        share = self._shares[run.holder]
        if sum(one.long for one in self._shares.values()) >= self._most_long or not self._may_start(share):
            run.timer = asyncio.get_running_loop().call_later(LONG_SECONDS, self._lower, run)
            return
        run.long = True
        _go_behind(run.worker.native_id, LONG_NICE)
        share.used += time.monotonic() - run.begun
        share.long += 1
        self._fill()

    def _share(self, holder: Holder) -> _Share:
        """Return what a holder has. A new one starts where the least served is, without credit."""
        if holder not in self._shares:
            self._shares[holder] = _Share(min((share.used for share in self._shares.values()), default=0.0))
        return self._shares[holder]

    def _forget(self, holder: Holder) -> None:
        share = self._shares[holder]
        if not (share.places or share.running or share.waiting):
            del self._shares[holder]

    def _may_start(self, share: _Share) -> bool:
        """Return whether a holder may start a search, or have one more long: not while it has its share of these."""
        return not self._most_long or share.long < max(1, self._most_long // 2)

    def _free(self, holder: Holder, seconds: float = 0.0, *, long: bool = False) -> None:
        """Take a function that has ended off its holder's share, to which so many seconds more are charged."""
        share = self._shares[holder]
        share.running -= 1
        share.long -= long
        share.used += seconds
        self._forget(holder)
        self._fill()

    def _fill(self) -> None:
        """Hand free slots to those that wait and may start; the holder that has used the least time is first."""
        while self._has_free_slot:
            ready = [share for share in self._shares.values() if share.waiting and self._may_start(share)]
            if not ready:
                return
            share = min(ready, key=lambda one: one.used)
            _, waiter = share.waiting.popleft()
            if not waiter.done():
                share.running += 1
                waiter.set_result(None)

    def _evict(self, most: int) -> None:
        """Take the place of the youngest that still waits for its first slot, of the holder with the most places."""
        for share in sorted(self._shares.values(), key=lambda one: one.places, reverse=True):
            for ticket, waiter in reversed(share.waiting):
                if share.places > most and not ticket.had_slot and not waiter.done():
                    self.leave(ticket)
                    _fail(waiter, ShareUsedError())
                    return
        raise QueueFullError


class _Worker(threading.Thread):
    """A thread that runs one function after the other; it does not keep the process, for some cannot be interrupted."""

    def __init__(self, name: str, nice: int) -> None:
        super().__init__(name=name, daemon=True)
        self._nice = nice
        self.todo: queue.SimpleQueue[tuple[Callable[[], Any], Callable[..., Any]] | None] = queue.SimpleQueue()
        self.start()

    def run(self) -> None:
        _go_behind(self.native_id, self._nice)
        while (task := self.todo.get()) is not None:
            function, report = task
            result, error = None, None
            try:
                result = function()
            except BaseException as raised:
                error = raised
            with suppress(RuntimeError):  # the loop has ended
                report(result, error)
            del task, function, report, result, error  # an error holds this frame


def _fail(waiter: asyncio.Future[Any], error: BaseException) -> None:
    if not waiter.done():
        waiter.set_exception(error)


async def _until(deadline: Deadline, wait: Awaitable[T]) -> T:
    """Wait until a deadline passes, and no longer."""
    try:
        async with asyncio.timeout(None if deadline.at is None else deadline.at - time.monotonic()) as limit:
            return await wait
    except TimeoutError:
        if not limit.expired():
            raise
        raise DeadlinePassedError from None
    finally:
        del wait  # a future holds its error, which holds this frame


def _go_behind(thread: int | None, nice: int) -> None:
    """Give a thread a lower priority, where threads have priorities of their own."""
    if nice and thread is not None and sys.platform == "linux":
        with suppress(OSError):  # it has ended
            os.setpriority(os.PRIO_PROCESS, thread, os.getpriority(os.PRIO_PROCESS, thread) + nice)
