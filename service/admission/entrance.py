"""Decisions from a request's head alone, before its body is read and before the application is called.

Without keys any program on the operator's machine may use the service. So might any web page that the operator opens.
It may use a name of its own that resolves to the service's address, or a form or a script that sends without reading
the answer. A key keeps both out, since no page has it.
"""

from __future__ import annotations

import ipaddress
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from linefix.documents.errors import BodyTooLargeError

from ..errors import ForeignHostError, ForeignOriginError, MissingRoleError, NotHttpError, UnknownMapError
from .gate import Gate, Ticket
from .keys import EVERY_ROLE, Grant, Keyring, Role

GUARDED = "/v1/"
"""Prefix of the paths that require a key; probes and pages stay open."""
LIMITS = GUARDED + "limits"
"""The one of them for which any key will do."""
MAPS = GUARDED + "maps/"
ROLES = {"GET": Role.READ, "HEAD": Role.READ, "POST": Role.ASSOCIATE, "PUT": Role.WRITE, "DELETE": Role.WRITE}
"""The role that a method requires. A POST searches, converts or checks its content, and never stores it."""
_HOST = re.compile(r"^(?:([a-z0-9._-]+)|\[([0-9a-f:.]+)\])(?::[0-9]*)?\Z")
_TWO_LENGTHS = {b"transfer-encoding", b"content-length"}
_PLAIN_HOST = re.compile(r"[A-Za-z0-9._~%!$&'()*+,;=:\[\]-]*")


@dataclass(frozen=True, slots=True)
class Entrance:
    """Gives tickets, and refuses requests without permission, and searches while the queue is full.

    Without keys, `hosts` are names, in small letters, in addition to `localhost` and every address, and pages of
    `origins` may send requests.
    """

    gate: Gate
    keyring: Keyring
    max_body_bytes: int
    hosts: tuple[str, ...]
    origins: Sequence[str]

    def admit(self, head: Mapping[str, Any]) -> Ticket:
        """Return the ticket of a request, given its ASGI scope.

        Raises
        ------
        NotHttpError
            When two servers could read it in two ways.
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
        # h11 has refused two hosts, two lengths, one that is no number, no host in HTTP/1.1, and codings but chunked.
        fields = {name: value.decode("latin-1").strip() for name, value in headers}
        _require_plain(path, fields)
        if not self.keyring.guarded:  # a page of another site has no key
            self._require_own_page(fields)
        grant, searches = Grant(), False
        if path.startswith(GUARDED):
            grant = self.keyring.grant(headers, head.get("client"))
            _require(grant, method, path)
            searches = method == "POST" or (path.endswith(":check") and method in ("GET", "HEAD"))
        if method in ("POST", "PUT") and int(fields.get(b"content-length", "0")) > self.max_body_bytes:
            raise BodyTooLargeError(self.max_body_bytes)
        if searches:
            self.gate.require_place(grant.holder)
        return Ticket(grant.holder, grant.maps, searches)

    def _require_own_page(self, fields: Mapping[bytes, str]) -> None:
        """Refuse requests that the page of another site may have sent.

        Raises
        ------
        ForeignHostError
            When the host is neither an address nor a name that is known. Only HTTP/1.0, which no browser speaks, has
            none.
        ForeignOriginError
            When the browser's headers name another site's page as the sender.
        """
        host, origin = fields.get(b"host", "").lower(), fields.get(b"origin", "").lower()
        if b"host" in fields and not _is_known(host, self.hosts):
            raise ForeignHostError
        if origin in self.origins:
            return
        # A browser leaves the usual port out of both; the scheme may be that of a proxy.
        is_foreign = b"origin" in fields and origin.partition("://")[2] != host
        if is_foreign or fields.get(b"sec-fetch-site", "").lower() == "cross-site":
            raise ForeignOriginError


@lru_cache(maxsize=256)
def _is_known(host: str, hosts: tuple[str, ...]) -> bool:
    name = _HOST.sub(r"\1\2", host)  # without port and brackets; another text stays as it is
    with suppress(ValueError):
        return name in ("localhost", "localhost.", *hosts) or bool(ipaddress.ip_address(name))
    return False


def _require_plain(path: str, fields: Mapping[bytes, str]) -> None:
    """Refuse control characters, and what two servers could read in two ways and ours takes: RFC 9112, 3.2 and 6.1.

    A router that looks for the end of a line takes ``/metrics%0A`` for ``/metrics``; the rule of a proxy for that path
    does not.
    """
    if fields.keys() >= _TWO_LENGTHS or not _PLAIN_HOST.fullmatch(fields.get(b"host", "")):
        raise NotHttpError
    if not path.isprintable():
        raise NotHttpError("the path has a control character, or another one that is not printed; remove it")


def _require(grant: Grant, method: str, path: str) -> None:
    """Raise where the caller lacks the permission for this request."""
    needed = {ROLES[method]} if method in ROLES else EVERY_ROLE
    if path != LIMITS and not needed <= grant.roles:
        raise MissingRoleError(f"the key lacks the role `{min(needed - grant.roles)}`; send a key that has it")
    # An id ends where a prefix cannot go on, so that the rest of the path begins like the id.
    if path.startswith(MAPS) and not path.startswith(MAPS + grant.maps):
        raise UnknownMapError
