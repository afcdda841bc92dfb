"""From bytes to requests: uvicorn's HTTP protocol, held to what one connection may have in memory at a time.

llhttp takes heads and trailers of any length, and uvicorn keeps them, and every request that is sent before the answer
to the one before. Both take what RFC 9112 tells a server to refuse. A request that wishes for another protocol loses
its body.
"""

from __future__ import annotations

import asyncio
import re

import httptools
from uvicorn.protocols.http.flow_control import FlowControl
from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol, RequestResponseCycle

MAX_HEAD = 32_768  # bytes of a head, of trailers, or of what names one chunk
MAX_FIELDS = 128  # of a head
STEP = 1_024  # bytes of heads that are parsed at a time: so much may come before it is noticed that requests wait
BODY_STEP = 65_536  # bytes of a body whose end is known
WAITING_BYTES = 16_384  # that are held unparsed before nothing more is read
_HOST = re.compile(rb"[A-Za-z0-9._~%!$&'()*+,;=:\[\]-]*")


class WrongFramingError(Exception):
    """A head that RFC 9112 tells a server to refuse."""


class FramingProtocol(HttpToolsProtocol):
    """Parses one request at a time, and what belongs to it within limits."""

    _in_head = _in_message = False
    _read = 0  # bytes since something came of them: a message, its head, a piece of its body
    _came = False  # whether something did of those that are being parsed
    _left: int | None = None  # bytes that are still to come of a body, None where they are not known
    _wishes = False  # for another protocol
    _deaf = False  # whether what comes is of no interest any more
    _waiting = b""  # what has come and is not parsed, since requests wait
    _running: RequestResponseCycle | None = None  # the request that is being answered, or was last

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Take care that nothing is read while too much waits."""
        super().connection_made(transport)
        self.flow = self._flow = _HeldFlow(self.transport)

    def feed(self, data: bytes) -> None:
        """Parse what has come, as far as no request has to wait for another."""
        self._unset_keepalive_if_required()
        rest = memoryview(self._waiting + data if self._waiting else data)
        while rest and not self._deaf and not self.pipeline:
            step = STEP if self._left is None else max(STEP, min(self._left, BODY_STEP))
            piece, rest = rest[:step], rest[step:]
            self._parse(piece)
        self._waiting = b"" if self._deaf else bytes(rest)
        self._flow.hold(len(self._waiting) > WAITING_BYTES)

    def on_message_begin(self) -> None:
        """Begin to count."""
        super().on_message_begin()
        self._in_head = self._in_message = True
        self._wishes = False
        self._came, self._left = True, None

    def on_header(self, name: bytes, value: bytes) -> None:
        """Keep a field of a head; those of trailers mean nothing here."""
        if self._in_head:
            if len(self.headers) >= MAX_FIELDS:
                raise WrongFramingError
            super().on_header(name, value)

    def on_headers_complete(self) -> None:
        """Begin with a request, unless it wishes for another protocol: then its body is still to be found."""
        self._require_framing()
        self._wishes = self.parser.should_upgrade() and self.parser.get_method() != b"CONNECT"
        if not self._wishes:
            super().on_headers_complete()
            self._in_head, self._came = False, True

    def on_body(self, body: bytes) -> None:
        """Take a piece of a body."""
        self._came = True
        if self._left is not None:
            self._left -= len(body)
        super().on_body(body)

    def on_message_complete(self) -> None:
        """Note that a request is there."""
        if not self._wishes:
            self._in_message, self._left = False, None
            super().on_message_complete()

    def on_response_complete(self) -> None:
        """Go on with what waits; in a turn of its own, since there may be thousands."""
        super().on_response_complete()
        if self._waiting and not self.pipeline:
            self.loop.call_soon(self._go_on)

    def is_busy(self) -> bool:
        """Tell whether an answer is still to be given."""
        return bool(self.pipeline) or (self._running is not None and not self._running.response_complete)

    def _go_on(self) -> None:
        if not self.transport.is_closing() and not self.pipeline:
            self.data_received(b"")

    def _parse(self, piece: memoryview) -> None:
        self._came = False
        try:
            self.parser.feed_data(piece)
        except httptools.HttpParserUpgrade as stopped:
            self._without_wish(piece[stopped.args[0] :])
        except httptools.HttpParserError:
            self.send_400_response("")
        self._read = 0 if self._came else self._read + len(piece)
        if self._in_message and self._read > MAX_HEAD:
            self.send_400_response("")

    def _without_wish(self, rest: memoryview) -> None:
        """Parse a head anew as if it had not wished for another protocol, as RFC 9110, 7.8, lets a server do.

        Some clients, Java's for one, express the wish with every first request. The parser takes what follows the head
        for that protocol: the body would be lost, or be the next request.
        """
        fields = b"".join(b"%b: %b\r\n" % field for field in self.headers if field[0] != b"upgrade")
        method, version = self.parser.get_method(), self.parser.get_http_version().encode()
        self.parser = httptools.HttpRequestParser(self)
        self.parser.set_dangerous_leniencies(lenient_data_after_close=True)
        self._parse(memoryview(b"%b %b HTTP/%b\r\n%b\r\n" % (method, self.url, version, fields)))
        for begin in range(0, len(rest), STEP):
            if not self._deaf:
                self._parse(rest[begin : begin + STEP])

    def _require_framing(self) -> None:
        """Refuse what two servers could read in two ways: RFC 9112, 3.2 and 6.1."""
        version = self.parser.get_http_version()
        hosts = [value for name, value in self.headers if name == b"host"]
        if version not in ("1.0", "1.1") or len(hosts) > 1 or (version == "1.1" and not hosts):
            raise WrongFramingError
        if hosts and not _HOST.fullmatch(hosts[0]):
            raise WrongFramingError
        codings = [value.strip().lower() for name, value in self.headers if name == b"transfer-encoding"]
        if codings and (codings != [b"chunked"] or version == "1.0"):
            raise WrongFramingError
        sizes = [value for name, value in self.headers if name == b"content-length"]
        if sizes:
            self._left = int(sizes[0])


class _HeldFlow(FlowControl):
    """Reads nothing while told so, whoever waits for more."""

    _held = False

    def hold(self, held: bool) -> None:
        """Read nothing, or read again."""
        if held:
            self._held = True
            self.pause_reading()
        elif self._held:
            self._held = False
            self.resume_reading()

    def resume_reading(self) -> None:
        """Read again, unless it is held."""
        if not self._held:
            super().resume_reading()
