"""One request while it is served, from its head to its line in the log; routes get it by `Depends`.

`middleware` makes and ends it, `bodies` reads its body, `stages` has its map looked up and searched, `respond` answers.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field
from typing import Annotated, Any, TypeVar

from fastapi import Depends
from starlette.requests import Request
from starlette.responses import Response
from starlette.types import Receive, Scope

from linefix.operations import Stopwatch

from ..admission.gate import Ticket
from ..work.job import Job
from .services import Services

T = TypeVar("T")
KEY = "exchange"
"""Key of the exchange in the state of a request's scope."""
JSON = "application/json"
WATCH_AFTER = 0.02  # s until the connection is watched: most answers are ready earlier
LARGE = 65_536  # bytes of an answer that are counted until the client has read them


@dataclass(slots=True, kw_only=True)
class Exchange(Job):
    """One request.

    Attributes
    ----------
    services : Services
        Of its application.
    request : Request
    arrived : float
        When its head arrived, by the event loop's clock, seconds.
    ticket : Ticket
        Its admission.
    held : ExitStack
        Accounts of bytes that are given back when the exchange ends.
    """

    services: Services
    request: Request
    arrived: float
    ticket: Ticket = field(default_factory=Ticket)
    held: ExitStack = field(default_factory=ExitStack)

    def begin(self) -> None:
        """Start the watch, since the body has arrived, and the service's own deadline."""
        self.watch = Stopwatch()
        self.limit(None)

    def limit(self, deadline_ms: float | None) -> None:
        """Take the deadline of the request, at most the service's own; None: that."""
        self.deadline = self.watch.deadline(deadline_ms, self.services.settings.max_deadline_ms)

    def give_up(self) -> None:
        """Cancel the work."""
        self.deadline.cancel()

    async def respond(self, work: Coroutine[Any, Any, bytes]) -> Response:
        """Wait for the work of this request and return its JSON as a response; raises also `HangUpError`."""
        return self.json(await unless_hung_up(self.request.receive, work, self.give_up))

    def json(self, data: bytes, status: int = 200, headers: Mapping[str, str] | None = None) -> Response:
        """Return JSON as a response. A large one counts as held until the client has taken it, all but the last few.

        Raises
        ------
        TooMuchHeldError, ShareHeldError
            When too much waits to be read already.
        """
        if len(data) > LARGE:
            self.held.enter_context(self.services.answers.account(self.ticket.holder)).take(len(data))
        return Response(data, status, headers, JSON)


def exchange_of(scope: Scope) -> Exchange:
    """Return the exchange of a request, which the middleware has put into its scope."""
    found = scope["state"][KEY]
    assert isinstance(found, Exchange)
    return found


async def _any(request: Request) -> Exchange:
    return exchange_of(request.scope)


async def _searching(request: Request) -> Exchange:
    exchange = exchange_of(request.scope)
    exchange.services.readiness.require_warm()  # before the body is read
    return exchange


Admitted = Annotated[Exchange, Depends(_any)]
"""A request that was let in."""
Searching = Annotated[Exchange, Depends(_searching)]
"""One that needs the kernels; `NotReadyError` when they are not there yet."""


class HangUpError(Exception):
    """The client hung up; no answer can be sent."""


async def unless_hung_up(receive: Receive, work: Coroutine[Any, Any, T], give_up: Callable[[], None]) -> T:
    """Wait for work, and cancel it when the client hangs up first.

    The work stays in the task of the request, and the watch starts later: each would cost a request tens of
    microseconds.

    Parameters
    ----------
    receive : Receive
        Of the server; the body has been read before.
    work : coroutine
    give_up : callable
        Called when the work is cancelled, by this or by anything else.

    Raises
    ------
    HangUpError
        When the client hung up.
    """
    watches: list[asyncio.Task[None]] = []

    async def watch() -> None:
        while (await receive())["type"] != "http.disconnect":
            pass
        scope.reschedule(0.0)

    beginning = asyncio.get_running_loop().call_later(
        WATCH_AFTER, lambda: watches.append(asyncio.ensure_future(watch()))
    )
    try:
        async with asyncio.timeout(None) as scope:
            try:
                return await work
            except asyncio.CancelledError:
                give_up()
                raise
    except TimeoutError:
        if not scope.expired():
            raise
        raise HangUpError from None
    finally:
        beginning.cancel()
        for task in watches:
            task.cancel()
