"""The third stage of a request: its search, in a slot of the gate, given up when the client hangs up."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine, Sequence
from typing import Any, TypeVar

from starlette.types import Receive

from association import CancelledError, Deadline
from linefix.documents.errors import DeadlinePassedError

from ..telemetry.traces import queued
from .exchange import Exchange

T = TypeVar("T")
WATCH_AFTER = 0.02  # s until the connection is watched: most answers are ready earlier


class HangUpError(Exception):
    """The client hung up; no answer can be sent."""


async def in_search_slot(exchange: Exchange, call: Callable[[], T], deadline: Deadline) -> T:
    """Run a part of this request in a slot of the gate; an admitted request is not refused later."""
    return await exchange.services.gate.run(queued(call), deadline, exchange.ticket)


async def in_search_slots(
    exchange: Exchange,
    calls: Sequence[Callable[[], T]],
    deadline: Deadline,
    failed: Callable[[int, Exception], T],
) -> list[T]:
    """Run parts of this request, as many at once as there are slots; other requests get slots in between.

    `failed` returns what stands in the place of a part that raised, given its number, or raises: then all end.
    """
    results: dict[int, T] = {}
    todo = iter(enumerate(calls))

    async def work_through() -> None:
        for number, call in todo:
            try:
                results[number] = await in_search_slot(exchange, call, deadline)
            except CancelledError:
                raise
            except Exception as error:
                results[number] = failed(number, error)

    tasks = [asyncio.ensure_future(work_through()) for _ in range(min(exchange.services.gate.slots, len(calls)))]
    try:
        await asyncio.gather(*tasks)
    except BaseException:
        deadline.cancel()
        for task in tasks:
            task.cancel()
        raise
    return [results[number] for number in range(len(calls))]


async def in_short_slots(exchange: Exchange, step: Callable[[], bool], deadline: Deadline) -> bool:
    """Take steps on one core until there are none, each in a slot of its own; return whether there was time for all.

    The other cores, and the time between two steps, are left to searches that robots wait for.
    """
    try:
        while await in_search_slot(exchange, step, deadline):
            await asyncio.sleep(0)
    except DeadlinePassedError:
        return False
    return True


async def unless_hung_up(receive: Receive, work: Coroutine[Any, Any, T], deadline: Deadline) -> T:
    """Wait for work; cancel it, and its deadline, when the client hangs up first.

    The work stays in the task of the request, and the watch starts later: each would cost a request tens of
    microseconds.

    Parameters
    ----------
    receive : Receive
        Of the server; the body has been read before.
    work : coroutine
    deadline : Deadline
        Of the work.

    Raises
    ------
    HangUpError
        When the client hung up.
    """
    own = asyncio.current_task()
    assert own is not None
    watch: asyncio.Task[None] | None = None
    waiting, is_gone = True, False

    def give_up(watch: asyncio.Task[None]) -> None:
        nonlocal is_gone
        # Once there is a result nothing is cancelled any more, though this may have been on its way already.
        if waiting and not watch.cancelled():
            is_gone = True
            own.cancel()

    def begin() -> None:
        nonlocal watch
        watch = asyncio.ensure_future(_hung_up(receive))
        watch.add_done_callback(give_up)

    beginning = asyncio.get_running_loop().call_later(WATCH_AFTER, begin)
    try:
        return await work
    except asyncio.CancelledError:
        deadline.cancel()
        # Something else may have cancelled the task at the same time.
        if is_gone and own.uncancel() == 0:
            raise HangUpError from None
        raise
    finally:
        waiting = False
        beginning.cancel()
        if watch is not None:
            watch.cancel()


async def _hung_up(receive: Receive) -> None:
    """Return when the client has hung up."""
    while (await receive())["type"] != "http.disconnect":
        pass
