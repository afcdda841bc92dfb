"""Receive a request's body, bounded in bytes and in time; drop the rest of a body that no route reads.

A server that closes a connection with bytes unread has the system reset it, and the reset overtakes the answer: the
client sees a broken connection in place of a refusal.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass

from starlette.requests import Request
from starlette.types import Message, Receive

from linefix.documents.errors import BodyTooLargeError

from ..admission.budget import ByteAccount, ByteBudget
from ..admission.key_file import Holder
from ..errors import BodyTooSlowError, EncodingError, MediaTypeError

JSON, FORM = "application/json", "multipart/form-data"
DROP_SECONDS = 3.0  # s that the rest of a body may take to come


@dataclass(frozen=True, slots=True)
class Body:
    """A body as it arrived.

    Attributes
    ----------
    data : bytearray
    gzipped : bool
    account : ByteAccount
        Account of its bytes, and of those that it unpacks to.
    """

    data: bytearray
    gzipped: bool
    account: ByteAccount


class BodyReceiver:
    """Receives bodies.

    Parameters
    ----------
    max_bytes : int
        Of one body, as it arrives.
    budget : ByteBudget
        Of all bodies that are being read or parsed.
    timeout : float
        Seconds that a request may take to arrive, its head included.
    guarded : bool
        True when the service has keys. Without them a POST has to name its media type. A browser that sends a POST for
        the page of another site cannot name JSON without a preflight request.
    """

    def __init__(self, max_bytes: int, budget: ByteBudget, timeout: float, *, guarded: bool = True) -> None:
        self._max_bytes = max_bytes
        self._budget = budget
        self._timeout = timeout
        self._guarded = guarded

    @asynccontextmanager
    async def receiving(
        self, request: Request, arrived: float, holder: Holder = None, *, form: bool = False
    ) -> AsyncIterator[Body]:
        """Receive a body whole; its bytes count as held until the block ends.

        Parameters
        ----------
        request : Request
        arrived : float
            When its first byte came, by the event loop's clock, seconds.
        holder : Holder
            The sender.
        form : bool
            True when it is to be a form with files; else it is to be JSON.

        Raises
        ------
        MediaTypeError, EncodingError
            When it is something else by its head.
        BodyTooLargeError
            When it is larger than allowed.
        TooMuchHeldError, ShareHeldError
            When too much of all requests, or of this holder's, is in memory already.
        BodyTooSlowError
            When it does not come in time.
        """
        if not self._guarded and request.method == "POST" and "content-type" not in request.headers:
            raise MediaTypeError(FORM if form else JSON)
        gzipped = _is_gzip(request, form=form)
        with self._budget.account(holder) as account:
            data = bytearray()
            try:
                async with asyncio.timeout_at(arrived + self._timeout):
                    async for piece in request.stream():
                        if len(data) + len(piece) > self._max_bytes:
                            raise BodyTooLargeError(self._max_bytes)
                        account.take(len(piece))
                        data += piece
            except TimeoutError:
                raise BodyTooSlowError(self._timeout) from None
            yield Body(data, gzipped, account)


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


def _is_gzip(request: Request, *, form: bool) -> bool:
    """Return whether a body is gzip; refuse media types and encodings that are not supported."""
    content_type = request.headers.get("content-type", FORM if form else JSON)
    media_type = content_type.split(";")[0].strip().lower()
    if media_type != FORM if form else not _is_json(media_type):
        raise MediaTypeError(FORM if form else JSON)
    encodings = [part.strip().lower() for part in request.headers.get("content-encoding", "").split(",")]
    encodings = [part for part in encodings if part not in ("", "identity")]
    if encodings not in ([], ["gzip"], ["x-gzip"]):
        raise EncodingError
    return bool(encodings)


def _is_json(media_type: str) -> bool:
    return media_type == JSON or (media_type.startswith("application/") and media_type.endswith("+json"))


def _announces_body(name: bytes, value: bytes) -> bool:
    return name == b"transfer-encoding" or (name == b"content-length" and value != b"0")
