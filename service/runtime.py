"""What one running application holds, and the way of a request through it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any, TypeVar

from starlette.requests import Request

from association import Deadline

from .admission.entrance import Doors
from .admission.fair_queue import Holder
from .admission.gate import ANNOUNCED, SearchGate, end_announcement
from .admission.keys import Keyring
from .http.bodies import BodyReader, wait_for_hang_up
from .http.problems import ProblemError
from .maps import IndexCache, MapStore
from .maps.lookup import LARGE, MapLookup
from .parsing.parser_process import ParserProcess
from .parsing.reading import Limits, unpack
from .process.part import WHOLE, Part
from .settings import Settings
from .telemetry.metrics import Metrics
from .work.stopwatch import Stopwatch

T = TypeVar("T")
Reader = Callable[[bytes | bytearray, Limits], T]
"""From JSON to what was asked for; a function of a module, so that another process can call it."""

SMALL = 16_384  # bytes; smaller bodies are parsed in less time than it takes to hand them to a thread


class HangUpError(Exception):
    """The client is gone; there is nobody to answer."""


class Runtime:
    """The parts of an application, made by `create_app`, opened and closed with its lifespan."""

    def __init__(self, settings: Settings, part: Part = WHOLE) -> None:
        self.settings = settings
        self.limits = settings.limits()
        self.metrics = Metrics()
        self.bodies = BodyReader(
            settings.max_body_bytes,
            max(settings.max_body_bytes, part.share(settings.max_bodies_bytes)),
            settings.request_timeout,
        )
        self.gate = SearchGate(part.share(settings.searches), part.share(settings.queue))
        self.keyring = Keyring(settings.keys)
        self.doors = Doors(self.gate, self.keyring, self.metrics, settings.max_body_bytes)
        self.store = MapStore(settings.url)
        self.cache = IndexCache(part.share(settings.cache_bytes), self.metrics)
        self.parser = ParserProcess()
        self.lookup = MapLookup(self.cache, self.store, self.parser)
        self.warm = False
        self.draining = False
        self._parsers = ThreadPoolExecutor(2, thread_name_prefix="parse")
        self._store_threads = ThreadPoolExecutor(4, thread_name_prefix="store")
        self._probe_thread = ThreadPoolExecutor(1, thread_name_prefix="probe")
        self._looking: asyncio.Future[None] | None = None
        self.metrics.watch("linefix_workers_ready", "Processes that take requests", lambda: self.takes_requests)
        self.metrics.watch("linefix_searches_running", "Searches that run", lambda: self.gate.running)
        self.metrics.watch("linefix_searches_waiting", "Searches that wait", lambda: self.gate.waiting)
        self.metrics.watch("linefix_bodies_bytes", "Bytes of requests held", lambda: self.bodies.held)
        self.metrics.watch("linefix_map_cache_bytes", "Bytes of indexed maps held", lambda: self.cache.bytes)
        self.metrics.watch("linefix_map_cache_maps", "Indexed maps held", lambda: len(self.cache))

    @property
    def takes_requests(self) -> bool:
        """Whether it is neither warming up nor going down."""
        return self.warm and not self.draining

    async def read(self, request: Request, reader: Reader[T]) -> tuple[T, Stopwatch]:
        """Read a body and check it, off the event loop where that takes long; the watch starts when it is there.

        A large one is parsed in a turn at the gate, like a search: it takes a core for a while, too.
        """
        async with self.bodies.reading(request) as body:
            watch = Stopwatch()
            data = body.data
            if body.gzipped:
                data = await self._in(self._parsers, partial(unpack, body, self.settings.max_body_bytes))
            if len(data) <= SMALL:
                return reader(data, self.limits), watch
            if len(data) <= LARGE:
                return await self._in(self._parsers, partial(reader, data, self.limits)), watch
            deadline = watch.deadline(None, self.settings.max_deadline_ms)
            call = partial(self.parser.call, reader, data, self.limits)
            return await self.search(request, call, deadline), watch

    async def in_store(self, call: Callable[[], T]) -> T:
        """Run a call of the store in a thread of its own."""
        return await self._in(self._store_threads, call)

    async def open_store(self) -> None:
        """Make sure that the store's tables exist."""
        await self._in(self._probe_thread, self.store.open)

    async def check_store(self) -> None:
        """Return when the store answers; probes that come together share one look."""
        if self._looking is None or self._looking.done():
            self._looking = asyncio.ensure_future(self.open_store())
        await asyncio.shield(self._looking)

    async def in_parser(self, call: Callable[[], T]) -> T:
        """Run something that takes time but is no search."""
        return await self._in(self._parsers, call)

    def require_ready(self, request: Request) -> None:
        """Refuse, before a body is read, what could not be served."""
        if not self.warm:
            raise ProblemError("not_ready", "the kernels are being compiled")
        # One that was announced has been let in by the doors.
        refusal = None if ANNOUNCED in request.scope["state"] else self.gate.refusal(holder_of(request))
        if refusal is not None:
            raise refusal

    async def search(self, request: Request, call: Callable[[], T], deadline: Deadline) -> T:
        """Run a search when its turn comes; give up when the client does."""
        return await self.unless_hung_up(request, self.take_turn(request, call, deadline), deadline)

    async def take_turn(self, request: Request, call: Callable[[], T], deadline: Deadline) -> T:
        """Run a part of a request when its turn comes; what was let in once is not sent away later."""
        state = request.scope["state"]
        end_announcement(request.scope)
        admitted = state.get("admitted", False)
        found = await self.gate.run(call, deadline, holder_of(request), admitted=admitted)
        state["admitted"] = True
        return found

    async def unless_hung_up(self, request: Request, work: Coroutine[Any, Any, T], deadline: Deadline) -> T:
        """Wait for work, or cancel it when the client is gone first.

        Raises
        ------
        HangUpError
            When the client is gone.
        """
        task = asyncio.ensure_future(work)
        gone = asyncio.ensure_future(wait_for_hang_up(request))
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

    def close(self) -> None:
        """Give up what still runs and give everything back."""
        self.gate.cancel_all()
        self.gate.close()
        self.parser.close()
        for threads in (self._parsers, self._store_threads, self._probe_thread):
            threads.shutdown(wait=False, cancel_futures=True)
        self.store.close()

    async def _in(self, threads: ThreadPoolExecutor, call: Callable[[], T]) -> T:
        return await asyncio.get_running_loop().run_in_executor(threads, call)


def holder_of(request: Request) -> Holder:
    """Return whose key a request came with."""
    holder: Holder = request.scope["state"]["holder"]
    return holder


def runtime_of(request: Request) -> Runtime:
    """Return the parts of the application that a request came to."""
    runtime = request.app.state.runtime
    assert isinstance(runtime, Runtime)
    return runtime
