"""Decisions from a request's head alone, before its body is read and before the application is called."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from linefix.documents.errors import BodyTooLargeError

from .errors import ForeignMapError, MissingRoleError
from .gate import Gate
from .grants import GUARDED, Asked, Grant, asked_of
from .keys import Keyring
from .origins import Origins
from .ticket import Ticket

Head = Mapping[str, Any]
"""An ASGI scope: method, path, headers, client."""
Headers = Sequence[tuple[bytes, bytes]]


def search_of(method: str, path: str) -> str | None:
    """Return the route of a request that needs a slot at the gate, a map's id left out; None where it needs none."""
    access = asked_of(method, path).access
    return access.path if access is not None and access.searches else None


class Entrance:
    """Gives tickets, and refuses requests without permission, and searches while the queue is full."""

    def __init__(self, gate: Gate, keyring: Keyring, origins: Origins, max_body_bytes: int) -> None:
        self._gate = gate
        self._keyring = keyring
        self._origins = origins
        self._max_body_bytes = max_body_bytes

    def admit(self, head: Head) -> Ticket:
        """Return the ticket of a request.

        Parameters
        ----------
        head : Head
            The path without its query, its escapes undone; names of headers in lower case.

        Raises
        ------
        ForeignHostError, ForeignOriginError
            When the request may come from a web page in a browser, and the service has no keys.
        MissingKeyError, UnknownKeyError
            When the path requires a key.
        MissingRoleError, ForeignMapError
            When the key lacks the role for the request, or no such map exists for the key.
        BodyTooLargeError
            When the body is too long by the length that the head states.
        QueueFullError, ShareUsedError
            When there is no place for a search.
        """
        method, path, headers = head["method"], head["path"], head["headers"]
        self._origins.require(headers)
        if not path.startswith(GUARDED) or self._origins.is_preflight(method, headers):
            grant, searches = Grant(), False
        else:
            asked = asked_of(method, path)
            grant = self._keyring.grant(headers, head.get("client"))
            _require(grant, asked)
            searches = asked.access is not None and asked.access.searches
        if method in ("POST", "PUT"):
            self._check_length(headers)
        if not searches:
            return Ticket(grant.holder, maps=grant.maps)
        self._gate.require_place(grant.holder)
        return Ticket(grant.holder, self._gate, grant.maps)

    def _check_length(self, headers: Headers) -> None:
        for name, value in headers:
            if name == b"content-length" and value.isdigit() and int(value) > self._max_body_bytes:
                raise BodyTooLargeError(self._max_body_bytes)


def _require(grant: Grant, asked: Asked) -> None:
    """Raise where the caller lacks the permission for this request."""
    access = asked.access
    # A path outside the table may belong to a route that is missing there.
    allowed = grant.is_whole if access is None else access.role is None or access.role in grant.roles
    if not allowed:
        raise MissingRoleError(None if access is None else access.role)
    if asked.map_id is not None and not grant.sees(asked.map_id):
        raise ForeignMapError
