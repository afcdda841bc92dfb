"""Routes that take the request as it is."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import Any

from fastapi import Request, Response
from fastapi.routing import APIRoute
from starlette.types import ASGIApp, Receive, Scope, Send

Endpoint = Callable[[Request], Awaitable[Response]]


class DirectRoute(APIRoute):
    """Documented as any other route; its function gets the request and returns the response.

    There is nothing for FastAPI to look for in the request, nor to check in the answer; to look takes time anyway.
    """

    def __init__(self, path: str, endpoint: Endpoint, **how: Any) -> None:
        super().__init__(path, endpoint, **how)
        self.app = _asked(endpoint)


def _asked(endpoint: Endpoint) -> ASGIApp:
    async def app(scope: Scope, receive: Receive, send: Send) -> None:
        response = await endpoint(Request(scope, receive, send))
        await response(scope, receive, send)

    return app
