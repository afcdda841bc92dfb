"""Bearer keys."""

from __future__ import annotations

import hashlib
import hmac
from collections.abc import Iterable, Sequence

from pydantic import SecretStr
from starlette.types import ASGIApp, Receive, Scope, Send

from ..http.problems import ProblemError
from ..http.reception import request_id_of
from .fair_queue import Holder

GUARDED = "/v1/"


class Keyring:
    """The keys that are known, as digests."""

    def __init__(self, keys: Sequence[SecretStr]) -> None:
        self._digests = [_digest(key.get_secret_value().encode()) for key in keys]

    def holder(self, headers: Iterable[tuple[bytes, bytes]]) -> Holder:
        """Return whose key a request carries; None where the service has no keys.

        Raises
        ------
        ProblemError
            When it carries none, or one that is not known.
        """
        if not self._digests:
            return None
        sent = [value for name, value in headers if name == b"authorization"]
        scheme, _, key = sent[0].partition(b" ") if len(sent) == 1 else (b"", b"", b"")
        if scheme.lower() != b"bearer" or not key.strip():
            challenge = {"WWW-Authenticate": 'Bearer realm="linefix"'}
            raise ProblemError("unauthorized", "send Authorization: Bearer <key>", headers=challenge)
        # Digests of one length, all of them compared: the time taken tells nothing of the keys.
        digest = _digest(key.strip())
        if not sum(hmac.compare_digest(digest, known) for known in self._digests):
            raise ProblemError("forbidden", "this key is not known here")
        return digest


class KeyGuard:
    """Lets only known keys to everything under ``/v1/``, before a body is read; probes and pages stay open."""

    def __init__(self, app: ASGIApp, keyring: Keyring) -> None:
        self._app = app
        self._keyring = keyring

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        if scope["type"] == "http" and scope["path"].startswith(GUARDED):
            try:
                scope["state"]["holder"] = self._keyring.holder(scope["headers"])
            except ProblemError as problem:
                await problem.response(request_id_of(scope))(scope, receive, send)
                return
        await self._app(scope, receive, send)


def _digest(key: bytes) -> bytes:
    return hashlib.sha256(key).digest()
