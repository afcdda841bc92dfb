"""How requests are received: uvicorn's HTTP protocol with the limits in time and size that it leaves out.

uvicorn waits for ever for the rest of a request, and for a client that reads nothing of its answer. It goes on reading
what it has refused. It answers what is not HTTP in plain text, and what is not HTTP in the midst of a request, or a
client that says that it has nothing more to send, not at all.
"""

from __future__ import annotations

import asyncio
from functools import lru_cache
from http import HTTPStatus
from typing import cast

from starlette.types import Scope

from ..admission.connections import Use
from ..admission.errors import TooManyConnectionsError
from ..admission.keys import address_of
from ..http.errors import NotHttpError
from ..http.problems import KINDS, RAISED, Problem, headers_of
from ..http.reception import taken_or_made
from ..http.services import KEY, Services
from ..http.state import RequestState, attach, state_of
from .framing import MAX_HEAD, FramingProtocol

LINGER = 1.0  # s that a closed connection still listens: a reset would overtake the answer
LEEWAY = 0.5  # s for the application to say that a body came too late
LEAST_READ = 16_384  # bytes that a client takes of an answer within the time that a request may take to arrive
FIRST_LOOK = 0.02  # s after which it is looked again whether who says no more still listens; then twice that, and so on
LAST_LOOK = 2.0
STILL_THERE = b"HTTP/1.1 100 Continue\r\n\r\n"
SOME_ID = "0123456789abcdef" * 2  # stands where the id of a request goes


