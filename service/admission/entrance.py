"""Decides from a request's head alone: before its body is read and before the application is asked."""

from __future__ import annotations

from collections.abc import Sequence

from ..schemas.errors import BodyTooLargeError
from .errors import MissingKeyError, UnknownKeyError
from .gate import SearchGate
from .keys import Keyring
from .ticket import Ticket

SEARCHING = frozenset(("/v1/associate", "/v1/associate:batch", "/v1/register", "/v1/vectorize"))
"""Paths whose POST needs a turn at the gate."""

Headers = Sequence[tuple[bytes, bytes]]


def is_search(method: str, path: str) -> bool:
    """Tell whether a request needs a turn at the gate."""
    return method == "POST" and path in SEARCHING


class Entrance:
    """Gives tickets, and sends away what would have to search while the queue is full.

    Parameters
    ----------
    gate : SearchGate
    keyring : Keyring
    max_body_bytes : int
    """

    def __init__(self, gate: SearchGate, keyring: Keyring, max_body_bytes: int) -> None:
        self._gate = gate
        self._keyring = keyring
        self._max_body_bytes = max_body_bytes

    def admit(self, method: str, path: str, headers: Headers) -> Ticket:
        """Return the ticket of a request.

        What is wrong with a key is in the ticket: not every path asks for one.

        Parameters
        ----------
        method, path : str
            The path without its query, its escapes undone.
        headers : sequence of (bytes, bytes)
            Names in lower case.

        Raises
        ------
        BodyTooLargeError
            When the body is too long by what the head says of it.
        QueueFullError, ShareUsedError
            When there is no place for a search.
        """
        if method in ("POST", "PUT"):
            self._check_length(headers)
        try:
            holder = self._keyring.holder(headers)
        except (MissingKeyError, UnknownKeyError) as error:
            return Ticket(key_error=type(error))
        if not is_search(method, path):
            return Ticket(holder)
        self._gate.require_place(holder)
        return Ticket(holder, self._gate)

    def _check_length(self, headers: Headers) -> None:
        for name, value in headers:
            if name == b"content-length" and value.isdigit() and int(value) > self._max_body_bytes:
                raise BodyTooLargeError(self._max_body_bytes)
