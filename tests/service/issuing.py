"""Keys with roles, and an issuer of tokens, for the tests that need them."""

from __future__ import annotations

import hashlib
import json
import time
from pathlib import Path
from typing import Any

import jwt
from cryptography.hazmat.primitives.asymmetric import ec
from jwt.algorithms import ECAlgorithm

ISSUER, AUDIENCE = "https://issuer.example", "linefix"


def key_lines(key: str, roles: list[str], maps: str = "") -> str:
    """Return the lines of a file of keys."""
    digest = hashlib.sha256(key.encode()).hexdigest()
    return f'[[key]]\nname = "{key[:8]}"\nsha256 = "{digest}"\nroles = {json.dumps(roles)}\nmaps = "{maps}"\n'


class Issuing:
    """An issuer of tokens."""

    def __init__(self, key_id: str = "one") -> None:
        self.private = ec.generate_private_key(ec.SECP256R1())
        self._key_id = key_id

    def key_set(self) -> str:
        public = ECAlgorithm.to_jwk(self.private.public_key(), as_dict=True)
        return json.dumps({"keys": [{**public, "kid": self._key_id, "alg": "ES256", "use": "sig"}]})

    def write(self, path: Path) -> None:
        path.write_text(self.key_set())

    def token(self, **claims: Any) -> str:
        """Return a token that is taken, as far as the claims do not say otherwise; None leaves one out."""
        usual = {"iss": ISSUER, "aud": AUDIENCE, "sub": "robot", "exp": time.time() + 600, "scope": "linefix:associate"}
        said = {name: value for name, value in {**usual, **claims}.items() if value is not None}
        return jwt.encode(said, self.private, algorithm="ES256", headers={"kid": self._key_id})
