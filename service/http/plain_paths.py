"""Paths without control characters: what stands in front of a service compares paths, and has to read them as it does.

A router that looks for the end of a line takes ``/metrics%0A`` for ``/metrics``; the rule of a proxy for that very path
does not.
"""

from __future__ import annotations

from unicodedata import category

from starlette.types import ASGIApp, Receive, Scope, Send

from .errors import ControlCharacterError

CONTROL = {"Cc", "Zl", "Zp"}  # of Unicode: C0 and C1, DEL, and what separates lines and paragraphs


class PlainPaths:
    """Refuses a request whose path, its escapes undone, has a control character; plain ASGI, as `Reception` is."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request.

        Raises
        ------
        ControlCharacterError
        """
        path = scope.get("path", "")
        if not path.isprintable():
            for character in path:
                if category(character) in CONTROL:
                    raise ControlCharacterError(character)
        await self._app(scope, receive, send)
