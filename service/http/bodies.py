"""The first stage of a request: its body is received, bounded in bytes and in time, unpacked, parsed and checked.

The rest of a body that no route reads is dropped.

A server that closes a connection with bytes unread has the system reset it, and the reset overtakes the answer: the
client sees a broken connection in place of a refusal.
"""

from __future__ import annotations

import asyncio
import zlib
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import asynccontextmanager, suppress
from functools import partial
from typing import TypeVar

from pydantic import BaseModel
from starlette.requests import Request
from starlette.types import Message, Receive

from association import Deadline
from linefix.documents.errors import BodyTooLargeError, NotJsonError
from linefix.documents.limits import Limits
from linefix.documents.reading import read_model
from linefix.operations import Stopwatch

from ..admission.budget import ByteAccount
from ..errors import BodyTooSlowError, EncodingError, MediaTypeError
from ..parsing.child import LARGE
from ..telemetry.traces import stage
from .exchange import Exchange
from .search_stage import unless_hung_up

T = TypeVar("T")
M = TypeVar("M", bound=BaseModel)
Reader = Callable[[bytes | bytearray, Limits], T]
"""A function from JSON to a checked request; a module's function, so that another process can call it."""
JSON, FORM = "application/json", "multipart/form-data"
DROP_SECONDS = 3.0  # s that the rest of a body may take to come
_PIECE = 1 << 20  # bytes that are unpacked at a time
_GZIP = zlib.MAX_WBITS | 16


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


async def receive_body(
    request: Request, arrived: float, account: ByteAccount, *, max_bytes: int, timeout: float
) -> bytearray:
    """Receive a body whole; its bytes count as held by the account.

    Parameters
    ----------
    request : Request
    arrived : float
        When its first byte came, by the event loop's clock, seconds.
    account : ByteAccount
    max_bytes : int
    timeout : float
        Seconds that the request may take to arrive, its head included.

    Raises
    ------
    BodyTooLargeError
        When it is larger than allowed.
    TooMuchHeldError, ShareHeldError
        When too much of all requests, or of this holder's, is in memory already.
    BodyTooSlowError
        When it does not come in time.
    """
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


class Intake:
    """The body of one request.

    Parameters
    ----------
    receive : Receive
        Of the server.
    headers : sequence of (bytes, bytes)
    """

    def __init__(self, receive: Receive, headers: Sequence[tuple[bytes, bytes]]) -> None:
        self._receive = receive
        # A client that waits for "100 Continue" has sent nothing yet.
        self._unread = any(_announces_body(*field) for field in headers) and not any(
            name == b"expect" for name, _ in headers
        )

    async def receive(self) -> Message:
        """Return the next message."""
        message = await self._receive()
        self._unread = message["type"] == "http.request" and message.get("more_body", False)
        return message

    async def drop_rest(self, most_bytes: int) -> bool:
        """Read the rest and drop it, as far as it comes soon and is not too much; return whether there is no more."""
        if not self._unread:
            return True
        dropped = 0
        with suppress(TimeoutError):
            async with asyncio.timeout(DROP_SECONDS):
                while self._unread and dropped <= most_bytes:
                    dropped += len((await self.receive()).get("body", b""))
        return not self._unread


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


def _announces_body(name: bytes, value: bytes) -> bool:
    return name == b"transfer-encoding" or (name == b"content-length" and value != b"0")
