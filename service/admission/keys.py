"""Identification of callers: by a key, or by an address where the service has none."""

from __future__ import annotations

import hashlib
import hmac
import ipaddress
from collections.abc import Iterable, Sequence
from functools import lru_cache

from pydantic import SecretStr

from .errors import MissingKeyError, UnknownKeyError
from .fair_queue import Holder
from .grants import Grant
from .key_file import KeyFile

Client = tuple[str, int] | None


class Keyring:
    """The keys that are known, as digests.

    Parameters
    ----------
    keys : sequence of SecretStr
        Keys with every permission.
    file : KeyFile, or None
        Without both every caller is let in.
    """

    def __init__(self, keys: Sequence[SecretStr], file: KeyFile | None = None) -> None:
        digests = (digest_of(key.get_secret_value().encode()) for key in keys)
        self._whole = {digest: Grant(digest) for digest in digests}
        self._file = file
        self._guarded = bool(keys) or file is not None

    def grant(self, headers: Iterable[tuple[bytes, bytes]], client: Client = None) -> Grant:
        """Return the permissions of a request; where the service has no keys, all, for the address it comes from.

        Parameters
        ----------
        headers : iterable of (bytes, bytes)
            Names in lower case, as ASGI has them.
        client : (str, int) or None
            Address and port of the other end, where they are known.

        Raises
        ------
        MissingKeyError
            When it carries no key, or more than one.
        UnknownKeyError
            When it carries one that is not known.
        """
        if not self._guarded:
            return Grant(address_of(client))
        sent = [value for name, value in headers if name == b"authorization"]
        if len(sent) != 1:
            raise MissingKeyError
        scheme, _, key = sent[0].partition(b" ")
        key = key.strip()
        if scheme.lower() != b"bearer" or not key:
            raise MissingKeyError
        # Digests of one length, all of them compared: the time taken shows nothing of the keys.
        digest = digest_of(key)
        known: list[Grant] = [*self._whole.values(), *(self._file.grants.values() if self._file else ())]
        found = [grant for grant in known if hmac.compare_digest(digest, grant.holder or b"")]
        if found:
            return found[0]
        raise UnknownKeyError

    def refresh(self) -> None:
        """Look for keys of the file that came or went; off the event loop."""
        if self._file is not None:
            self._file.refresh()


def digest_of(key: bytes) -> bytes:
    """Return the digest that is stored of a key."""
    return hashlib.sha256(key).digest()


@lru_cache(maxsize=256)
def address_of(client: Client) -> Holder:
    """Return the holder of an address: of IPv6 the network, since one client has all of its addresses."""
    if client is None:
        return None
    try:
        address = ipaddress.ip_address(client[0].partition("%")[0])
    except ValueError:
        return client[0].encode()
    if address.version == 4:
        return address.packed
    return address.ipv4_mapped.packed if address.ipv4_mapped is not None else address.packed[:8]
