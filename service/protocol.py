"""uvicorn's HTTP protocol with what it leaves out: a time limit for a request's head, and problems for its errors."""

from __future__ import annotations

import asyncio

import h11
import orjson
from uvicorn.protocols.http.h11_impl import H11Protocol

from .context import taken_or_made
from .problems import MEDIA_TYPE, ProblemError


def protocol_with_timeout(head_timeout: float) -> type[H11Protocol]:
    """Return the protocol class for `uvicorn.Config`, which takes a class and no arguments."""

    class TimedProtocol(H11Protocol):
        """Closes a connection whose request head does not arrive in time."""

        _head_timer: asyncio.TimerHandle | None = None

        def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
            super().connection_made(transport)
            self._await_head()

        def connection_lost(self, exc: Exception | None) -> None:
            self._head_arrived()
            super().connection_lost(exc)

        def data_received(self, data: bytes) -> None:
            super().data_received(data)
            if self.conn.their_state is h11.IDLE:
                # Part of the next head, or nothing yet: on a kept connection the time runs from its first byte.
                if self._head_timer is None and self.conn.trailing_data[0]:
                    self._await_head()
            else:
                self._head_arrived()

        def send_400_response(self, msg: str) -> None:
            self._head_arrived()
            if self.conn.our_state not in (h11.IDLE, h11.SEND_RESPONSE) or (
                self.cycle is not None and self.cycle.response_started and not self.cycle.response_complete
            ):
                self.transport.close()
                return
            request_id = taken_or_made([])
            body = orjson.dumps(
                ProblemError("invalid_http", "this is not HTTP/1.1 as RFC 9112 has it").as_json(request_id)
            )
            headers = [
                ("content-type", MEDIA_TYPE),
                ("content-length", str(len(body))),
                ("x-request-id", request_id),
                ("connection", "close"),
            ]
            response = h11.Response(status_code=400, headers=headers, reason=b"Bad Request")
            for event in (response, h11.Data(data=body), h11.EndOfMessage()):
                self.transport.write(self.conn.send(event) or b"")
            self.transport.close()

        def _await_head(self) -> None:
            self._head_timer = self.loop.call_later(head_timeout, self._too_slow)

        def _head_arrived(self) -> None:
            if self._head_timer is not None:
                self._head_timer.cancel()
                self._head_timer = None

        def _too_slow(self) -> None:
            self._head_timer = None
            if not self.transport.is_closing():
                self.transport.close()

    return TimedProtocol
