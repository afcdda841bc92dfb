"""Gates to test with, which give their threads back whatever becomes of the test."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import asynccontextmanager
from functools import wraps
from typing import Any, ParamSpec, TypeVar

from association import Deadline
from service.admission.fair_queue import Holder
from service.admission.gate import Gate
from service.admission.ticket import Ticket

T = TypeVar("T")
P = ParamSpec("P")
PATIENCE = 30.0  # s for what has to come about


def soon() -> Deadline:
    return Deadline(at=time.monotonic() + 30.0)


async def until(condition: Callable[[], bool]) -> None:
    give_up = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < give_up, "did not come about"
        await asyncio.sleep(0.001)


class BlockedGate(Gate):
    """A gate, and a search that runs until it is released."""

    def __init__(self, slots: int, queue: int, long_per_slot: int = 0) -> None:
        super().__init__(slots, queue, long_per_slot=long_per_slot)
        self.release = threading.Event()
        self.asked: list[asyncio.Future[Any]] = []

    def ask(
        self,
        function: Callable[[], T],
        holder: Holder = None,
        deadline: Deadline | None = None,
        heeds: Callable[[], bool] = lambda: True,
    ) -> asyncio.Future[T]:
        """Ask for a turn, as a request does that has not had any."""
        return self.ask_with(Ticket(holder), function, deadline, heeds)

    def ask_with(
        self,
        ticket: Ticket,
        function: Callable[[], T],
        deadline: Deadline | None = None,
        heeds: Callable[[], bool] = lambda: True,
    ) -> asyncio.Future[T]:
        asked = asyncio.ensure_future(self.run(function, deadline or soon(), ticket, heeds))
        self.asked.append(asked)
        return asked

    async def block(self, holder: Holder = None, deadline: Deadline | None = None) -> asyncio.Future[bool]:
        """Have a slot taken until `release` is set."""
        before = self.running
        blocking = self.ask(self.release.wait, holder, deadline)
        await until(lambda: self.running > before)
        return blocking


@asynccontextmanager
async def gate_of(slots: int, queue: int, long_per_slot: int = 0) -> AsyncIterator[BlockedGate]:
    gate = BlockedGate(slots, queue, long_per_slot)
    try:
        yield gate
    finally:
        gate.release.set()
        for asked in gate.asked:
            asked.cancel()
        await asyncio.gather(*gate.asked, return_exceptions=True)
        gate.close()


def in_loop(scenario: Callable[P, Coroutine[Any, Any, None]]) -> Callable[P, None]:
    """Return a test, or another function, that runs a scenario in an event loop of its own."""

    @wraps(scenario)
    def run(*args: P.args, **kwargs: P.kwargs) -> None:
        asyncio.run(asyncio.wait_for(scenario(*args, **kwargs), 60.0))

    return run
