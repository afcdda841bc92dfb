"""The outermost layer of the application, as ASGI: a request's exchange, admission, log and counts, and the last catch.

Written as plain ASGI: Starlette's `BaseHTTPMiddleware` would hide that a client hung up.
"""

from __future__ import annotations

import asyncio
import logging
import random
import re
import time
from unicodedata import category

from starlette.requests import Request
from starlette.types import ASGIApp, Receive, Scope, Send

from linefix.documents.errors import RequestError

from ..errors import ControlCharacterError, MissingKeyError, NotHttpError, ServiceError, ShareUsedError, UnknownKeyError
from .connection import Connection
from .exchange import KEY, Exchange, HangUpError
from .problems import RAISED, as_ours, problem_or_defect
from .services import Services

logger = logging.getLogger("linefix")
CLIENT_CLOSED_REQUEST = 499  # not sent to a reader; used in the log and the counts
LATER = 0.05  # s after which a holder that used its share is refused: refused at once it would send again at once
OTHER = "unmatched"
STRANGERS = (MissingKeyError, UnknownKeyError, NotHttpError)
"""Errors that end the connection: nothing more is served on it."""
CONTROL = frozenset(("Cc", "Zl", "Zp"))  # of Unicode: C0 and C1, DEL, and what separates lines and paragraphs
TWO_LENGTHS = {b"transfer-encoding", b"content-length"}
_HOST = re.compile(rb"[A-Za-z0-9._~%!$&'()*+,;=:\[\]-]*")
_ID = re.compile(rb"^[A-Za-z0-9._:/+=@-]{1,128}$")
_STORED = re.compile("^/v1/maps/[^/:]+")


class RequestMiddleware:
    """Admits each request and serves it, or refuses it; `routes` are the paths of the application."""

    def __init__(self, app: ASGIApp, services: Services, routes: frozenset[str]) -> None:
        self._app = app
        self._services = services
        self._routes = routes

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        # Every path that GET reads answers HEAD, too: the server leaves the body away.
        inner = {**scope, "method": "GET"} if scope["method"] == "HEAD" else scope
        request_id = _id_of(scope["headers"])
        connection = Connection(scope, receive, send, self._services.settings, request_id)
        exchange = Exchange(
            request_id=request_id,
            services=self._services,
            request=Request(inner, connection.receive),
            arrived=asyncio.get_running_loop().time(),
            noted=connection.noted,
        )
        state = inner.setdefault("state", {})
        state[KEY] = exchange
        try:
            await self._admit(exchange, connection, scope)
        finally:
            del state[KEY]  # the exchange refers to the request: heads would wait for the garbage collector

    async def _admit(self, exchange: Exchange, connection: Connection, scope: Scope) -> None:
        try:
            _require_plain(scope)
            exchange.ticket = self._services.entrance.admit(scope)
        except (ServiceError, RequestError) as error:
            await self._refuse(error, exchange, connection, scope)
            return
        await self._serve(exchange, connection, scope["method"])

    async def _refuse(self, error: Exception, exchange: Exchange, connection: Connection, scope: Scope) -> None:
        """Answer in place of the application; counted, and logged once a second."""
        if isinstance(error, ShareUsedError):
            await asyncio.sleep(LATER)
        kind, route = RAISED[type(error)], _STORED.sub("/v1/maps/{map_id}", scope["path"])
        route = route if route in self._routes else OTHER
        self._services.refusals.count(route, scope["method"], kind.code, kind.status)
        connection.is_strangers = isinstance(error, STRANGERS)
        problem = problem_or_defect(error, exchange.request_id)
        await problem.response(exchange.request_id)(scope, connection.receive, connection.send)

    async def _serve(self, exchange: Exchange, connection: Connection, method: str) -> None:
        scope, started = exchange.request.scope, time.perf_counter()
        try:
            await self._app(scope, connection.receive, connection.send)
        except HangUpError:
            connection.status = CLIENT_CLOSED_REQUEST
        except Exception as error:
            problem = problem_or_defect(as_ours(error, exchange.request), exchange.request_id)
            if connection.status:
                raise
            exchange.note(code=problem.kind.code)
            await problem.response(exchange.request_id)(scope, connection.receive, connection.send)
        finally:
            exchange.held.close()
            self._services.gate.leave(exchange.ticket)
            self._report(exchange, method, connection.status, time.perf_counter() - started)

    def _report(self, exchange: Exchange, method: str, status: int, seconds: float) -> None:
        """Count and log a request; status 0 is a client that hung up before it was answered."""
        route = getattr(exchange.request.scope.get("route"), "path", OTHER)
        self._services.metrics.observe_request(route, method, status, seconds)
        usual = {"method": method, "route": route, "status": status, "ms": round(1e3 * seconds, 3)}
        logger.info("request", extra={"request_id": exchange.request_id, **usual, **exchange.noted})


def _id_of(headers: list[tuple[bytes, bytes]]) -> str:
    """Return the caller's ``X-Request-Id`` where it is plain and short, else a new one."""
    for name, value in headers:
        if name == b"x-request-id" and _ID.match(value):
            return value.decode("ascii")
    return f"{random.getrandbits(128):032x}"  # unique, and no secret


def _require_plain(scope: Scope) -> None:
    """Refuse control characters, and what two servers could read in two ways and ours takes: RFC 9112, 3.2 and 6.1.

    A router that looks for the end of a line takes ``/metrics%0A`` for ``/metrics``; the rule of a proxy for that path
    does not.
    """
    fields = dict(scope["headers"])  # h11 has refused two hosts, none in HTTP/1.1, and codings other than chunked
    if fields.keys() >= TWO_LENGTHS or not _HOST.fullmatch(fields.get(b"host", b"")):
        raise NotHttpError
    if not scope["path"].isprintable():
        for character in scope["path"]:
            if category(character) in CONTROL:
                found = f"the path has the control character U+{ord(character):04X}"
                raise ControlCharacterError(f"{found}; expected none; remove it")
