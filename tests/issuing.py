"""Keys with roles, for the tests that need them."""

from __future__ import annotations

import hashlib
import json

from service.admission.keys import Role

ADMIN, OPEN = "sesame-that-may-do-everything", "open-sesame-to-all"
PREFIX = "hq-"
PAGE = "https://fleet.example"


def key_of(role: Role, maps: str = "") -> str:
    return f"key-that-may-{role}-{maps or 'all'}"


# Their roles, and the maps that they are for.
KEYS = {key_of(role, maps): ([str(role)], maps) for role in Role for maps in ("", PREFIX)}


def key_lines(key: str, roles: list[str], maps: str = "") -> str:
    """Return the lines of a file of keys."""
    digest = hashlib.sha256(key.encode()).hexdigest()
    prefix = f'maps = "{maps}"\n' if maps else ""
    return f'[[key]]\nname = "{key[:8]}"\nsha256 = "{digest}"\nroles = {json.dumps(roles)}\n{prefix}'


def bearer(key: str) -> dict[str, str]:
    return {"authorization": f"Bearer {key}"}
