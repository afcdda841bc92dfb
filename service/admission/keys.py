"""Bearer keys."""

from __future__ import annotations

import hashlib
import hmac
from collections.abc import Iterable, Sequence

from pydantic import SecretStr

from .errors import MissingKeyError, UnknownKeyError
from .fair_queue import Holder


class Keyring:
    """The keys that are known, as digests.

    Parameters
    ----------
    keys : sequence of SecretStr
        None at all: whoever comes is let in.
    """

    def __init__(self, keys: Sequence[SecretStr]) -> None:
        self._digests = [_digest(key.get_secret_value().encode()) for key in keys]

    def holder(self, headers: Iterable[tuple[bytes, bytes]]) -> Holder:
        """Return whose key a request carries; None where the service has no keys.

        Parameters
        ----------
        headers : iterable of (bytes, bytes)
            Names in lower case, as ASGI has them.

        Raises
        ------
        MissingKeyError
            When it carries none, or more than one.
        UnknownKeyError
            When it carries one that is not known.
        """
        if not self._digests:
            return None
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
