"""The first stage of a request: its body is received, bounded in bytes and in time, unpacked, parsed and checked."""

from __future__ import annotations

import asyncio
import zlib
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from functools import partial
from typing import TypeVar

from starlette.requests import Request

from linefix.documents.errors import BodyTooLargeError, NotJsonError
from linefix.documents.limits import Limits

from ..admission.budget import ByteAccount
from ..errors import BodyTooSlowError, EncodingError, MediaTypeError
from ..parsing.child import LARGE
from .exchange import JSON, Exchange, unless_hung_up

T = TypeVar("T")
Reader = Callable[[bytes | bytearray, Limits], T]
"""A function from JSON to a checked request; a module's function, so that another process can call it."""
FORM = "multipart/form-data"
_PIECE = 1 << 20  # bytes that are unpacked at a time
_GZIP = zlib.MAX_WBITS | 16


async def read(exchange: Exchange, reader: Reader[T]) -> T:
    """Receive the body and check it, off the event loop where that takes long.

    The deadline counts from the moment when the body is there.
    """
    async with receive(exchange) as data:
        if len(data) <= LARGE:
            return reader(data, exchange.services.limits)
        return await unless_hung_up(exchange.request.receive, parse(exchange, reader, data), exchange.give_up)


@asynccontextmanager
async def receive(exchange: Exchange, *, form: bool = False) -> AsyncIterator[bytearray]:
    """Receive the body, JSON or a form with files, and unpack it; its bytes count as held until the block ends.

    Raises
    ------
    MediaTypeError, EncodingError
        When it is of another kind.
    BodyTooLargeError
        When it is larger than allowed.
    TooMuchHeldError, ShareHeldError
        When too much of all requests, or of this holder's, is in memory already.
    BodyTooSlowError
        When it does not come in time.
    NotJsonError
        When it is not gzip as its head states.
    """
    services, request, settings = exchange.services, exchange.request, exchange.services.settings
    gzipped = is_gzip(request, form=form, guarded=settings.guarded)
    with services.bodies.account(exchange.ticket.holder) as account:
        seconds = settings.request_timeout_s
        data = await receive_body(
            request, exchange.arrived, account, max_bytes=settings.max_body_bytes, timeout=seconds
        )
        if request.method == "POST":
            services.gate.enter(exchange.ticket)
        exchange.begin()
        if gzipped:
            packed = data
            call = partial(unpack, packed, settings.max_body_bytes, account.take)
            data = await services.parsing.run(call, exchange.deadline, exchange.ticket)
            account.take(-len(packed))
            packed.clear()
        yield data


async def parse(exchange: Exchange, reader: Reader[T], data: bytes | bytearray) -> T:
    """Check a large body, in another process, as soon as it has a slot; a small one at once: it takes a millisecond.

    These slots are shared between callers, and are not those of the searches: no search waits for a large body.
    """
    services = exchange.services
    if len(data) <= LARGE:
        return reader(data, services.limits)
    call = partial(services.parser.call, reader, data, services.limits)
    return await services.parsing.run(call, exchange.deadline, exchange.ticket)


async def receive_body(
    request: Request, arrived: float, account: ByteAccount, *, max_bytes: int, timeout: float
) -> bytearray:
    """Receive a body whole, so many seconds after its first byte had arrived; raises as `receive`."""
    data = bytearray()
    try:
        async with asyncio.timeout_at(arrived + timeout):
            async for piece in request.stream():
                if len(data) + len(piece) > max_bytes:
                    raise BodyTooLargeError(max_bytes)
                account.take(len(piece))
                data += piece
    except TimeoutError:
        raise BodyTooSlowError(timeout) from None
    return data


def unpack(packed: bytes | bytearray, max_bytes: int, take: Callable[[int], None]) -> bytearray:
    """Return what one gzip member holds; takes a while for a large one.

    Parameters
    ----------
    packed : bytes or bytearray
    max_bytes : int
        That it may unpack to; more is never held.
    take : callable
        Called with the number of further bytes, piece by piece; an exception from it ends this.

    Raises
    ------
    NotJsonError
        When it is not gzip, is cut short, or something follows it.
    BodyTooLargeError
        When it unpacks to more than is allowed.
    """
    unpacked = bytearray()
    stream = zlib.decompressobj(wbits=_GZIP)
    whole = memoryview(packed)
    try:
        for begin in range(0, len(whole), _PIECE):
            rest: bytes | memoryview = whole[begin : begin + _PIECE]
            while rest and not stream.eof:
                piece = stream.decompress(rest, min(_PIECE, max_bytes + 1 - len(unpacked)))
                take(len(piece))
                unpacked += piece
                rest = stream.unconsumed_tail
                if len(unpacked) > max_bytes:
                    raise BodyTooLargeError(max_bytes)
            if stream.eof and (stream.unused_data or begin + _PIECE < len(whole)):
                raise NotJsonError("more bytes follow the gzip body; expected a single gzip member")
        unpacked += stream.flush()
    except zlib.error:
        raise NotJsonError(
            "the body is not gzip, but Content-Encoding states it; send gzip, or omit the header"
        ) from None
    if not stream.eof:
        raise NotJsonError("the gzip body is cut short; send it completely")
    return unpacked


def is_gzip(request: Request, *, form: bool, guarded: bool) -> bool:
    """Return whether a body is gzip; refuse media types and encodings that are not supported.

    Parameters
    ----------
    request : Request
    form : bool
        True when it is to be a form with files; else it is to be JSON.
    guarded : bool
        True when the service has keys. Without them a POST has to name its media type. A browser that sends a POST for
        the page of another site cannot name JSON without a preflight request.

    Raises
    ------
    MediaTypeError, EncodingError
    """
    taken = FORM if form else JSON
    content_type = request.headers.get("content-type", taken if guarded or request.method != "POST" else "")
    media_type = content_type.split(";")[0].strip().lower()
    if media_type != FORM if form else not _is_json(media_type):
        raise MediaTypeError(taken)
    encodings = [part.strip().lower() for part in request.headers.get("content-encoding", "").split(",")]
    encodings = [part for part in encodings if part not in ("", "identity")]
    if encodings not in ([], ["gzip"], ["x-gzip"]):
        raise EncodingError
    return bool(encodings)


def _is_json(media_type: str) -> bool:
    return media_type == JSON or (media_type.startswith("application/") and media_type.endswith("+json"))
