"""JSON Web Tokens (RFC 7519) of an issuer that the operator names, in addition to keys.

The claim `scope` (RFC 9068) holds the permissions of a token: ``linefix:read``, ``linefix:associate``,
``linefix:write``. Its claim ``linefix_maps`` holds the prefix of the ids of its maps. Signatures are asymmetric only:
the key that checks one cannot make one.
"""

from __future__ import annotations

import hashlib
import logging
import re
import time
from typing import Any

import jwt

from .errors import UnknownKeyError
from .grants import Grant, Role
from .key_set import Keys, KeySetError, read_key_set
from .keys import Issuer

SCOPE = "linefix:"
MAPS = "linefix_maps"
REQUIRED = ["exp", "iss", "aud", "sub"]
REFRESH_SECONDS, SOON_SECONDS = 300.0, 10.0
LONGEST_SECONDS = 86_400.0  # s that keys are used while their issuer cannot be reached: it may have taken one back
_PREFIX = re.compile("[A-Za-z0-9._-]{0,128}")
logger = logging.getLogger("linefix")


class Tokens:
    """Checks tokens against keys that are in memory; nothing is fetched while a request waits."""

    def __init__(self, issuer: Issuer) -> None:
        self._issuer = issuer
        self._keys: Keys = {}
        self._next_fetch = 0.0
        self._last_fetch = -SOON_SECONDS
        self._fetched = 0.0

    def grant(self, token: bytes) -> Grant:
        """Return the permissions of a token.

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
        """Fetch the keys where that is due, off the event loop.

        While the set cannot be fetched the keys stay for `LONGEST_SECONDS`; a set without keys removes them all.
        """
        now = time.monotonic()
        if now < self._next_fetch:
            return
        self._last_fetch, self._next_fetch = now, now + REFRESH_SECONDS
        try:
            self._keys = read_key_set(self._issuer.keys)
        except KeySetError as error:
            self._next_fetch = time.monotonic() + SOON_SECONDS
            if self._keys and now - self._fetched > LONGEST_SECONDS:
                self._keys = {}
                logger.error(
                    "tokens are rejected until the issuer's keys can be fetched, because the last ones are %g h old",
                    LONGEST_SECONDS / 3600.0,
                )
            logger.error("the issuer's keys cannot be fetched: %s; check LINEFIX_JWT_KEYS", error)
            return
        self._fetched = now
        if not self._keys:
            logger.error(
                "the issuer has no key that verifies signatures: its tokens are rejected; check LINEFIX_JWT_KEYS"
            )

    def _key(self, key_id: object) -> jwt.PyJWK:
        if key_id is None and len(self._keys) == 1:
            return next(iter(self._keys.values()))
        found = self._keys.get(key_id) if isinstance(key_id, str) else None
        if found is None:
            # The key may be new: it is looked for soon, but not once for each token with an invented id.
            self._next_fetch = min(self._next_fetch, self._last_fetch + SOON_SECONDS)
            raise UnknownKeyError
        return found


def _grant_of(claims: dict[str, Any]) -> Grant:
    scope, maps = claims.get("scope", ""), claims.get(MAPS, "")
    if not isinstance(scope, str) or not isinstance(maps, str) or not _PREFIX.fullmatch(maps):
        raise UnknownKeyError
    said = {word.removeprefix(SCOPE) for word in scope.split() if word.startswith(SCOPE)}
    who = f"{claims['iss']}\n{claims['sub']}".encode()
    return Grant(hashlib.sha256(who).digest(), frozenset(role for role in Role if role.value in said), maps)
