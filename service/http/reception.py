"""The outermost layer of the application: a request's state, its key, the log, the counts, and the last catch."""

from __future__ import annotations

import asyncio
import logging
import random
import re
import time

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from .problems import INTERNAL, problem_of
from .services import Services
from .state import RequestState, attach, state_of

logger = logging.getLogger("linefix")
_ID = re.compile(rb"^[A-Za-z0-9._:/+=@-]{1,128}$")


def taken_or_made(headers: list[tuple[bytes, bytes]]) -> str:
    """Return the caller's ``X-Request-Id`` where it is plain and short, else a new one."""
    for name, value in headers:
        if name == b"x-request-id" and _ID.match(value):
            return value.decode("ascii")
    return f"{random.getrandbits(128):032x}"  # unique, and no secret


class Reception:
    """Written as plain ASGI: Starlette's `BaseHTTPMiddleware` would hide that a client hung up.

    A request comes with its ticket where the server has admitted it; otherwise it is admitted here.
    """

    def __init__(self, app: ASGIApp, services: Services) -> None:
        self._app = app
        self._services = services

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        state = _arrived(scope)
        state.request_id = taken_or_made(scope["headers"])
        started = time.perf_counter()
        state.trail = None if self._services.traces is None else self._services.traces.begin()
        status = 0
        # Whoever can be read can be asked for its headers: the server leaves the body away.
        inner = {**scope, "method": "GET"} if scope["method"] == "HEAD" else scope

        async def send_with_id(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
                identity = (b"x-request-id", state.request_id.encode("ascii"))
                closing = ((b"connection", b"close"),) if state.is_unread() else ()
                message["headers"] = [*message.get("headers", ()), identity, *closing]
            await send(message)

        try:
            if state.ticket is None:
                state.ticket = self._services.entrance.admit(scope)
            await self._app(inner, receive, send_with_id)
        except Exception as error:
            problem = problem_of(error)
            if problem is None:
                logger.exception("a defect", extra={"request_id": state.request_id})
            if status:
                raise
            await (problem or INTERNAL).response(state.request_id)(scope, receive, send_with_id)
        finally:
            if state.ticket is not None:
                state.ticket.arrive()
            self._tell(inner, scope["method"], status, time.perf_counter() - started)

    def _tell(self, scope: Scope, method: str, status: int, seconds: float) -> None:
        """Count and log a request; status 0 is a client that was gone before it was answered."""
        state = state_of(scope)
        assert state is not None
        route = getattr(scope.get("route"), "path", "unmatched")
        self._services.metrics.observe_request(route, method, status, seconds)
        usual = {
            "request_id": state.request_id,
            "method": method,
            "route": route,
            "status": status,
            "ms": round(1e3 * seconds, 3),
        }
        logger.info("request", extra={**usual, **state.noted})
        if state.trail is not None and self._services.traces is not None:
            told = {"http.request.method": method, "http.route": route, "http.response.status_code": status}
            told["linefix.request_id"] = state.request_id
            self._services.traces.tell(state.trail, scope["headers"], f"{method} {route}", told)


def _arrived(scope: Scope) -> RequestState:
    """Return the state that the server gave a request, or a new one."""
    state = state_of(scope)
    if state is None:
        state = RequestState(asyncio.get_running_loop().time())
        attach(scope, state)
    return state
