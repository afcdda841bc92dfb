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

from ..errors import ForeignHostError, ForeignOriginError

_READ = frozenset((b"host", b"origin", b"sec-fetch-site"))
_HOST = re.compile(r"(?:(?P<name>[a-z0-9._-]+)|\[(?P<address>[0-9a-f:.]+)\])(?::[0-9]*)?")
_PORTS = {"http": 80, "https": 443}


class Origins:
    """Checks the hosts and origins of requests to a service without keys.

    `hosts` are names in addition to `localhost` and every address; pages of the origins `named` may send requests.
    """

    def __init__(self, hosts: Sequence[str], *, guarded: bool, named: Sequence[str] = ()) -> None:
        self._hosts = {"localhost", "localhost.", *(host.lower() for host in hosts)}
        self._named = frozenset(named)
        self._guarded = guarded

    def require(self, headers: Iterable[tuple[bytes, bytes]]) -> None:
        """Refuse requests that the page of another site may have sent.

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
        sent = {name: value.decode("latin-1").strip().lower() for name, value in headers if name in _READ}
        host, origin = sent.get(b"host"), sent.get(b"origin")
        if host is not None and not self._is_known(host):
            raise ForeignHostError
        if origin in self._named:
            return
        if sent.get(b"sec-fetch-site") == "cross-site" or (origin is not None and not _is_same(origin, host)):
            raise ForeignOriginError

    def _is_known(self, host: str) -> bool:
        found = _HOST.fullmatch(host)
        return found is not None and (found["name"] in self._hosts or _is_address(found["name"] or found["address"]))


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
        page, asked = urlsplit(origin), urlsplit(f"//{host or ''}")
        usual = _PORTS.get(page.scheme)
        return bool(page.hostname) and (page.hostname, page.port or usual) == (asked.hostname, asked.port or usual)
    except ValueError:
        return False
