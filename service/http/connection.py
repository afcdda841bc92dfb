"""The connection of one request: the rest of a body that no route reads is dropped, and an answer goes in pieces.

A server that closes a connection with bytes unread has the system reset it, and the reset overtakes the answer: the
client sees a broken connection in place of a refusal. Data that is handed to the server waits in its memory for as long
as the client takes to read it.
"""

from __future__ import annotations

import asyncio
from contextlib import suppress

from starlette.types import Message, Receive, Scope, Send

from ..settings import Settings

DROP_SECONDS = 3.0  # s that the rest of a body may take to come
STRANGERS_BYTES = 65_536  # of the rest of a body that are dropped, from a caller without a key
PIECE = 32_768  # bytes of an answer; the server holds a few pieces
LARGE = 65_536  # bytes; smaller answers are handed over in one piece
ALWAYS = ((b"server", b"linefix"), (b"x-content-type-options", b"nosniff"))
CLOSE = (b"connection", b"close")


class Connection:
    """The connection of a request, as long as this is served.

    Parameters
    ----------
    scope : Scope
        Of the request.
    receive, send : callable
        Of the server.
    settings : Settings
    request_id : str
        For the answer.

    Attributes
    ----------
    status : int
        Of the answer; 0 until it begins.
    noted : dict
        Fields for the log.
    is_strangers : bool
        True when the connection is to end with the answer.
    """

    def __init__(self, scope: Scope, receive: Receive, send: Send, settings: Settings, request_id: str) -> None:
        self._receive = receive
        self._send = send
        self._settings = settings
        self._request_id = request_id.encode("ascii")
        # A client that waits for "100 Continue" has sent nothing yet.
        self._unread = any(_announces_body(*field) for field in scope["headers"]) and not any(
            name == b"expect" for name, _ in scope["headers"]
        )
        self.status = 0
        self.noted: dict[str, object] = {}
        self.is_strangers = False

    async def receive(self) -> Message:
        """Return the next message."""
        message = await self._receive()
        self._unread = message["type"] == "http.request" and message.get("more_body", False)
        return message

    async def send(self, message: Message) -> None:
        """Send the head of an answer with the headers that all have, or a part of its body.

        A client that takes no more of a large one for `request_timeout_s` loses the connection.
        """
        if message["type"] == "http.response.start":
            self.status = message["status"]
            await self._drop_rest()  # the server would read on without end
            ends = (CLOSE,) if self._unread or self.is_strangers else ()
            headers = [*message.get("headers", ()), (b"x-request-id", self._request_id), *ALWAYS, *ends]
            await self._send({**message, "headers": headers})
        elif len(message.get("body", b"")) <= LARGE:
            await self._send(message)
        else:
            await self._send_pieces(memoryview(message["body"]))

    async def _send_pieces(self, body: memoryview) -> None:
        """Send a body, which is whole, as the client takes it."""
        for begin in range(0, len(body), PIECE):
            piece, more = bytes(body[begin : begin + PIECE]), begin + PIECE < len(body)
            try:
                async with asyncio.timeout(self._settings.request_timeout_s):
                    await self._send({"type": "http.response.body", "body": piece, "more_body": more})
            except TimeoutError:
                self.noted["sent_bytes"] = begin
                return  # the server ends the connection

    async def _drop_rest(self) -> None:
        """Read the rest of the body and drop it, as far as it comes soon and is not too much."""
        if not self._unread:
            return
        dropped, most = 0, STRANGERS_BYTES if self.is_strangers else self._settings.max_body_bytes
        with suppress(TimeoutError):
            async with asyncio.timeout(DROP_SECONDS):
                while self._unread and dropped <= most:
                    dropped += len((await self.receive()).get("body", b""))


def _announces_body(name: bytes, value: bytes) -> bool:
    return name == b"transfer-encoding" or (name == b"content-length" and value != b"0")
