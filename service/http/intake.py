"""A request's body as it comes, and its rest when nothing reads it.

A server that closes a connection with bytes unread has the system reset it, and the reset overtakes the answer: the
client sees a broken connection in place of a refusal.
"""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from contextlib import suppress

from starlette.types import Message, Receive

DROP_SECONDS = 1.0  # s that the rest of a body may take to come


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
        # A client that asks before it sends its body has sent nothing yet.
        self._unread = any(_announces_body(*field) for field in headers) and not any(
            name == b"expect" for name, _ in headers
        )

    async def receive(self) -> Message:
        """Return the next message."""
        message = await self._receive()
        self._unread = message["type"] == "http.request" and message.get("more_body", False)
        return message

    async def drop_rest(self, most_bytes: int) -> None:
        """Read what is left and drop it, as far as it comes soon and is not too much."""
        if not self._unread:
            return
        dropped = 0
        with suppress(TimeoutError):
            async with asyncio.timeout(DROP_SECONDS):
                while self._unread and dropped <= most_bytes:
                    dropped += len((await self.receive()).get("body", b""))


def _announces_body(name: bytes, value: bytes) -> bool:
    return name == b"transfer-encoding" or (name == b"content-length" and value != b"0")