class ReceiptProtocol(FramingProtocol):
    """Closes what comes too slowly or is not HTTP, and who does not read."""

    _timer: asyncio.TimerHandle | None = None
    _write_timer: asyncio.TimerHandle | None = None
    _look_timer: asyncio.TimerHandle | None = None
    _linger_timer: asyncio.TimerHandle | None = None
    _lost = False
    _complete = False
    _dropped = 0  # bytes that came when nobody listened any more
    _says_no_more = False
    _ending = False  # whether everything has been said
    _last_word = False  # whether something that is not HTTP came behind requests that are to be answered first

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Begin to wait for the first request."""
        services: Services = self.app_state[KEY]
        self._services = services
        self._seconds = services.settings.request_timeout
        super().connection_made(transport)
        if services.connections.add(self, address_of(self.client)):
            self._expect_message()
        else:
            self.write_refusal(TooManyConnectionsError(), taken_or_made([]), close=True)

    def connection_lost(self, exc: Exception | None) -> None:
        """Wait for nothing any more."""
        for timer in (self._timer, self._write_timer, self._look_timer, self._linger_timer):
            if timer is not None:
                timer.cancel()
        self._deaf = True
        self._services.connections.remove(self)
        super().connection_lost(exc)
        self._lost = True
        self._let_go()

    @property
    def use(self) -> Use:
        """What the connection is good for at the moment; a head that does not end is good for nothing."""
        if self._ending or not (self.is_busy() or (self._in_message and not self._in_head)):
            return Use.IDLE
        running = self._running
        if running is None or running.response_complete or (running.more_body and not running.response_started):
            return Use.RECEIVING
        return Use.SENDING if self.flow.write_paused else Use.BUSY

    def give_up(self) -> None:
        """End the connection now: its place is needed."""
        self.transport.abort()

    def data_received(self, data: bytes) -> None:
        """Take what has come; a request has to be complete in time from its first byte on."""
        if self._deaf:
            self._drop(len(data))
            return
        self._complete = False
        self.feed(data)
        if (self._in_message or not self._complete) and not self._waiting:
            if self._timer is None:
                self._expect_message()
        elif self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def on_message_begin(self) -> None:
        """Give a request its state."""
        super().on_message_begin()
        attach(self.scope, RequestState(arrived=self.loop.time()))  # type: ignore[arg-type]
        if self._timer is not None:
            self._expect_message()

    def on_message_complete(self) -> None:
        """Note that a request is there."""
        super().on_message_complete()
        self._complete = not self._in_message

    def on_response_complete(self) -> None:
        """Say what is to be said after the last answer."""
        if self._ending or self._lost:
            self.server_state.total_requests += 1
            return
        super().on_response_complete()
        if self.is_busy() or self._waiting:
            return
        if self._last_word:
            self.write_refusal(NotHttpError(), taken_or_made([]), close=True)
        elif self._says_no_more:
            self.transport.close()

    def eof_received(self) -> bool | None:  # type: ignore[override]
        """Answer who has nothing more to send, as long as it listens."""
        if self._ending:
            return None
        if self._in_message and not self._deaf and not self._waiting:
            self.send_400_response("")
            return True
        if not self.is_busy() or self.cycle.scope["http_version"] == "1.0":
            return None
        self._says_no_more = True
        self._look(FIRST_LOOK)
        return True

    def send_400_response(self, msg: str) -> None:
        """Tell what is not HTTP so, behind the answers to what came before it."""
        if self._deaf:
            return
        self._deaf = True
        body_is_wrong, cycle = self._in_message and not self._in_head, self.cycle
        if body_is_wrong and self.pipeline and self.pipeline[0][0] is cycle:
            self.pipeline.popleft()
        elif body_is_wrong and not cycle.response_started:
            # Nobody waits for what the application has to say of it.
            cycle.disconnected = cycle.response_complete = True
            cycle.message_event.set()
        elif body_is_wrong:
            cycle.keep_alive = False
            if cycle.response_complete:
                self.transport.close()
            return
        if self.is_busy():
            self._last_word = True
        else:
            self.write_refusal(NotHttpError(), taken_or_made([]), close=True)

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
            self.finish()

    def finish(self) -> None:
        """End the connection so that what was written arrives: what still comes is dropped for a while."""
        self._deaf = self._ending = True
        self._waiting = b""
        self._unset_keepalive_if_required()
        if self.transport.is_closing():
            return
        if self.transport.can_write_eof():
            self.transport.write_eof()
        self._flow.hold(False)
        self._flow.resume_reading()
        self._linger_timer = self.loop.call_later(LINGER, self._close)

    def end_answered(self) -> None:
        """End the connection after an answer; what still comes of the request is dropped."""
        if self._in_message:
            self.finish()
        else:
            self.transport.close()

    def _go_on(self) -> None:
        """Parse on; what waited for an answer to another has come in time."""
        if self._lost:
            return
        state = state_of(cast("Scope", self.scope))
        if self._in_message and state is not None:
            state.arrived = self.loop.time()
        super()._go_on()
        if self._says_no_more and self._in_message and not self._waiting:
            self.send_400_response("")

    def _let_go(self) -> None:
        """Forget the requests of a connection that is gone; whoever is at work on one has it still.

        They refer to the connection, and it to them: with heads of 32 KB they would wait for the garbage collector,
        which comes after tens of thousands of connections.
        """
        self.cycle = self.scope = self._running = None  # type: ignore[assignment]
        self.headers, self.url, self._waiting = [], b"", b""
        self.pipeline.clear()

    def _drop(self, count: int) -> None:
        # Who sends a whole body before it listens is heard out, as large as a body may be, and then left standing.
        self._dropped += count
        if self._dropped > self._services.settings.max_body_bytes + MAX_HEAD:
            self._flow.hold(True)

    def _look(self, seconds: float) -> None:
        """Find out whether who has nothing more to send still listens.

        To leave looks the same as to say no more. An interim answer, which every client of HTTP/1.1 passes over, is met
        with a reset by who has left, and the next one finds the connection gone.
        """
        if self.is_busy() and not self.transport.is_closing():
            if not self.pipeline and not self.cycle.response_started:
                self.transport.write(STILL_THERE)
            self._look_timer = self.loop.call_later(seconds, self._look, min(2.0 * seconds, LAST_LOOK))

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


class Exit:
    """A transport as one request has it: an answer leaves it whole, and to close it lets the answer arrive first.

    uvicorn writes the head of an answer and its body one after the other, and each goes out by itself. Who is killed
    between the two leaves a proxy with a head that it has passed on: it can no longer ask another replica. An answer
    that fails before its body has not begun either.

    Parameters
    ----------
    protocol : ReceiptProtocol
    has_body : bool
        Whether something follows the head; nothing does in answers to HEAD.
    """

    def __init__(self, protocol: ReceiptProtocol, *, has_body: bool) -> None:
        self._protocol = protocol
        self._transport = protocol.transport
        self._has_body = has_body
        self._head: bytes | None = None
        self.is_closing = protocol.transport.is_closing

    def write(self, data: bytes) -> None:
        """Send what comes of an answer; its head with the first piece of its body."""
        if not self._has_body or data == STILL_THERE:
            self._transport.write(data)
        elif self._head is None:
            self._head = data
        elif self._head:
            # Not joined: a page is one object for all who read it, however long they take.
            self._transport.writelines((self._head, data))
            self._head = b""
        else:
            self._transport.write(data)

    def close(self) -> None:
        """End the connection."""
        self._protocol.end_answered()


def _rendered(error: Exception, request_id: str, default: list[tuple[bytes, bytes]], *, close: bool) -> bytes:
    """Return a refusal as it goes over the wire; `default` are the headers that all answers have."""
    usual = len(request_id) == len(SOME_ID)
    headers = tuple(headers_of(error).items())
    begin, rest = _parts(RAISED[type(error)].code, str(error), headers, SOME_ID if usual else request_id, close)
    if usual:
        rest = rest.replace(SOME_ID.encode(), request_id.encode())
    return begin + b"".join(b"%b: %b\r\n" % header for header in default) + rest


@lru_cache(maxsize=64)
def _parts(
    code: str, detail: str, headers: tuple[tuple[str, str], ...], request_id: str, close: bool
) -> tuple[bytes, bytes]:
    """Return the first line of an answer, and what follows the headers that all answers have."""
    kind = KINDS[code]
    answer = Problem(kind, detail, headers=dict(headers)).response(request_id)
    fields = [field for field in answer.raw_headers if field[0] != b"connection"]
    fields.append((b"x-request-id", request_id.encode()))
    if close:
        fields.append((b"connection", b"close"))
    lines = b"".join(b"%b: %b\r\n" % field for field in fields)
    begin = f"HTTP/1.1 {kind.status} {HTTPStatus(kind.status).phrase}\r\n"
    return begin.encode(), lines + b"\r\n" + bytes(answer.body)
