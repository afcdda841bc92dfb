"""Decides from a request's head alone: before its body is read and before the application is asked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ..schemas.errors import BodyTooLargeError
from .gate import SearchGate
from .keys import Keyring
from .origins import Origins
from .ticket import Ticket

SEARCHING = frozenset(("/v1/analyze", "/v1/associate", "/v1/associate:batch", "/v1/register", "/v1/vectorize"))
"""Paths whose POST needs a turn at the gate."""
MAPS, CHECK, ANALYZE = "/v1/maps/", ":check", ":analyze"
"""How the paths of a map's check and analysis begin and end, which need one to be read, too."""
GUARDED = "/v1/"
"""What asks for a key begins so; probes and pages stay open."""

Head = Mapping[str, Any]
"""What ASGI calls a scope: method, path, headers, client."""
Headers = Sequence[tuple[bytes, bytes]]


def search_of(method: str, path: str) -> str | None:
    """Return the route of a request that needs a turn at the gate, a map's id left out; None where it needs none."""
    if method == "POST" and path in SEARCHING:
        return path
    if method in ("GET", "HEAD", "POST") and path.startswith(MAPS) and path.endswith(CHECK):
        return MAPS + "{map_id}" + CHECK
    if method == "POST" and path.startswith(MAPS) and path.endswith(ANALYZE):
        return MAPS + "{map_id}" + ANALYZE
    return None


class Entrance:
    """Gives tickets, and sends away who may not come in, and what would have to search while the queue is full.

    Parameters
    ----------
    gate : SearchGate
    keyring : Keyring
    origins : Origins
    max_body_bytes : int
    """

    def __init__(self, gate: SearchGate, keyring: Keyring, origins: Origins, max_body_bytes: int) -> None:
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
            When it may come from a web page that somebody looks at, and the service has no keys.
        MissingKeyError, UnknownKeyError
            When the path asks for a key.
        BodyTooLargeError
            When the body is too long by what the head says of it.
        QueueFullError, ShareUsedError
            When there is no place for a search.
        """
        method, path, headers = head["method"], head["path"], head["headers"]
        self._origins.require(headers)
        holder = self._keyring.holder(headers, head.get("client")) if path.startswith(GUARDED) else None
        if method in ("POST", "PUT"):
            self._check_length(headers)
        if search_of(method, path) is None:
            return Ticket(holder)
        self._gate.require_place(holder)
        return Ticket(holder, self._gate)

    def _check_length(self, headers: Headers) -> None:
        for name, value in headers:
            if name == b"content-length" and value.isdigit() and int(value) > self._max_body_bytes:
                raise BodyTooLargeError(self._max_body_bytes)
