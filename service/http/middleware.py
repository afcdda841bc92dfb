"""The outermost layer of the application, as ASGI: a request's state, key, log and counts, and the last catch."""

from __future__ import annotations

import asyncio
import logging
import random
import re
import time
from contextlib import AbstractContextManager, nullcontext
from typing import TYPE_CHECKING
from unicodedata import category

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from linefix.documents.errors import RequestError

from ..admission.errors import AdmissionError, MissingKeyError, ShareUsedError, UnknownKeyError
from .bodies import Intake
from .errors import ControlCharacterError, HttpError, NotHttpError
from .exchange import RequestState, attach, state_of
from .problems import INTERNAL, RAISED, problem_of
from .services import Services

if TYPE_CHECKING:
    from opentelemetry.trace import Span

logger = logging.getLogger("linefix")
LATER = 0.05  # s after which a holder that used its share is refused: refused at once it would send again at once
OTHER = "unmatched"
STRANGERS_BYTES = 65_536  # of the rest of a body that are dropped, from a caller without a key
STRANGERS = (MissingKeyError, UnknownKeyError, NotHttpError)
"""Errors that end the connection: nothing more is served on it."""
CONTROL = frozenset(("Cc", "Zl", "Zp"))  # of Unicode: C0 and C1, DEL, and what separates lines and paragraphs
ALWAYS = ((b"server", b"linefix"), (b"x-content-type-options", b"nosniff"))
_HOST = re.compile(rb"[A-Za-z0-9._~%!$&'()*+,;=:\[\]-]*")
_STORED = re.compile("^/v1/maps/[^/:]+")
_ID = re.compile(rb"^[A-Za-z0-9._:/+=@-]{1,128}$")


def taken_or_made(headers: list[tuple[bytes, bytes]]) -> str:
    """Return the caller's ``X-Request-Id`` where it is plain and short, else a new one."""
    for name, value in headers:
        if name == b"x-request-id" and _ID.match(value):
            return value.decode("ascii")
    return f"{random.getrandbits(128):032x}"  # unique, and no secret


class RequestMiddleware:
    """Written as plain ASGI: Starlette's `BaseHTTPMiddleware` would hide that a client hung up."""

    def __init__(self, app: ASGIApp, services: Services, routes: frozenset[str]) -> None:
        self._app = app
        self._routes = routes
        self._services = services

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Admit one request and serve it, or refuse it."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        state = RequestState(asyncio.get_running_loop().time(), taken_or_made(scope["headers"]))
        attach(scope, state)
        try:
            _require_framing(scope)
            _require_plain(scope["path"])
            state.ticket = self._services.entrance.admit(scope)
        except (AdmissionError, HttpError, RequestError) as error:
            await self._refuse(error, state.request_id, scope, receive, send)
            return
        traces = self._services.traces
        traced: AbstractContextManager[Span | None] = nullcontext()
        if traces is not None:
            traced = traces.request(scope["headers"])
        with traced as span:
            await self._serve(state, span, scope, receive, send)

    async def _refuse(self, error: Exception, request_id: str, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer in place of the application; counted, and logged once a second."""
        if isinstance(error, ShareUsedError):
            await asyncio.sleep(LATER)
        kind, method = RAISED[type(error)], scope["method"]
        route = _STORED.sub("/v1/maps/{map_id}", scope["path"])
        route = route if route in self._routes else OTHER
        self._services.refusals.count(route, method, kind.code, kind.status)
        problem = problem_of(error)
        assert problem is not None
        stranger = isinstance(error, STRANGERS)
        most_bytes = STRANGERS_BYTES if stranger else self._services.settings.max_body_bytes
        ends = not await Intake(receive, scope["headers"]).drop_rest(most_bytes) or stranger

        async def send_refusal(message: Message) -> None:
            if message["type"] == "http.response.start":
                _add_headers(message, request_id, close=ends)
            await send(message)

        await problem.response(request_id)(scope, receive, send_refusal)

    async def _serve(self, state: RequestState, span: Span | None, scope: Scope, receive: Receive, send: Send) -> None:
        started = time.perf_counter()
        intake, most_bytes = Intake(receive, scope["headers"]), self._services.settings.max_body_bytes
        status = 0
        # Every path that GET reads answers HEAD, too: the server leaves the body away.
        inner = {**scope, "method": "GET"} if scope["method"] == "HEAD" else scope

        async def send_with_id(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
                # The server would read on without end; and one that drains has no idle connections when it closes.
                ends = not await intake.drop_rest(most_bytes) or self._services.readiness.draining
                _add_headers(message, state.request_id, close=ends)
            await send(message)

        try:
            await self._app(inner, intake.receive, send_with_id)
        except Exception as error:
            problem = problem_of(error)
            if problem is None:
                logger.exception("a defect", extra={"request_id": state.request_id})
            if status:
                raise
            await (problem or INTERNAL).response(state.request_id)(scope, intake.receive, send_with_id)
        finally:
            assert state.ticket is not None
            self._services.gate.leave(state.ticket)
            self._report(inner, scope["method"], status, time.perf_counter() - started, span)

    def _report(self, scope: Scope, method: str, status: int, seconds: float, span: Span | None) -> None:
        """Count and log a request; status 0 is a client that hung up before it was answered."""
        state = state_of(scope)
        assert state is not None
        route = getattr(scope.get("route"), "path", OTHER)
        self._services.metrics.observe_request(route, method, status, seconds)
        usual = {
            "request_id": state.request_id,
            "method": method,
            "route": route,
            "status": status,
            "ms": round(1e3 * seconds, 3),
        }
        logger.info("request", extra={**usual, **state.noted})
        if span is not None:
            span.update_name(f"{method} {route}")
            span.set_attributes({"http.request.method": method, "http.route": route})
            span.set_attributes({"http.response.status_code": status, "linefix.request_id": state.request_id})


def _require_framing(scope: Scope) -> None:
    """Refuse what two servers could read in two ways and the server takes: RFC 9112, 3.2 and 6.1."""
    hosts = [value for name, value in scope["headers"] if name == b"host"]
    if len(hosts) > 1 or (scope["http_version"] == "1.1" and not hosts):
        raise NotHttpError
    if hosts and not _HOST.fullmatch(hosts[0]):
        raise NotHttpError
    codings = [value.strip().lower() for name, value in scope["headers"] if name == b"transfer-encoding"]
    if codings not in ([], [b"chunked"]):
        raise NotHttpError


def _require_plain(path: str) -> None:
    """Refuse a path that has a control character, its escapes undone.

    A router that looks for the end of a line takes ``/metrics%0A`` for ``/metrics``; the rule of a proxy for that path
    does not.
    """
    if not path.isprintable():
        for character in path:
            if category(character) in CONTROL:
                raise ControlCharacterError(character)


def _add_headers(message: Message, request_id: str, *, close: bool = False) -> None:
    """Add the headers that all answers have."""
    closing = ((b"connection", b"close"),) if close else ()
    own = ((b"x-request-id", request_id.encode("ascii")), *ALWAYS, *closing)
    message["headers"] = [*message.get("headers", ()), *own]
