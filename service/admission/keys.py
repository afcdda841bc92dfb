"""Identification of callers: by a key, or by an address where the service has no keys."""

from __future__ import annotations

import hashlib
import ipaddress
import logging
from collections.abc import Iterable, Sequence
from functools import lru_cache
from pathlib import Path

from pydantic import SecretStr

from ..errors import MissingKeyError, UnknownKeyError
from .key_file import Grant, Holder, KeyFileError, read_keys, state_of

logger = logging.getLogger("linefix")
Client = tuple[str, int] | None


class Keyring:
    """The keys that are known, as digests: those of the settings, with every permission, and those of a file.

    `file` may be a directory of them, as secrets are mounted. Without keys every caller is let in. Raises
    `KeyFileError` where the file cannot be used to begin with.
    """

    def __init__(self, keys: Sequence[SecretStr], file: Path | None = None) -> None:
        digests = [hashlib.sha256(key.get_secret_value().encode()).digest() for key in keys]
        self._whole = {digest: Grant(digest) for digest in digests}
        self._file = file
        self._seen = None if file is None else state_of(file)
        self.grants = self._whole if file is None else read_keys(file) | self._whole
        self._guarded = bool(keys) or file is not None

    def grant(self, headers: Iterable[tuple[bytes, bytes]], client: Client = None) -> Grant:
        """Return the permissions of a request; where the service has no keys, all, for the address it comes from.

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
        scheme, _, key = (sent[0] if len(sent) == 1 else b"").partition(b" ")
        key = key.strip()
        if scheme.lower() != b"bearer" or not key:
            raise MissingKeyError
        # Looked up by its digest: the time taken shows nothing of the keys.
        found = self.grants.get(hashlib.sha256(key).digest())
        if found is None:
            raise UnknownKeyError
        return found

    def refresh(self) -> None:
        """Read the file again where it has changed; what cannot be used leaves the keys as they were, and is logged."""
        if self._file is None or (state := state_of(self._file)) == self._seen:
            return
        self._seen = state
        try:
            self.grants = read_keys(self._file) | self._whole
        except KeyFileError as error:
            logger.error("the keys stay as they were: %s", error)
        else:
            logger.info("keys read", extra={"keys": len(self.grants)})


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
