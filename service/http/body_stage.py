"""The first stage of a request: its body is received, unpacked, parsed and checked."""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from functools import partial
from typing import TypeVar

from pydantic import BaseModel

from association import Deadline
from linefix.documents.limits import Limits
from linefix.documents.reading import read_model
from linefix.operations import Stopwatch

from ..parsing.child import LARGE
from ..telemetry.traces import stage
from .bodies import is_gzip, receive_body, unpack
from .exchange import Exchange
from .search_stage import unless_hung_up

T = TypeVar("T")
M = TypeVar("M", bound=BaseModel)
Reader = Callable[[bytes | bytearray, Limits], T]
"""A function from JSON to a checked request; a module's function, so that another process can call it."""


async def read_request(exchange: Exchange, model: type[M]) -> M:
    """Receive the body and check it against a model, as `read`."""
    return await read(exchange, partial(read_model, model))


async def read(exchange: Exchange, reader: Reader[T]) -> T:
    """Receive the body and check it, off the event loop where that takes long.

    The deadline counts from the moment when the body is there.
    """
    async with receive(exchange) as data:
        with stage("parse"):
            if len(data) <= LARGE:
                return reader(data, exchange.services.limits)
            deadline = exchange.job().deadline
            return await unless_hung_up(exchange.request.receive, parse(exchange, reader, data, deadline), deadline)


@asynccontextmanager
async def receive(exchange: Exchange, *, form: bool = False) -> AsyncIterator[bytearray]:
    """Receive the body, JSON or a form with files, and unpack it; its bytes count as held until the block ends."""
    services, request, settings = exchange.services, exchange.request, exchange.services.settings
    max_bytes = settings.max_body_bytes
    gzipped = is_gzip(request, form=form, guarded=settings.guarded)
    with services.bodies.account(exchange.ticket.holder) as account:
        data = await receive_body(
            request, exchange.arrived, account, max_bytes=max_bytes, timeout=settings.request_timeout_s
        )
        if request.method == "POST":
            services.gate.enter(exchange.ticket)
        exchange.watch = Stopwatch()
        if gzipped:
            packed = data
            call = partial(unpack, packed, max_bytes, account.take)
            data = await services.parsing.run(call, exchange.job().deadline, exchange.ticket)
            account.take(-len(packed))
            packed.clear()
        yield data


async def parse(exchange: Exchange, reader: Reader[T], data: bytes | bytearray, deadline: Deadline) -> T:
    """Check a large body, in another process, as soon as it has a slot; a small one at once: it takes a millisecond.

    These slots are shared between callers, and are not those of the searches: no search waits for a large body.
    """
    services = exchange.services
    if len(data) <= LARGE:
        return reader(data, services.limits)
    call = partial(services.parser.call, reader, data, services.limits)
    return await services.parsing.run(call, deadline, exchange.ticket)
