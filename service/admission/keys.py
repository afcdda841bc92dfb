"""Bearer keys."""

from __future__ import annotations

import hashlib
import hmac
import ipaddress
from collections.abc import Iterable, Sequence
from functools import lru_cache

from pydantic import SecretStr

from .errors import MissingKeyError, UnknownKeyError
from .fair_queue import Holder

Client = tuple[str, int] | None


class Keyring:
    """The keys that are known, as digests.

    Parameters
    ----------
    keys : sequence of SecretStr
        None at all: whoever comes is let in.
    """

    def __init__(self, keys: Sequence[SecretStr]) -> None:
        self._digests = [_digest(key.get_secret_value().encode()) for key in keys]

    def holder(self, headers: Iterable[tuple[bytes, bytes]], client: Client = None) -> Holder:
        """Return whose key a request carries; where the service has no keys, from which address it comes.

        Parameters
        ----------
        headers : iterable of (bytes, bytes)
            Names in lower case, as ASGI has them.
        client : (str, int) or None
            Address and port of the other end, where they are known.

        Raises
        ------
        MissingKeyError
            When it carries none, or more than one.
        UnknownKeyError
            When it carries one that is not known.
        """
        if not self._digests:
            return address_of(client)
        sent = [value for name, value in headers if name == b"authorization"]
        if len(sent) != 1:
            raise MissingKeyError
        scheme, _, key = sent[0].partition(b" ")
        if scheme.lower() != b"bearer" or not key.strip():
            raise MissingKeyError
        # Digests of one length, all of them compared: the time taken tells nothing of the keys.
        digest = _digest(key.strip())
        if not sum(hmac.compare_digest(digest, known) for known in self._digests):
            raise UnknownKeyError
        return digest


def _digest(key: bytes) -> bytes:
    return hashlib.sha256(key).digest()


@lru_cache(maxsize=256)
def address_of(client: Client) -> Holder:
    """Return who a client is by its address: of IPv6 the network, since one client has all of its addresses."""
    if client is None:
        return None
    try:
        address = ipaddress.ip_address(client[0].partition("%")[0])
    except ValueError:
        return client[0].encode()
    if address.version == 4:
        return address.packed
    return address.ipv4_mapped.packed if address.ipv4_mapped is not None else address.packed[:8]
