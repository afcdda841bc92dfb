"""One request's way through the service: let in, read, worked at, answered."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import AbstractContextManager, asynccontextmanager
from functools import partial
from typing import Any, TypeVar

from starlette.requests import Request
from starlette.responses import Response

from association import Deadline

from ..admission.budget import ByteAccount
from ..admission.errors import DeadlinePassedError, ForeignMapError
from ..admission.gate import Gate
from ..admission.ticket import Ticket
from ..maps.cache import CachedMap
from ..maps.errors import StoreAwayError
from ..maps.lookup import FoundMap
from ..parsing.parser_process import LARGE
from ..parsing.unpacking import unpack
from ..schemas.limits import Limits
from ..schemas.parts import InlineMap, StoredMap
from ..telemetry.traces import queued, stage
from ..work.job import Done, Job, Stopwatch
from .hanging_up import hang_up, unless
from .sending import json_response
from .services import Services, services_of
from .state import RequestState, state_of

T = TypeVar("T")
Reader = Callable[[bytes | bytearray, Limits], T]
"""From JSON to what was asked for; a function of a module, so that another process can call it."""

STORE_SECONDS = 8.0  # for an answer of the store; a write may wait for others for some seconds
SMALL = 16_384  # bytes; smaller bodies are parsed in less time than it takes to hand them to a thread


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

    @property
    def maps(self) -> str:
        """How the ids of the maps begin that there are for this caller."""
        return self._ticket.maps

    def note(self, **fields: object) -> None:
        """Have something more in the log's line of this request."""
        self._state.noted.update(fields)

    async def read(self, reader: Reader[T]) -> T:
        """Receive the body and check it, off the event loop where that takes long.

        The deadline counts from the moment when the body is there.
        """
        async with self.received() as data:
            with stage("parse"):
                if len(data) <= SMALL:
                    return reader(data, self.services.settings.limits())
                return await self.unless_hung_up(self.parse(reader, data, deadline := self.job().deadline), deadline)

    async def parse(self, reader: Reader[T], data: bytes | bytearray, deadline: Deadline) -> T:
        """Check a body when its turn comes.

        Turns are shared between callers, as those at the gate are, and are others than these: no search waits for
        somebody's large body. Nor do bodies for larger ones, which another process parses.
        """
        services = self.services
        if len(data) <= LARGE:
            call = partial(reader, data, services.settings.limits())
            return await self.take_other_turn(services.parsing, call, deadline)
        apart = partial(services.parser.call, reader, data, services.settings.limits())
        return await self.take_other_turn(services.parsing_apart, apart, deadline)

    async def take_other_turn(self, gate: Gate, call: Callable[[], T], deadline: Deadline) -> T:
        """Run a part of this request, which is short or heeds the deadline, in a turn of another kind."""
        # By a ticket of its own: the request is still on its way to its search.
        return await gate.run(call, deadline, Ticket(self._ticket.holder), lambda: True)

    @asynccontextmanager
    async def received(self, *, form: bool = False) -> AsyncIterator[bytearray]:
        """Receive the body, JSON or a form with files, and unpack it; its bytes count as held until the block ends."""
        services = self.services
        receiving = services.bodies.receiving(self._request, self._state.arrived, self._ticket.holder, form=form)
        async with receiving as body:
            self._watch = Stopwatch()
            data = body.data
            if body.gzipped:
                packed, max_bytes = len(data), services.settings.max_body_bytes
                call = partial(unpack, data, max_bytes, body.account.take)
                data = await self.take_other_turn(services.parsing_apart, call, self.job().deadline)
                body.data.clear()
                body.account.give_back(packed)
            yield data

    def job(self, deadline_ms: float | None = None) -> Job:
        """Return what is to be done for this request; without a deadline of its own it has the service's."""
        deadline = self._watch.deadline(deadline_ms, self.services.settings.max_deadline_ms)
        return Job(self._state.request_id, self._watch, deadline)

    @asynccontextmanager
    async def looking_up(
        self, asked: InlineMap | StoredMap, deadline: Deadline, *, oriented: bool | None
    ) -> AsyncIterator[InlineMap | FoundMap]:
        """Look a stored map up before its turn at the gate: a database server that hangs holds up nobody else.

        Its document counts as held until the block ends. `oriented` None is as the map itself says.

        Raises
        ------
        ForeignMapError
            When there is no such map for this caller.
        StoreError
            When it cannot be had.
        TooMuchHeldError, ShareHeldError
            When too much is held already.
        DeadlinePassedError
            When the deadline passes first.
        """
        if isinstance(asked, InlineMap):
            yield asked
            return
        if not asked.map_id.startswith(self.maps):
            raise ForeignMapError
        found = self.services.lookup.find_at_once(asked.map_id, oriented=oriented)
        if found is not None:
            yield found
            return
        left = None if deadline.at is None else max(0.0, deadline.at - time.monotonic())
        find = partial(self.services.lookup.find, asked.map_id, oriented=oriented)
        try:
            async with asyncio.timeout(left):
                found = await ask_store(self.services, find)
        except TimeoutError:
            raise DeadlinePassedError from None
        with self.services.documents.account(self._ticket.holder) as account:
            account.take(len(found.document or b""))
            yield found

    async def index(self, on: InlineMap | FoundMap, deadline: Deadline, *, oriented: bool | None) -> CachedMap | None:
        """Index a map for which that takes long, in a turn of another kind: a search can rest, this cannot.

        None where it is left to the search's own turn.
        """
        lookup = self.services.lookup
        if not lookup.takes_long(on):
            return None
        call = partial(lookup.indexed, on, oriented=oriented, deadline=deadline)
        return await self.services.indexing.run(call, deadline, Ticket(self._ticket.holder), lambda: False)

    async def search(self, call: Callable[[], T], deadline: Deadline, heeds: Callable[[], bool] = lambda: True) -> T:
        """Run a search when its turn comes; give up when the client does."""
        return await self.unless_hung_up(self.take_turn(call, deadline, heeds), deadline)

    async def take_turn(self, call: Callable[[], T], deadline: Deadline, heeds: Callable[[], bool] = lambda: True) -> T:
        """Run a part of this request when its turn comes; what was let in once is not sent away later.

        What does not heed the deadline is waited for until then and no longer: see `Gate.run`.
        """
        return await self.services.gate.run(queued(call), deadline, self._ticket, heeds)

    async def unless_hung_up(self, work: Coroutine[Any, Any, T], deadline: Deadline) -> T:
        """Wait for work, or cancel it when the client is gone first.

        Raises
        ------
        HangUpError
            When the client is gone.
        """
        return await unless(partial(hang_up, self._request), work, deadline)

    def holding_answers(self) -> AbstractContextManager[ByteAccount]:
        """Give an account for answers that come one after the other, until they are sent as one."""
        return self.services.answers.account(self._ticket.holder)

    def answer(self, done: Done) -> Response:
        """Return what came of the work as a response."""
        self.note(**done.noted)
        return json_response(done.body)


async def ask_store(services: Services, call: Callable[[], T]) -> T:
    """Return what the store says, in one of its threads.

    Raises
    ------
    StoreError
        When it cannot do what is asked, or does not answer in `STORE_SECONDS`. What was to be written may have been
        written all the same.
    """
    try:
        async with asyncio.timeout(STORE_SECONDS):
            return await services.store_threads.run(call)
    except TimeoutError:
        raise StoreAwayError from None


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
