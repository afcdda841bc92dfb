"""uvicorn's HTTP protocol with what it leaves out: limits in time and size, early refusals, problems for its errors."""

from __future__ import annotations

import asyncio
import re
from functools import lru_cache
from http import HTTPStatus
from typing import Any, cast

from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

from ..admission.entrance import Doors
from ..http.problems import ProblemError
from ..http.reception import taken_or_made

MAX_HEAD = 32_768  # bytes
UNREAD = 65_536  # bytes; what is left of a refused body up to here is read and dropped, beyond it the connection ends
LINGER = 1.0  # s that a closed connection still listens: a reset would overtake the answer
LEEWAY = 0.5  # s for the application to say that a body came too late
LEAST_READ = 16_384  # bytes that a client takes of an answer within the time that a request may take to arrive


_UPGRADE = re.compile(rb"(\r\n)(upgrade[ \t]*:)", re.IGNORECASE)
SOME_ID = "0123456789abcdef" * 2  # stands where the id of a request goes


class _Answered:
    """Stands for a request that was answered without the application."""

    response_started = response_complete = True
    disconnected = keep_alive = False
    message_event = asyncio.Event()


def protocol_of(doors: Doors, seconds: float) -> type[HttpToolsProtocol]:
    """Return the protocol class for `uvicorn.Config`, which takes a class and no arguments.

    Parameters
    ----------
    doors : Doors
        Says from a request's head alone whether it is let in.
    seconds : float
        That a request may take to arrive, head and body.
    """

    class GuardedProtocol(HttpToolsProtocol):
        """Closes what comes too slowly, and refuses before the application and the body where it can."""

        _timer: asyncio.TimerHandle | None = None
        _write_timer: asyncio.TimerHandle | None = None
        _unread = 0  # bytes of head so far, while a head is incomplete
        _in_head = _in_message = _deaf = False

        def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
            super().connection_made(transport)
            self._expect_message()

        def connection_lost(self, exc: Exception | None) -> None:
            for timer in (self._timer, self._write_timer):
                if timer is not None:
                    timer.cancel()
            super().connection_lost(exc)

        def data_received(self, data: bytes) -> None:
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
            super().on_message_begin()
            self._in_head = self._in_message = True
            self.scope["state"]["arrived"] = self.loop.time()
            if self._timer is not None:
                self._expect_message()

        def on_headers_complete(self) -> None:
            self._in_head = False
            refusal = None
            if self.cycle is None or self.cycle.response_complete:
                refusal = doors.refuse(self.parser.get_method(), self.url, self.headers)
            if refusal is None:
                super().on_headers_complete()
            else:
                self._refuse(refusal)

        def on_message_complete(self) -> None:
            self._in_message, self._complete = False, True
            if not self.cycle.response_complete and not self.pipeline:
                doors.announce(cast("dict[str, Any]", self.cycle.scope))
            super().on_message_complete()

        def send_400_response(self, msg: str) -> None:
            if self.cycle is not None and not self.cycle.response_complete:
                self.transport.close()
                return
            problem = ProblemError("invalid_http", "this is not HTTP/1.1 as RFC 9112 has it, or no method of HTTP")
            self._write(problem, taken_or_made([]), close=True)

        def _unsupported_upgrade_warning(self) -> None:
            # The parser has taken the body for another protocol: nothing after it can be a request.
            self._deaf = True
            if self.cycle is not None:
                self.cycle.keep_alive = False

        def pause_writing(self) -> None:
            super().pause_writing()
            self._watch_reader(self.transport.get_write_buffer_size() + LEAST_READ)

        def resume_writing(self) -> None:
            if self._write_timer is not None:
                self._write_timer.cancel()
                self._write_timer = None
            super().resume_writing()

        def _refuse(self, problem: ProblemError) -> None:
            sizes = [value for name, value in self.headers if name == b"content-length"]
            small = len(sizes) == 1 and int(sizes[0]) <= UNREAD and not self.expect_100_continue
            close = not small or not self.parser.should_keep_alive()
            self.cycle = _Answered  # type: ignore[assignment]
            self._write(problem, taken_or_made(self.headers), close=close)
            if not close:
                self.on_response_complete()

        def _write(self, problem: ProblemError, request_id: str, *, close: bool) -> None:
            self.transport.write(_response(problem, request_id, self.server_state.default_headers, close))
            if close:
                self._deaf = True
                self._unset_keepalive_if_required()
                if self.transport.can_write_eof():
                    self.transport.write_eof()
                self.loop.call_later(LINGER, self._close)

        def _expect_message(self) -> None:
            if self._timer is not None:
                self._timer.cancel()
            self._timer = self.loop.call_later(seconds + LEEWAY, self._close)

        def _watch_reader(self, before: int) -> None:
            left = self.transport.get_write_buffer_size()
            if left > before - LEAST_READ:
                self.transport.abort()
            else:
                self._write_timer = self.loop.call_later(seconds, self._watch_reader, left)

        def _close(self) -> None:
            if not self.transport.is_closing():
                self.transport.close()

    return GuardedProtocol


def _without_upgrade(data: bytes) -> bytes:
    """Have a wish for another protocol ignored, as RFC 9110, 7.8, lets a server do.

    Some clients, Java's for one, express it with every first request. The parser would take what follows the head for
    that protocol: the body would be lost, or be the next request.
    """
    head, end, rest = data.partition(b"\r\n\r\n")
    return _UPGRADE.sub(rb"\1x-\2", head) + end + rest if end and _UPGRADE.search(head) else data


def _response(problem: ProblemError, request_id: str, default: list[tuple[bytes, bytes]], close: bool) -> bytes:
    usual = len(request_id) == len(SOME_ID)
    begin, rest = _rendered(problem.code, problem.detail, SOME_ID if usual else request_id, close)
    if usual:
        rest = rest.replace(SOME_ID.encode(), request_id.encode())
    return begin + b"".join(b"%b: %b\r\n" % header for header in default) + rest


@lru_cache(maxsize=64)
def _rendered(code: str, detail: str, request_id: str, close: bool) -> tuple[bytes, bytes]:
    """Return the first line of an answer, and what follows the headers that all answers have."""
    problem = ProblemError(code, detail)
    answer: Any = problem.response(request_id)
    headers = [*answer.raw_headers, (b"x-request-id", request_id.encode())]
    if close:
        headers.append((b"connection", b"close"))
    lines = b"".join(b"%b: %b\r\n" % header for header in headers)
    begin = f"HTTP/1.1 {problem.status} {HTTPStatus(problem.status).phrase}\r\n"
    return begin.encode(), lines + b"\r\n" + answer.body
