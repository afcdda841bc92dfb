"""JSON Web Tokens (RFC 7519) of an issuer that the operator names, beside keys.

What a token may do is its `scope` (RFC 9068): ``linefix:read``, ``linefix:associate``, ``linefix:write``. Its claim
``linefix_maps`` says how the ids of its maps begin. Signatures are asymmetric only: whoever can check one cannot make
one.
"""

from __future__ import annotations

import hashlib
import logging
import re
import time
import urllib.request
from pathlib import Path
from typing import Any

import jwt

from .errors import UnknownKeyError
from .grants import Grant, Role
from .issuer import Issuer

SCOPE = "linefix:"
MAPS = "linefix_maps"
REQUIRED = ["exp", "iss", "aud", "sub"]
FETCH_SECONDS, REFRESH_SECONDS, SOON_SECONDS = 5.0, 300.0, 10.0
MOST_BYTES = 1_000_000
_PREFIX = re.compile("[A-Za-z0-9._-]{0,128}")
logger = logging.getLogger("linefix")


class Tokens:
    """Checks tokens against keys that are in memory; nothing is fetched while a request waits.

    Parameters
    ----------
    issuer : Issuer
    """

    def __init__(self, issuer: Issuer) -> None:
        self._issuer = issuer
        self._keys: dict[str | None, jwt.PyJWK] = {}
        self._next_fetch = 0.0
        self._last_fetch = -SOON_SECONDS

    def grant(self, token: bytes) -> Grant:
        """Return what a token may do.

        Raises
        ------
        UnknownKeyError
            When it is not this issuer's for this service, or not now.
        """
        issuer = self._issuer
        try:
            key_id = jwt.get_unverified_header(token).get("kid")
            claims = jwt.decode(
                token,
                self._key(key_id),
                algorithms=list(issuer.algorithms),
                issuer=issuer.name,
                audience=issuer.audience,
                leeway=issuer.leeway,
                options={"require": REQUIRED},
            )
            return _grant_of(claims)
        except (jwt.PyJWTError, ValueError, TypeError) as error:
            raise UnknownKeyError from error

    def refresh(self) -> None:
        """Fetch the keys where that is due, off the event loop; what cannot be had leaves them as they were."""
        now = time.monotonic()
        if now < self._next_fetch:
            return
        self._last_fetch, self._next_fetch = now, now + REFRESH_SECONDS
        try:
            self._keys = {key.key_id: key for key in jwt.PyJWKSet.from_json(_fetched(self._issuer.keys)).keys}
        except (OSError, ValueError, jwt.PyJWTError) as error:
            self._next_fetch = now + SOON_SECONDS
            logger.error("the issuer's keys cannot be had: %s", type(error).__name__)

    def _key(self, key_id: object) -> jwt.PyJWK:
        if key_id is None and len(self._keys) == 1:
            return next(iter(self._keys.values()))
        found = self._keys.get(key_id) if isinstance(key_id, str) else None
        if found is None:
            # It may be new: looked for soon, but not for each token that somebody makes up.
            self._next_fetch = min(self._next_fetch, self._last_fetch + SOON_SECONDS)
            raise UnknownKeyError
        return found


def _fetched(where: str) -> str:
    if "://" not in where:
        return Path(where).read_text()
    with urllib.request.urlopen(where, timeout=FETCH_SECONDS) as answer:
        if answer.geturl() != where:
            raise OSError("sent elsewhere")
        return bytes(answer.read(MOST_BYTES)).decode()


def _grant_of(claims: dict[str, Any]) -> Grant:
    scope, maps = claims.get("scope", ""), claims.get(MAPS, "")
    if not isinstance(scope, str) or not isinstance(maps, str) or not _PREFIX.fullmatch(maps):
        raise UnknownKeyError
    said = {word.removeprefix(SCOPE) for word in scope.split() if word.startswith(SCOPE)}
    who = f"{claims['iss']}\n{claims['sub']}".encode()
    return Grant(hashlib.sha256(who).digest(), frozenset(role for role in Role if role.value in said), maps)
