"""Hosts and origins from which a browser may send requests.

Without keys any program on the operator's machine may use the service. So might any web page that the operator opens.
It may use a name of its own that resolves to the service's address, or a form or a script that sends without reading
the answer. A key keeps both out, since no page has it.
"""

from __future__ import annotations

import ipaddress
import re
from collections.abc import Iterable, Sequence
from functools import lru_cache
from urllib.parse import urlsplit

from .errors import ForeignHostError, ForeignOriginError

LOCAL = frozenset(("localhost", "localhost."))


class Origins:
    """Check the hosts and origins of requests.

    Parameters
    ----------
    hosts : sequence of str
        Names in addition to `localhost` and every address.
    guarded : bool
        True when the service has keys: then nothing is refused here.
    named : sequence of str
        Origins whose pages may send requests.
    """

    def __init__(self, hosts: Sequence[str], *, guarded: bool, named: Sequence[str] = ()) -> None:
        self._named = frozenset(name.encode() for name in named)
        self._hosts = LOCAL | {host.lower() for host in hosts}
        self._guarded = guarded

    def require(self, headers: Iterable[tuple[bytes, bytes]]) -> None:
        """Refuse requests that the page of another site may have sent.

        Parameters
        ----------
        headers : iterable of (bytes, bytes)
            Names in lower case, as ASGI has them.

        Raises
        ------
        ForeignHostError
            When the host is neither an address nor a name that is known. Only HTTP/1.0, which no browser speaks, has
            none.
        ForeignOriginError
            When the browser's headers name another site's page as the sender.
        """
        if self._guarded:
            return
        found = {name: value.decode("latin-1").strip().lower() for name, value in headers if name in _LOOKED_AT}
        host = found.get(b"host")
        if host is not None and not self._is_known(host):
            raise ForeignHostError
        origin = found.get(b"origin")
        if origin is not None and origin.encode("latin-1") in self._named:
            return
        if found.get(b"sec-fetch-site") == "cross-site" or (origin is not None and not _is_same(origin, host)):
            raise ForeignOriginError

    def is_preflight(self, method: str, headers: Iterable[tuple[bytes, bytes]]) -> bool:
        """Return whether this is a browser's preflight request for the page of a named origin; it has no key."""
        if method != "OPTIONS" or not self._named:
            return False
        found = dict(headers)
        return b"access-control-request-method" in found and found.get(b"origin") in self._named

    def _is_known(self, host: str) -> bool:
        found = _HOST.fullmatch(host)
        return found is not None and (found["name"] in self._hosts or _is_address(found["name"] or found["address"]))


_LOOKED_AT = frozenset((b"host", b"origin", b"sec-fetch-site"))
_HOST = re.compile(r"(?:(?P<name>[a-z0-9._-]+)|\[(?P<address>[0-9a-f:.]+)\])(?::[0-9]*)?")
_PORTS = {"http": 80, "https": 443}


@lru_cache(maxsize=256)
def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


def _is_same(origin: str, host: str | None) -> bool:
    """Return whether a page's origin is the host of its request, whichever scheme a proxy before it speaks."""
    try:
        page = urlsplit(origin)
        asked = urlsplit(f"//{host or ''}")
        usual = _PORTS.get(page.scheme)
        return bool(page.hostname) and (page.hostname, page.port or usual) == (asked.hostname, asked.port or usual)
    except ValueError:
        return False
