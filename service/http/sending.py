"""Answers that are too large to be handed over in one piece.

Data that is handed to the server waits in its memory for as long as the client takes to read it. Large answers go piece
by piece. The bytes that they hold until then are counted: of all together, and of each caller.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine, Mapping
from functools import partial
from typing import Any

from starlette.responses import Response
from starlette.types import Receive, Scope, Send

from association import Deadline

from ..work.job import Done, Job
from .bodies import JSON
from .exchange import Exchange, exchange_of
from .search_stage import in_search_slot, unless_hung_up

PIECE = 32_768  # bytes; the server holds a few
LARGE = 65_536  # bytes; smaller answers are handed over in one piece


class PiecewiseResponse(Response):
    """An answer that is handed over piece by piece, as the client takes it.

    A client that takes none of it for `request_timeout_s` loses the connection.
    """

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send it."""
        exchange = exchange_of(scope)
        seconds = exchange.services.settings.request_timeout_s
        whole = memoryview(self.body)
        await send({"type": "http.response.start", "status": self.status_code, "headers": self.raw_headers})
        for begin in range(0, len(whole), PIECE):
            piece, more = bytes(whole[begin : begin + PIECE]), begin + PIECE < len(whole)
            try:
                async with asyncio.timeout(seconds):
                    await send({"type": "http.response.body", "body": piece, "more_body": more})
            except TimeoutError:
                exchange.note(sent_bytes=begin)
                return  # the server ends the connection


class CountedResponse(PiecewiseResponse):
    """An answer whose bytes count as held until the client has taken them, all but the last few.

    Raises
    ------
    TooMuchHeldError, ShareHeldError
        When it is sent, before its first byte: when too much waits to be read already.
    """

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send it."""
        exchange = exchange_of(scope)
        with exchange.services.answers.account(exchange.ticket.holder) as account:
            account.take(len(self.body))
            await super().__call__(scope, receive, send)


def json_response(data: bytes, status: int = 200, headers: Mapping[str, str] | None = None) -> Response:
    """Return JSON that is encoded already."""
    kind = Response if len(data) <= LARGE else CountedResponse
    return kind(data, status, headers, JSON)


async def answer(exchange: Exchange, work: Coroutine[Any, Any, Done], deadline: Deadline) -> Response:
    """Wait for the work of a request and return its result as a response; raises also `HangUpError`."""
    done = await unless_hung_up(exchange.request.receive, work, deadline)
    exchange.note(**done.noted)
    return json_response(done.body)


async def answer_in_slot(exchange: Exchange, work: Callable[[Job], Done]) -> Response:
    """Do the whole work of a request in one slot of the gate, and return its result as a response."""
    job = exchange.job()
    return await answer(exchange, in_search_slot(exchange, partial(work, job), job.deadline), job.deadline)
