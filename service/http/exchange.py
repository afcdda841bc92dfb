"""One request while it is served, from its head to its line in the log; routes get it by `Depends`.

`middleware` makes and ends it, `bodies` reads its body, `stages` has its map looked up and searched, `answer` ends it.

A server that closes a connection with bytes unread has the system reset it, and the reset overtakes the answer: the
client sees a broken connection in place of a refusal. So the rest of a body that no route reads is dropped first. Data
that is handed to the server waits in its memory for as long as the client takes to read it: a large answer goes in
pieces.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable, Mapping
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from typing import Annotated, TypeVar

from fastapi import Depends, Path, Request
from starlette.datastructures import Headers
from starlette.responses import Response
from starlette.types import Message, Receive, Scope, Send

from ..admission.gate import Gate, Ticket
from ..services import Services
from ..work.job import Job

T = TypeVar("T")
KEY = "linefix.exchange"
"""Key of the exchange in the scope of a request."""
JSON = "application/json"
WATCH_AFTER = 0.02  # s until the connection is watched: most answers are ready earlier
DROP_SECONDS = 3.0  # s that the rest of a body may take to come
STRANGERS_BYTES = 65_536  # of the rest of a body that are dropped, from a caller without a key
DROPPED = 4  # times the largest body: so much of the rest is dropped, from others
PIECE = 32_768  # bytes of an answer; the server holds a few pieces
LARGE = 65_536  # bytes of an answer; a smaller one is handed over in one piece, a larger one counts until it was read
BODY = {b"content-length", b"transfer-encoding"}
ALWAYS = ((b"server", b"linefix"), (b"x-content-type-options", b"nosniff"))
CLOSE = (b"connection", b"close")


class HangUpError(Exception):
    """The client hung up; no answer can be sent."""


@dataclass(slots=True, kw_only=True)
class Exchange(Job):
    """One request and its answer.

    Attributes
    ----------
    services : Services
        Of its application.
    scope : Scope
    source, sink : callable
        `receive` and `send` of the server.
    arrived : float
        When its head arrived, by `time.monotonic`, which is the event loop's clock, seconds.
    ticket : Ticket
        Its admission.
    held : ExitStack
        Accounts of bytes that are given back when the exchange ends.
    status : int
        Of the answer; 0 until it begins.
    unread : bool
        True while parts of the body may come.
    is_strangers : bool
        True when the connection is to end with the answer.
    """

    services: Services
    scope: Scope
    source: Receive
    sink: Send
    arrived: float = field(default_factory=time.monotonic)
    ticket: Ticket = field(default_factory=Ticket)
    held: ExitStack = field(default_factory=ExitStack)
    status: int = 0
    unread: bool = False
    is_strangers: bool = False

    def __post_init__(self) -> None:
        names = {name for name, _ in self.scope["headers"]}
        # A client that waits for "100 Continue" has sent nothing yet.
        self.unread = not names.isdisjoint(BODY) and b"expect" not in names

    @property
    def headers(self) -> Headers:
        """The headers of the request."""
        return Headers(scope=self.scope)

    async def receive(self) -> Message:
        """Return the next message of the server."""
        message = await self.source()
        self.unread = message["type"] == "http.request" and message.get("more_body", False)
        return message

    async def send(self, message: Message) -> None:
        """Send the head of an answer with the headers that all have, or a part of its body.

        Raises
        ------
        HangUpError
            When the client has taken no more of a large one for `request_timeout_s`.
        """
        if message["type"] == "http.response.start":
            self.status = message["status"]
            await self._drop_rest()  # the server would read on without end
            ends = (CLOSE,) if self.unread or self.is_strangers else ()
            own = (b"x-request-id", self.request_id.encode("ascii"))
            await self.sink({**message, "headers": [*message.get("headers", ()), own, *ALWAYS, *ends]})
            return
        body, more = memoryview(message.get("body", b"")), message.get("more_body", False)
        if len(body) <= LARGE and not more:
            await self.sink(message)
            return
        for begin in range(0, len(body), PIECE):
            piece, rest = bytes(body[begin : begin + PIECE]), more or begin + PIECE < len(body)
            try:
                async with asyncio.timeout(self.services.settings.request_timeout_s):
                    await self.sink({"type": "http.response.body", "body": piece, "more_body": rest})
            except TimeoutError:
                raise HangUpError from None  # the server ends the connection
            await asyncio.sleep(0)  # the server waits for slow readers only: a fast one would hold up everything else

    async def _drop_rest(self) -> None:
        """Read the rest of the body and drop it, as far as it comes soon and is not too much."""
        if not self.unread:
            return
        dropped, most = 0, STRANGERS_BYTES if self.is_strangers else DROPPED * self.services.settings.max_body_bytes
        with suppress(TimeoutError):
            async with asyncio.timeout(DROP_SECONDS):
                while self.unread and dropped <= most:
                    dropped += len((await self.receive()).get("body", b""))

    def limit(self, deadline_ms: float | None) -> None:
        """Take the deadline of the request, at most the service's own; None: that."""
        self.deadline = self.watch.deadline(deadline_ms, self.services.settings.max_deadline_ms)

    async def run(self, call: Callable[[], T], gate: Gate | None = None) -> T:
        """Run a part of this request in a slot of a gate, left out: that of the searches; it is not refused later."""
        return await (gate or self.services.gate).run(call, self.deadline, self.ticket)

    async def answer(self, call: Callable[[], bytes], gate: Gate | None = None) -> Response:
        """Run the last part of this request, as `run` does, and return its JSON as a response."""
        return self.json(await self.run(call, gate))

    def json(self, data: bytes, status: int = 200, headers: Mapping[str, str] | None = None) -> Response:
        """Return JSON as a response. A large one counts as held until the client has taken it, all but the last few.

        Raises
        ------
        TooMuchHeldError, ShareHeldError
            When too much waits to be read already.
        """
        if len(data) > LARGE:
            self.held.enter_context(self.services.answers.account(self.ticket.holder))(len(data))
        return Response(data, status, headers, JSON)

    async def unless_hung_up(self, work: Awaitable[T]) -> T:
        """Wait for work, and cancel it when the client hangs up first, after it has sent its body.

        The work stays in the task of the request, and the watch starts later: each would cost a request tens of
        microseconds.

        Raises
        ------
        HangUpError
            When the client hung up.
        """
        watches: list[asyncio.Task[None]] = []

        async def watch() -> None:
            while self.unread:
                await asyncio.sleep(WATCH_AFTER)
            while (await self.receive())["type"] != "http.disconnect":
                pass
            self.deadline.cancel()
            limit.reschedule(0.0)

        begin = asyncio.get_running_loop().call_later(WATCH_AFTER, lambda: watches.append(asyncio.create_task(watch())))
        try:
            async with asyncio.timeout(None) as limit:
                return await work
        except TimeoutError:
            if not limit.expired():
                raise
            raise HangUpError from None
        finally:
            begin.cancel()
            for task in watches:
                task.cancel()


async def _exchange_of(request: Request) -> Exchange:
    found: Exchange = request.scope[KEY]
    return found


MapIdPath = Annotated[
    str, Path(pattern="^[A-Za-z0-9._-]+$", min_length=1, max_length=128, examples=["hq-3"], description="the map's id")
]
Admitted = Annotated[Exchange, Depends(_exchange_of)]
"""A request that was let in; one that searches, after the kernels were loaded."""
