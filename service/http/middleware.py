"""The outermost layer of the application, as ASGI: a request's exchange, admission, log and counts, and the last catch.

Written as plain ASGI: Starlette's `BaseHTTPMiddleware` would hide that a client hung up.
"""

from __future__ import annotations

import asyncio
import logging
import random
import re
import time

from starlette.types import ASGIApp, Receive, Scope, Send

from ..errors import MissingKeyError, NotHttpError, ShareUsedError, UnknownKeyError
from ..services import Services
from .exchange import KEY, Exchange, HangUpError
from .problems import problem_or_defect

logger = logging.getLogger("linefix")
CLIENT_CLOSED_REQUEST = 499  # not sent to a reader; used in the log and the counts
LATER = 0.05  # s after which a holder that used its share is refused: refused at once it would send again at once
OTHER = "unmatched"
STRANGERS = (MissingKeyError, UnknownKeyError, NotHttpError)
"""Errors that end the connection: nothing more is served on it."""
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
        services = self._services
        # Every path that GET reads answers HEAD, too: the server leaves the body away.
        inner = {**scope, "method": "GET"} if scope["method"] == "HEAD" else scope
        request_id = _id_of(scope["headers"])
        exchange = Exchange(request_id=request_id, services=services, scope=inner, source=receive, sink=send)
        inner[KEY] = exchange
        try:
            exchange.ticket = services.entrance.admit(inner)
            if exchange.ticket.searches:
                services.readiness.require_warm()
            serving = self._app(inner, exchange.receive, exchange.send)
            # A request that stores something is served to its end, even if the client hangs up.
            await (exchange.unless_hung_up(serving) if exchange.ticket.searches else serving)
        except HangUpError:
            exchange.status = CLIENT_CLOSED_REQUEST
        except Exception as error:
            await self._refuse(error, exchange)
        finally:
            del inner[KEY]  # each refers to the other: heads would wait for the garbage collector
            exchange.held.close()
            services.gate.leave(exchange.ticket)
            self._report(exchange, scope["method"], time.monotonic() - exchange.arrived)

    async def _refuse(self, error: Exception, exchange: Exchange) -> None:
        """Answer with a problem; a defect after the answer has begun can only end the connection."""
        problem = problem_or_defect(error, exchange.request_id)
        if exchange.status:
            raise error
        if isinstance(error, ShareUsedError):
            await asyncio.sleep(LATER)
        exchange.note(code=problem.kind.code)
        exchange.is_strangers = isinstance(error, STRANGERS)
        await problem.response(exchange.request_id)(exchange.scope, exchange.receive, exchange.send)

    def _report(self, exchange: Exchange, method: str, seconds: float) -> None:
        """Count and log a request; status 0 is a client that hung up before it was answered.

        Requests that reach no route are logged at the level debug: a flood brings thousands of refusals a second, and
        their lines would take time from the searches.
        """
        found = exchange.scope.get("route")
        path = _STORED.sub("/v1/maps/{map_id}", exchange.scope["path"]) if found is None else found.path
        route = path if path in self._routes else OTHER
        self._services.metrics.observe_request(route, method, exchange.status, seconds)
        usual = {"method": method, "route": route, "status": exchange.status, "ms": round(1e3 * seconds, 3)}
        level = logging.DEBUG if found is None else logging.INFO
        logger.log(level, "request", extra={"request_id": exchange.request_id, **usual, **exchange.noted})


def _id_of(headers: list[tuple[bytes, bytes]]) -> str:
    """Return the caller's ``X-Request-Id`` where it is plain and short, else a new one."""
    for name, value in headers:
        if name == b"x-request-id" and _ID.match(value):
            return value.decode("ascii")
    return f"{random.getrandbits(128):032x}"  # unique, and no secret
