"""A gate whose searches run until they are released, and scenarios in an event loop."""

from __future__ import annotations

import asyncio
import os
import threading
import time
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import asynccontextmanager
from functools import wraps
from typing import Any, ParamSpec, TypeVar

from association import Deadline
from service.admission.gate import Gate, Ticket

T = TypeVar("T")
P = ParamSpec("P")
PATIENCE = 30.0  # s for what has to come about
A, B = b"a", b"b"


def within(seconds: float = 30.0) -> Deadline:
    return Deadline(at=time.monotonic() + seconds)


async def until(condition: Callable[[], bool]) -> None:
    give_up = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < give_up, "did not come about"
        await asyncio.sleep(0.001)


def nice() -> int:
    return os.getpriority(os.PRIO_PROCESS, threading.get_native_id())


class BlockedGate(Gate):
    """A gate, and a search that runs until it is released."""

    def __init__(self, slots: int, places: int | None = None, long_per_slot: int = 0, waits: bool = True) -> None:
        super().__init__(slots, places, long_per_slot=long_per_slot, waits=waits)
        self.release = threading.Event()
        self.asked: list[asyncio.Future[Any]] = []

    def ask(
        self,
        function: Callable[[], T],
        holder: bytes | None = None,
        deadline: Deadline | None = None,
        ticket: Ticket | None = None,
    ) -> asyncio.Future[T]:
        """Ask for a slot, as a request does whose body has arrived."""

        async def request() -> T:
            admitted = ticket or Ticket(holder)
            self.enter(admitted)
            try:
                return await self.run(function, deadline or within(), admitted)
            finally:
                if ticket is None:
                    self.leave(admitted)

        asked = asyncio.ensure_future(request())
        self.asked.append(asked)
        return asked

    async def block(self, holder: bytes | None = None, deadline: Deadline | None = None) -> asyncio.Future[bool]:
        """Have a slot taken until `release` is set."""
        before = self.running
        blocking = self.ask(self.release.wait, holder, deadline)
        await until(lambda: self.running > before)
        return blocking


@asynccontextmanager
async def gate_of(
    slots: int, places: int | None = None, long_per_slot: int = 0, waits: bool = True
) -> AsyncIterator[BlockedGate]:
    gate = BlockedGate(slots, places, long_per_slot, waits)
    try:
        yield gate
    finally:
        gate.release.set()
        for asked in gate.asked:
            asked.cancel()
        await asyncio.gather(*gate.asked, return_exceptions=True)
        await until(lambda: (gate.running, gate.waiting) == (0, 0))
        gate.close()


def in_loop(scenario: Callable[P, Coroutine[Any, Any, None]]) -> Callable[P, None]:
    """Return a test that runs a scenario in an event loop of its own; nothing in it may be reported as a defect."""

    @wraps(scenario)
    def run(*args: P.args, **kwargs: P.kwargs) -> None:
        reported: list[object] = []

        async def watched() -> None:
            asyncio.get_running_loop().set_exception_handler(lambda _, context: reported.append(context))
            await asyncio.wait_for(scenario(*args, **kwargs), 60.0)

        asyncio.run(watched())
        assert not reported

    return run
