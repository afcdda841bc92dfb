"""The outermost layer of the application: request ids, the log, the counts, and the last catch of what escaped."""

from __future__ import annotations

import logging
import random
import re
import time

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from ..admission.gate import end_announcement
from ..telemetry.metrics import Metrics
from .problems import internal

logger = logging.getLogger("linefix")
_ID = re.compile(rb"^[A-Za-z0-9._:/+=@-]{1,128}$")


def request_id_of(scope: Scope) -> str:
    """Return the id of a request, made by `RequestContext`."""
    return str(scope["state"]["request_id"])


def note(scope: Scope, **fields: object) -> None:
    """Have something more in the log's line of a request."""
    scope["state"].setdefault("noted", {}).update(fields)


def taken_or_made(headers: list[tuple[bytes, bytes]]) -> str:
    """Return the caller's ``X-Request-Id`` where it is plain and short, else a new one."""
    for name, value in headers:
        if name == b"x-request-id" and _ID.match(value):
            return value.decode("ascii")
    return f"{random.getrandbits(128):032x}"  # unique, and no secret


class RequestContext:
    """Pure ASGI: what wraps responses instead would hide a client that hung up."""

    def __init__(self, app: ASGIApp, metrics: Metrics) -> None:
        self._app = app
        self._metrics = metrics

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        request_id = taken_or_made(scope["headers"])
        scope.setdefault("state", {})["request_id"] = request_id
        started = time.perf_counter()
        status = 0
        # Whoever can be read can be asked for its headers: the server leaves the body away.
        inner = {**scope, "method": "GET"} if scope["method"] == "HEAD" else scope

        async def send_with_id(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
                message["headers"] = [*message.get("headers", ()), (b"x-request-id", request_id.encode("ascii"))]
            await send(message)

        try:
            await self._app(inner, receive, send_with_id)
        except Exception:
            logger.exception("a defect", extra={"request_id": request_id})
            if status:
                raise
            await internal().response(request_id)(scope, receive, send_with_id)
        finally:
            end_announcement(scope)
            seconds = time.perf_counter() - started
            route = getattr(inner.get("route"), "path", "unmatched")
            self._metrics.observe_request(route, scope["method"], status, seconds)
            logger.info(
                "request",
                extra={
                    "request_id": request_id,
                    "method": scope["method"],
                    "route": route,
                    "status": status,
                    "ms": round(1e3 * seconds, 3),
                    **scope["state"].get("noted", {}),
                },
            )
