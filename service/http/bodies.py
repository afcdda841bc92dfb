"""The first stage of a request: its body is received, bounded in bytes and in time, unpacked, parsed and checked."""

from __future__ import annotations

import asyncio
import zlib
from collections.abc import Callable
from functools import partial
from typing import TypeVar

from pydantic import BaseModel

from linefix.documents.errors import BodyTooLargeError, NotJsonError
from linefix.documents.limits import Limits
from linefix.documents.reading import read_model
from linefix.operations import Stopwatch

from ..admission.budget import Take
from ..errors import BodyBrokenError, BodyTooSlowError, EncodingError, MediaTypeError
from ..parsing.child import LARGE
from .exchange import JSON, Exchange

T = TypeVar("T")
M = TypeVar("M", bound=BaseModel)
Reader = Callable[[bytes | bytearray, Limits], T]
"""A function from JSON to a checked request; a module's function, so that another process can call it."""
FORM = "multipart/form-data"
_PIECE = 1 << 20  # bytes that are unpacked at a time
_GZIP = zlib.MAX_WBITS | 16


async def read(exchange: Exchange, model: type[M]) -> M:
    """Receive the body and check it against a model; raises as `receive`."""
    return await read_by(exchange, partial(read_model, model))


async def read_by(exchange: Exchange, reader: Reader[T]) -> T:
    """Receive the body and check it; the deadline counts from the moment when the body is there."""
    with exchange.services.bodies.account(exchange.ticket.holder) as take:
        return await parse(exchange, reader, await receive(exchange, take))


async def receive(exchange: Exchange, take: Take, taken: str = JSON) -> bytearray:
    """Receive the body, of the media type that is `taken`, and unpack it; `take` counts its bytes as held.

    Raises
    ------
    MediaTypeError, EncodingError
        When it is of another kind.
    BodyTooLargeError
        When it is larger than allowed.
    TooMuchHeldError, ShareHeldError
        When too much of all requests, or of this holder's, is in memory already.
    BodyBrokenError, BodyTooSlowError
        When it does not come whole, or not in time.
    NotJsonError
        When it is not gzip as its head states.
    """
    services, settings = exchange.services, exchange.services.settings
    gzipped, data, more = _is_gzip(exchange, taken), bytearray(), True
    try:
        async with asyncio.timeout_at(exchange.arrived + settings.request_timeout_s):
            while more:
                message = await exchange.receive()
                if message["type"] != "http.request":  # from the server, malformed chunks look the same
                    raise BodyBrokenError
                piece, more = message.get("body", b""), message.get("more_body", False)
                _require_within(len(data) + len(piece), settings.max_body_bytes)
                take(len(piece))
                data += piece
    except TimeoutError:
        raise BodyTooSlowError(settings.request_timeout_s) from None
    if exchange.ticket.searches:
        services.gate.enter(exchange.ticket)
    exchange.watch = Stopwatch()
    exchange.limit(None)
    if gzipped:
        packed = data
        data = await exchange.run(partial(unpack, packed, settings.max_body_bytes, take), services.parsing)
        take(-len(packed))
    return data


async def parse(exchange: Exchange, reader: Reader[T], data: bytes | bytearray) -> T:
    """Check a large body, in another process, as soon as it has a slot; a small one at once: it takes a millisecond.

    These slots are shared between callers, and are not those of the searches: no search waits for a large body.
    """
    services = exchange.services
    if len(data) <= LARGE:
        return reader(data, services.limits)
    return await exchange.run(partial(services.parser.call, reader, data, services.limits), services.parsing)


def unpack(packed: bytearray, max_bytes: int, take: Take) -> bytearray:
    """Return what gzip holds, never more than `max_bytes`; takes a while for a large one.

    Only one member is taken: millions of empty ones, which `gzip` reads in one call, would pass every deadline.

    Raises
    ------
    NotJsonError
        When it is not gzip, is cut short, or something follows it.
    BodyTooLargeError
        When it unpacks to more than is allowed.
    """
    unpacked, stream, rest, end = bytearray(), zlib.decompressobj(wbits=_GZIP), b"", 0
    try:
        while not stream.eof and (rest or end < len(packed)):
            piece = stream.decompress(rest or packed[end : end + _PIECE], _PIECE)
            end += 0 if rest else _PIECE
            _require_within(len(unpacked) + len(piece), max_bytes)
            take(len(piece))
            unpacked += piece
            rest = stream.unconsumed_tail
    except zlib.error:
        raise NotJsonError("the body is not gzip, but its Content-Encoding is; send gzip, or omit the header") from None
    if not stream.eof:
        raise NotJsonError("the gzip body is cut short; send it completely")
    if stream.unused_data or end < len(packed):
        raise NotJsonError("more bytes follow the gzip body; expected a single gzip member")
    return unpacked


def _require_within(size: int, max_bytes: int) -> None:
    if size > max_bytes:
        raise BodyTooLargeError(max_bytes)


def _is_gzip(exchange: Exchange, taken: str) -> bool:
    """Return whether a body is gzip; refuse media types and encodings that are not supported.

    Without keys of the service, a POST has to name its media type. A browser that sends a POST for the page of
    another site cannot name JSON without a preflight request.
    """
    headers = exchange.headers
    unnamed = "" if exchange.scope["method"] == "POST" and not exchange.services.settings.guarded else taken
    kind = headers.get("content-type", unnamed).partition(";")[0].strip().lower()
    if kind != taken and not (taken == JSON and kind.startswith("application/") and kind.endswith("+json")):
        raise MediaTypeError(taken)
    named = map(str.strip, headers.get("content-encoding", "").lower().split(","))
    encodings = [name for name in named if name not in ("", "identity")]
    if encodings not in ([], ["gzip"], ["x-gzip"]):
        raise EncodingError
    return bool(encodings)
