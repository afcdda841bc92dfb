"""Whose JSON Web Tokens are taken; light to import, since settings do."""

from __future__ import annotations

from dataclasses import dataclass

# Whoever can check such a signature cannot make one; "none" and shared secrets are not among them.
ALGORITHMS = ("RS256", "RS384", "RS512", "PS256", "PS384", "PS512", "ES256", "ES384", "ES512", "EdDSA")


@dataclass(frozen=True, slots=True)
class Issuer:
    """Whose tokens are taken.

    Attributes
    ----------
    name, audience : str
        What `iss` and `aud` have to be.
    keys : str
        Path or URL of its JSON Web Key Set.
    algorithms : tuple of str
        Of `ALGORITHMS`; a token's own word on that counts for nothing.
    leeway : float
        Seconds that its clock and this one may differ.
    """

    name: str
    audience: str
    keys: str
    algorithms: tuple[str, ...] = ("RS256", "ES256", "EdDSA")
    leeway: float = 30.0
