"""One request's way through the service: let in, read, worked at, answered."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from functools import partial
from typing import Any, TypeVar

from starlette.requests import Request
from starlette.responses import Response

from association import Deadline

from ..parsing.parser_process import LARGE
from ..parsing.unpacking import unpack
from ..schemas.limits import Limits
from ..work.job import Done, Job, Stopwatch
from .services import Services, services_of
from .state import RequestState, state_of

T = TypeVar("T")
Reader = Callable[[bytes | bytearray, Limits], T]
"""From JSON to what was asked for; a function of a module, so that another process can call it."""

JSON = "application/json"
SMALL = 16_384  # bytes; smaller bodies are parsed in less time than it takes to hand them to a thread


class HangUpError(Exception):
    """The client is gone; there is nobody to answer."""


class Exchange:
    """One request on its way; a route's view of it.

    Parameters
    ----------
    request : Request

    Attributes
    ----------
    services : Services
        Of the application that it came to.
    """

    def __init__(self, request: Request) -> None:
        state = state_of(request.scope)
        assert state is not None
        assert state.ticket is not None
        self._request = request
        self._state: RequestState = state
        self._ticket = state.ticket
        self._watch = Stopwatch()
        self.services: Services = services_of(request.scope)

    def note(self, **fields: object) -> None:
        """Have something more in the log's line of this request."""
        self._state.noted.update(fields)

    async def read(self, reader: Reader[T]) -> T:
        """Receive the body and check it, off the event loop where that takes long.

        A large one is parsed in a turn at the gate, like a search: it takes a core for a while, too. The deadline
        counts from the moment when the body is there.
        """
        services = self.services
        limits, max_bytes = services.settings.limits(), services.settings.max_body_bytes
        async with services.bodies.receiving(self._request, self._state.arrived) as body:
            self._watch = Stopwatch()
            data = body.data
            if body.gzipped:
                data = await services.parse_threads.run(partial(unpack, data, max_bytes))
            if len(data) <= SMALL:
                return reader(data, limits)
            if len(data) <= LARGE:
                return await services.parse_threads.run(partial(reader, data, limits))
            call = partial(services.parser.call, reader, data, limits)
            return await self.search(call, self.job().deadline)

    def job(self, deadline_ms: float | None = None) -> Job:
        """Return what is to be done for this request; without a deadline of its own it has the service's."""
        deadline = self._watch.deadline(deadline_ms, self.services.settings.max_deadline_ms)
        return Job(self._state.request_id, self._watch, deadline)

    async def search(self, call: Callable[[], T], deadline: Deadline) -> T:
        """Run a search when its turn comes; give up when the client does."""
        return await self.unless_hung_up(self.take_turn(call, deadline), deadline)

    async def take_turn(self, call: Callable[[], T], deadline: Deadline) -> T:
        """Run a part of this request when its turn comes; what was let in once is not sent away later."""
        return await self.services.gate.run(call, deadline, self._ticket)

    async def unless_hung_up(self, work: Coroutine[Any, Any, T], deadline: Deadline) -> T:
        """Wait for work, or cancel it when the client is gone first.

        Raises
        ------
        HangUpError
            When the client is gone.
        """
        task = asyncio.ensure_future(work)
        gone = asyncio.ensure_future(_hang_up(self._request))
        try:
            await asyncio.wait({task, gone}, return_when=asyncio.FIRST_COMPLETED)
            if not task.done():
                raise HangUpError
            return task.result()
        finally:
            if not task.done():
                deadline.cancel()
                task.cancel()
            gone.cancel()

    def answer(self, done: Done) -> Response:
        """Return what came of the work as a response."""
        self.note(**done.noted)
        return json_response(done.body)


def json_response(data: bytes, status: int = 200, headers: dict[str, str] | None = None) -> Response:
    """Return JSON that is encoded already."""
    return Response(data, status, headers, JSON)


def searching(request: Request) -> Exchange:
    """Return the way of a request that needs the kernels.

    Raises
    ------
    NotReadyError
        When they are not there yet; before the body is read.
    """
    exchange = Exchange(request)
    exchange.services.readiness.require_warm()
    return exchange


async def _hang_up(request: Request) -> None:
    """Return when the client is gone; the body has been read before."""
    while True:
        message = await request.receive()
        if message["type"] == "http.disconnect":
            return
