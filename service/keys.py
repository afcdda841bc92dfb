"""Bearer keys."""

from __future__ import annotations

import hashlib
import hmac
from collections.abc import Sequence

from pydantic import SecretStr
from starlette.types import ASGIApp, Receive, Scope, Send

from .context import request_id_of
from .problems import ProblemError

GUARDED = "/v1/"


class KeyGuard:
    """Lets only known keys to everything under ``/v1/``, before a body is read; probes and pages stay open."""

    def __init__(self, app: ASGIApp, keys: Sequence[SecretStr]) -> None:
        self._app = app
        self._digests = [_digest(key.get_secret_value().encode()) for key in keys]

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        if scope["type"] == "http" and self._digests and scope["path"].startswith(GUARDED):
            problem = self._check(scope)
            if problem is not None:
                await problem.response(request_id_of(scope))(scope, receive, send)
                return
        await self._app(scope, receive, send)

    def _check(self, scope: Scope) -> ProblemError | None:
        sent = [value for name, value in scope["headers"] if name == b"authorization"]
        scheme, _, key = sent[0].partition(b" ") if len(sent) == 1 else (b"", b"", b"")
        if scheme.lower() != b"bearer" or not key.strip():
            challenge = {"WWW-Authenticate": 'Bearer realm="linefix"'}
            return ProblemError("unauthorized", "send Authorization: Bearer <key>", headers=challenge)
        # Digests of one length, all of them compared: the time taken tells nothing of the keys.
        digest = _digest(key.strip())
        if not sum(hmac.compare_digest(digest, known) for known in self._digests):
            return ProblemError("forbidden", "this key is not known here")
        return None


def _digest(key: bytes) -> bytes:
    return hashlib.sha256(key).digest()
