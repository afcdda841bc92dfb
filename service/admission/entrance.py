"""Decisions from a request's head alone, before its body is read and before the application is called."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from linefix.documents.errors import BodyTooLargeError

from ..errors import MissingRoleError, UnknownMapError
from .gate import Gate, Ticket
from .keys import EVERY_ROLE, Grant, Keyring, Role
from .origins import Origins

GUARDED = "/v1/"
"""Prefix of the paths that require a key; probes and pages stay open."""
LIMITS = GUARDED + "limits"
"""The one of them for which any key will do."""
MAPS = GUARDED + "maps/"
ROLES = {"GET": Role.READ, "HEAD": Role.READ, "POST": Role.ASSOCIATE, "PUT": Role.WRITE, "DELETE": Role.WRITE}
"""The role that a method requires. A POST searches, converts or checks its content, and never stores it."""


class Entrance:
    """Gives tickets, and refuses requests without permission, and searches while the queue is full."""

    def __init__(self, gate: Gate, keyring: Keyring, origins: Origins, max_body_bytes: int) -> None:
        self._gate = gate
        self._keyring = keyring
        self._origins = origins
        self._max_body_bytes = max_body_bytes

    def admit(self, head: Mapping[str, Any]) -> Ticket:
        """Return the ticket of a request, given its ASGI scope.

        Raises
        ------
        ForeignHostError, ForeignOriginError
            When the request may come from a web page in a browser, and the service has no keys.
        MissingKeyError, UnknownKeyError
            When the path requires a key.
        MissingRoleError, UnknownMapError
            When the key lacks the role for the request, or no such map exists for the key.
        BodyTooLargeError
            When the body is too long by the length that the head states.
        QueueFullError, ShareUsedError
            When there is no place for a search.
        """
        method, path, headers = head["method"], head["path"], head["headers"]
        self._origins.require(headers)
        grant, searches = Grant(), False
        if path.startswith(GUARDED):
            grant = self._keyring.grant(headers, head.get("client"))
            _require(grant, method, path)
            searches = method == "POST" or (path.endswith(":check") and method in ("GET", "HEAD"))
        if method in ("POST", "PUT"):
            for name, value in headers:
                if name == b"content-length" and value.isdigit() and int(value) > self._max_body_bytes:
                    raise BodyTooLargeError(self._max_body_bytes)
        if searches:
            self._gate.require_place(grant.holder)
        return Ticket(grant.holder, grant.maps)


def _require(grant: Grant, method: str, path: str) -> None:
    """Raise where the caller lacks the permission for this request."""
    role = ROLES.get(method)
    if role is None and (grant.roles, grant.maps) != (EVERY_ROLE, ""):
        raise MissingRoleError("the key lacks every role and all maps, which this method requires; send a key that has")
    if role is not None and role not in grant.roles and path != LIMITS:
        raise MissingRoleError(f"the key lacks the role `{role}`; send a key that has it")
    # An id ends where a prefix cannot go on, so that the rest of the path begins like the id.
    if path.startswith(MAPS) and not path.startswith(MAPS + grant.maps):
        raise UnknownMapError
