"""How requests are received: uvicorn's HTTP protocol with the limits in time and size that it leaves out.

uvicorn waits for ever for the rest of a request, and for a client that reads nothing of its answer. It answers what is
not HTTP in plain text. It loses the body of a request that wishes for another protocol.
"""

from __future__ import annotations

import asyncio
import re
from functools import lru_cache
from http import HTTPStatus

from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

from ..http.errors import NotHttpError
from ..http.problems import KINDS, RAISED, Problem
from ..http.reception import taken_or_made
from ..http.services import KEY, Services
from ..http.state import RequestState, attach

MAX_HEAD = 32_768  # bytes
LINGER = 1.0  # s that a closed connection still listens: a reset would overtake the answer
LEEWAY = 0.5  # s for the application to say that a body came too late
LEAST_READ = 16_384  # bytes that a client takes of an answer within the time that a request may take to arrive
SOME_ID = "0123456789abcdef" * 2  # stands where the id of a request goes
_UPGRADE = re.compile(rb"(\r\n)(upgrade[ \t]*:)", re.IGNORECASE)


class ReceiptProtocol(HttpToolsProtocol):
    """Closes what comes too slowly or with too large a head, and who does not read."""

    _timer: asyncio.TimerHandle | None = None
    _write_timer: asyncio.TimerHandle | None = None
    _unread = 0  # bytes of head so far, while a head is incomplete
    _in_head = _in_message = _complete = False
    _deaf = False  # whether what comes is of no interest any more

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Begin to wait for the first request."""
        services: Services = self.app_state[KEY]
        self._services = services
        self._seconds = services.settings.request_timeout
        super().connection_made(transport)
        self._expect_message()

    def connection_lost(self, exc: Exception | None) -> None:
        """Wait for nothing any more."""
        for timer in (self._timer, self._write_timer):
            if timer is not None:
                timer.cancel()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Take what has come; a request has to be complete in time from its first byte on."""
        if self._deaf:
            return
        self._complete = False
        super().data_received(data if self._in_message else _without_upgrade(data))
        if self._in_message or not self._complete:
            if self._timer is None:
                self._expect_message()
            self._unread = self._unread + len(data) if self._in_head else 0
            if self._unread > MAX_HEAD:
                self.send_400_response("")
        elif self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def on_message_begin(self) -> None:
        """Give a request its state."""
        super().on_message_begin()
        self._in_head = self._in_message = True
        attach(self.scope, RequestState(arrived=self.loop.time()))  # type: ignore[arg-type]
        if self._timer is not None:
            self._expect_message()

    def on_headers_complete(self) -> None:
        """Note that the head is there."""
        self._in_head = False
        super().on_headers_complete()

    def on_message_complete(self) -> None:
        """Note that a request is there."""
        self._in_message, self._complete = False, True
        super().on_message_complete()

    def send_400_response(self, msg: str) -> None:
        """Tell what is not HTTP so; silently where it would get between the parts of another answer."""
        if self.cycle is not None and not self.cycle.response_complete:
            self.transport.close()
            return
        self.write_refusal(NotHttpError(), taken_or_made([]), close=True)

    def _unsupported_upgrade_warning(self) -> None:
        # The parser has taken the body for another protocol: nothing after it can be a request.
        self._deaf = True
        if self.cycle is not None:
            self.cycle.keep_alive = False

    def pause_writing(self) -> None:
        """Watch whether the client goes on reading."""
        super().pause_writing()
        self._watch_reader(self.transport.get_write_buffer_size() + LEAST_READ)

    def resume_writing(self) -> None:
        """Watch no longer: it has read."""
        if self._write_timer is not None:
            self._write_timer.cancel()
            self._write_timer = None
        super().resume_writing()

    def write_refusal(self, error: Exception, request_id: str, *, close: bool) -> None:
        """Answer without the application, and hear nothing of the connection any more where it closes."""
        self.transport.write(_rendered(error, request_id, self.server_state.default_headers, close=close))
        if close:
            self._deaf = True
            self._unset_keepalive_if_required()
            if self.transport.can_write_eof():
                self.transport.write_eof()
            self.loop.call_later(LINGER, self._close)

    def _expect_message(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
        self._timer = self.loop.call_later(self._seconds + LEEWAY, self._close)

    def _watch_reader(self, before: int) -> None:
        left = self.transport.get_write_buffer_size()
        if left > before - LEAST_READ:
            self.transport.abort()
        else:
            self._write_timer = self.loop.call_later(self._seconds, self._watch_reader, left)

    def _close(self) -> None:
        if not self.transport.is_closing():
            self.transport.close()


def _without_upgrade(data: bytes) -> bytes:
    """Have a wish for another protocol ignored, as RFC 9110, 7.8, lets a server do.

    Some clients, Java's for one, express it with every first request. The parser would take what follows the head for
    that protocol: the body would be lost, or be the next request.
    """
    head, end, rest = data.partition(b"\r\n\r\n")
    return _UPGRADE.sub(rb"\1x-\2", head) + end + rest if end and _UPGRADE.search(head) else data


def _rendered(error: Exception, request_id: str, default: list[tuple[bytes, bytes]], *, close: bool) -> bytes:
    """Return a refusal as it goes over the wire; `default` are the headers that all answers have."""
    usual = len(request_id) == len(SOME_ID)
    begin, rest = _parts(RAISED[type(error)].code, str(error), SOME_ID if usual else request_id, close)
    if usual:
        rest = rest.replace(SOME_ID.encode(), request_id.encode())
    return begin + b"".join(b"%b: %b\r\n" % header for header in default) + rest


@lru_cache(maxsize=64)
def _parts(code: str, detail: str, request_id: str, close: bool) -> tuple[bytes, bytes]:
    """Return the first line of an answer, and what follows the headers that all answers have."""
    kind = KINDS[code]
    answer = Problem(kind, detail).response(request_id)
    headers = [*answer.raw_headers, (b"x-request-id", request_id.encode())]
    if close:
        headers.append((b"connection", b"close"))
    lines = b"".join(b"%b: %b\r\n" % header for header in headers)
    begin = f"HTTP/1.1 {kind.status} {HTTPStatus(kind.status).phrase}\r\n"
    return begin.encode(), lines + b"\r\n" + bytes(answer.body)
