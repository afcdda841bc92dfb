"""Giving up what is done for a client that is gone."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from typing import Any, TypeVar

from starlette.requests import Request

from association import Deadline

T = TypeVar("T")
FIRST_SECONDS = 0.02  # s in which nobody looks whether the client is there: most answers are sooner done


class HangUpError(Exception):
    """The client is gone; there is nobody to answer."""


async def hang_up(request: Request) -> None:
    """Return when the client is gone; the body has been read before."""
    while True:
        message = await request.receive()
        if message["type"] == "http.disconnect":
            return


async def unless(gone: Callable[[], Coroutine[Any, Any, None]], work: Coroutine[Any, Any, T], deadline: Deadline) -> T:
    """Wait for work, and cancel it when the client is gone first.

    The work stays in the task of who asks, and who watches comes later: each would cost a request tens of microseconds.

    Parameters
    ----------
    gone : callable
        Gives a coroutine that ends when the client is gone.
    work : coroutine
    deadline : Deadline
        Of the work; is cancelled with it.

    Raises
    ------
    HangUpError
        When the client is gone.
    """
    own = asyncio.current_task()
    assert own is not None
    watch: asyncio.Task[None] | None = None
    waiting, is_gone = True, False

    def give_up(watch: asyncio.Task[None]) -> None:
        nonlocal is_gone
        # Once there is a result nobody is cancelled any more, though this may have been on its way already.
        if waiting and not watch.cancelled():
            is_gone = True
            own.cancel()

    def begin() -> None:
        nonlocal watch
        watch = asyncio.ensure_future(gone())
        watch.add_done_callback(give_up)

    beginning = asyncio.get_running_loop().call_later(FIRST_SECONDS, begin)
    try:
        return await work
    except asyncio.CancelledError:
        deadline.cancel()
        # Somebody else may have cancelled the task at the same time.
        if is_gone and own.uncancel() == 0:
            raise HangUpError from None
        raise
    finally:
        waiting = False
        beginning.cancel()
        if watch is not None:
            watch.cancel()
